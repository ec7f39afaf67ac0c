#pragma once
/// Energies, gradients and Hessians of many ordinary stencils at once, added straight to the residual and to the
/// matrix, by the instruction set in use. Raw pointers only: the kernels behind share no code with the rest.
///
/// A stencil here has consecutive unknowns: 11 in space (node, angle, node, angle, node) and 6 in a plane. The matrix
/// stores each line of the stencil contiguously: a column of the lower triangle, or a whole line of an unsymmetric
/// matrix. A stencil also computes the stretching of the edges that it owns, which saves one pass through the matrix.

#include <cstddef>

#include "common/instruction_set.hpp"
#include "geometry/bend_measure.hpp"

namespace withe {

struct StencilBatch {
  int count;
  const int* stencil;           ///< row in the tables below
  const int* first_unknown;     ///< of each
  const int* edges;             ///< two of each
  const double* owned;          ///< two of each: 1 where it brings the edge's stretching, else 0
  const std::ptrdiff_t* lines;  ///< per unknown of each: where its line begins in `values`
  bool lower;                   ///< lines hold the lower triangle, else all of it
  bool by_rows;                 ///< then whether they are rows

  BendMeasure measure;
  const double* frames;                        ///< table of EdgeFrame<double>
  const double *strain, *natural, *stiffness;  ///< tables of three columns, a row per stencil
  std::ptrdiff_t column;                       ///< numbers from one column to the next
  const double* force;                         ///< per edge: axial force EA eps [N]
  const double* geometric;                     ///< per edge: axial force in the Hessian [N]
  const double* modulus;                       ///< per edge: EA / L [N / m]

  double* residual;   ///< per unknown; padded by kPadding
  double* magnitude;  ///< sum of absolute contributions; padded by kPadding
  double* values;     ///< null: no Hessian; padded by kPadding

  const double* velocity;      ///< per unknown: of an explicit step in space, else null
  const double* edge_inertia;  ///< per edge, of theta [kg m^2]: of an explicit step in space, else null
};

/// Data of an energy-momentum step besides its middle, see discrete_elements.hpp. `force` of the batch is then the
/// force of the mean strain. `frames` and `strain` are in the middle.
struct MomentumBatch {
  const double *start_frames, *end_frames;  ///< tables like `frames`
  const double *start_strain, *end_strain;  ///< tables like `strain`
};

struct StencilKernels {
  double (*bend)(const StencilBatch&);  ///< returns the energy of bending and twisting [J]
  double (*planar_bend)(const StencilBatch&);
  /// Forces of an explicit step: the gradient alone, without the absolute sums, where edges' frames are measured from
  /// where they are; with the couples of edges that spin and turn, see Equations::spin_couple.
  void (*bend_forces)(const StencilBatch&);
  void (*planar_bend_forces)(const StencilBatch&);
  /// Discrete gradients, see discrete_elements.hpp; of the lines above, whole ones are filled.
  void (*momentum_bend)(const StencilBatch&, const MomentumBatch&);
  void (*planar_momentum_bend)(const StencilBatch&, const MomentumBatch&);

  // For gradients, in space.
  /// How strains f (kappa1, kappa2, tau) change where unknowns change so; three columns, like `strain`.
  void (*strain_changes)(const StencilBatch&, const double* change, double* out);
  /// Adds k g (g1 - g)^T to the matrix, where g are the gradients of strains and g1 those at the end: see
  /// add_rate_slopes.
  void (*rate_slopes)(const StencilBatch&, const MomentumBatch&);
  /// Products of the discrete gradient without the transport of the directors: rows^T times its derivatives
  /// by K (mean strain - natural strain); three columns.
  void (*momentum_changes)(const StencilBatch&, const MomentumBatch&, const double* rows, double* out);
  /// Adds rows^T times its derivatives by the end; padded by kPadding.
  void (*momentum_product)(const StencilBatch&, const MomentumBatch&, const double* rows, double* out);
};

const StencilKernels& stencil_kernels();

}  // namespace withe
