#pragma once
/// Inertia of many edges that spin and turn at once, in space, by the instruction set in use: see turning_inertia.hpp.
/// Only raw pointers are used, since the kernels share no code with the rest.

#include "common/instruction_set.hpp"

namespace withe {

struct TurningBatch {
  int count;
  const int *tail, *head, *angle;  ///< per edge: first unknown of its nodes, and its angle
  const double *z, *start_q, *start_v;
  double interval;                          ///< time from the start to z [s]
  const double* inertia;                    ///< per edge [kg m^2]
  const double *frames, *start_tangent;     ///< per edge: kFrameNumbers at z; 3 numbers
  const double *start_length, *end_length;  ///< per edge, of energy-momentum steps [m]
  const double* end_frames;                 ///< per edge, of energy-momentum steps, kFrameNumbers
  double *force, *torque;                   ///< results per edge: 3 numbers at its head [N]; [N m]
};

struct TurningKernels {
  void (*euler)(const TurningBatch&);
  void (*midpoint)(const TurningBatch&);
  void (*energy_momentum)(const TurningBatch&);
  /// Computes finite turns from changes of angles, at the indices `angle`: see finite_turn.
  void (*finite_turns)(int count, const int* angle, const double* change, double* turn);
};

const TurningKernels& turning_kernels();

}  // namespace withe
