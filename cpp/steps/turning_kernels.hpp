#pragma once
/// Inertia of many edges that spin and turn at once, in space, by the instruction set in use: see turning_inertia.hpp.
/// Raw pointers only: the kernels behind share no code with the rest.

#include "common/instruction_set.hpp"

namespace withe {

struct TurningBatch {
  int count;
  const int *tail, *head, *angle;  ///< per edge: first unknown of its nodes, and its angle
  const double *z, *start_q, *start_v;
  double interval;                          ///< what z is after the start [s]
  const double* inertia;                    ///< per edge [kg m^2]
  const double *frames, *start_tangent;     ///< per edge: at z, kFrameNumbers; 3 numbers
  const double *start_length, *end_length;  ///< per edge, of energy-momentum steps [m]
  const double* end_frames;                 ///< per edge, of energy-momentum steps, kFrameNumbers
  double *force, *torque;                   ///< per edge, what comes out: at its head, 3 numbers [N]; [N m]
};

struct TurningKernels {
  void (*euler)(const TurningBatch&);
  void (*midpoint)(const TurningBatch&);
  void (*energy_momentum)(const TurningBatch&);
  /// Finite turns of changes of angles, by their places: see finite_turn.
  void (*finite_turns)(int count, const int* angle, const double* change, double* turn);
};

const TurningKernels& turning_kernels();

}  // namespace withe
