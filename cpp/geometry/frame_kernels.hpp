#pragma once
/// Frames and strains of many edges and stencils at once, by the instruction set in use. Raw pointers only: the
/// kernels behind share no code with the rest.

#include <cstddef>

#include "common/instruction_set.hpp"

namespace withe {

/// Numbers of one edge in a table of frames: an EdgeFrame<double>, its inverse length at place 9.
constexpr int kFrameNumbers = 16;
constexpr int kInverseLength = 9;

/// Edges of a configuration.
struct EdgeBatch {
  int count;
  const int *tail, *head;  ///< per edge: first unknown of its nodes
  const int* angle;        ///< per edge: unknown theta (in a plane: null)
  const double* q;
  const double *source, *reference;  ///< per edge, 3 numbers (in a plane: null)
  double* frames;                    ///< per edge, kFrameNumbers (in a plane: tangent and inverse length only)
  double* length;                    ///< per edge [m]
};

/// Stencils of two edges that both run along it.
struct StrainBatch {
  int count;
  const int* edges;  ///< two of each stencil, `edge_stride` numbers from one stencil to the next
  int edge_stride;
  const double* frames;
  const double* previous_tau;  ///< [rad] (in a plane: null)
  double* strain;              ///< columns kappa1, kappa2, tau (in a plane: kappa)
  std::ptrdiff_t column;       ///< numbers from one column to the next
};

/// Reference frames carried to where the edges are now.
struct CarryBatch {
  int count;
  const double* frames;        ///< per edge, kFrameNumbers
  double *source, *reference;  ///< per edge, 3 numbers: tangent and director, before and after
};

/// Edges of an explicit step: their frames measured from where they are now, to which the reference frames are carried.
struct AdvanceBatch {
  EdgeBatch edges;                       ///< source and reference as before
  double *next_source, *next_reference;  ///< per edge, 3 numbers
};

struct FrameKernels {
  void (*edges)(const EdgeBatch&);      ///< see edge_frame
  void (*strains)(const StrainBatch&);  ///< see bend_twist_strain
  void (*planar_edges)(const EdgeBatch&);
  void (*planar_strains)(const StrainBatch&);  ///< see planar_kappa
  void (*carry)(const CarryBatch&);            ///< see parallel_transport; rounding does not add up
  /// Both at once, and neither spin nor bow: returns the smallest cosine of the angles by which edges turn.
  double (*advance)(const AdvanceBatch&);
};

const FrameKernels& frame_kernels();

}  // namespace withe
