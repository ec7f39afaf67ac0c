#pragma once
/// The force of a viscous fluid on slender rods that move each other through it.
///
/// Regularized Stokeslet segments [Cortez 2018, J. Comput. Phys. 375]: a force per length on the centrelines, linear
/// along each edge, moves the fluid, and nodes move with the fluid. With f_j the force per length at node j and w_j its
/// length (half of its edges), 8 pi mu v_i = sum of M_ij f_j. The forces on nodes are w_j f_j, so their mobility is
/// B_ij = M_ij / w_j. By reciprocity B is symmetric, up to the error of its quadrature. The solver uses A = (B + B^T) /
/// 2, which is positive definite; the change is of the order of the quadrature error. Rods therefore never gain energy
/// from a fluid at rest, and two rods act on each other equally.
///
/// Without inertia the fluid responds at once: force = -8 pi mu A^-1 v, with A at given positions. The spin about
/// tangents meets no resistance.

#include <vector>

#include "forces/stokeslet_kernels.hpp"
#include "model/mass_matrix.hpp"

namespace withe {

/// Resistance per length and viscosity to waves of wavenumber k along an infinite line. It comes from the smaller of
/// the mobilities along and across the line: 8 pi / min(4 K0(x), 2 K0(x) + 2 x K1(x)). Here x is k times the
/// regularization, and K0, K1 are modified Bessel functions. The formula follows from the transform of the kernel in
/// stokeslet_kernels.hpp.
double wave_resistance(double x);

/// Throws std::invalid_argument for a regularization that is not positive, or longer than three edges.
void check_regularization(const Model& model, double regularization);

class StokesletFluid {
 public:
  explicit StokesletFluid(const Model& model);

  /// Force per viscosity, -8 pi A^-1 v, on the nodes at q that move with `velocity`; both per unknown. Returns false if
  /// the solution fails.
  bool solve(const VectorX& q, const VectorX& velocity, VectorX& force);
  /// Length over which a point force is spread [m]. Setting another length discards earlier solutions.
  double regularization() const { return memory_.regularization; }
  void set_regularization(double regularization);
  /// Factor by which the local drag must grow if rods nearly touch and move against each other. The fluid's resistance
  /// is then at most `limit` times the sum of local drag and inertia. `inertia` is mass over viscosity and time step
  /// (per node) [m]. The factor is 1 or a power of sqrt(2). It is updated occasionally, at the positions of the last
  /// solution.
  double excess(const VectorX& inertia, double limit);
  /// A drag that couples neighbours only. It is at least the fluid's drag for any motion of a rod, except for a quarter
  /// at its ends [N s / m]. It is the drag of transverse waves of wavenumber 1 / regularization, plus the excess of
  /// shorter waves, down to two edges.
  void set_local_drag(double viscosity, MassMatrix& drag) const;
  /// A at q, three rows a node [1 / m]: 8 pi mu times velocity per force.
  Eigen::MatrixXd mobility(const VectorX& q);
  /// Memory for later solutions: the last ones, as initial guesses, and the state at which the parts of A were
  /// factorised.
  struct Memory {
    VectorX solution, past[2];  ///< last solution, and the two before it
    int known = 0;              ///< number of known solutions
    VectorX factorized_at;      ///< empty: not yet
    int iterations = 0, fresh_iterations = 0;
    VectorX wave;  ///< the motion that is resisted most compared with local drag and inertia
    double excess = 1.0;
    int waited = 0;
    double regularization = 0;  ///< [m]
  };
  const Memory& memory() const { return memory_; }
  /// Continues from this memory, with bit-identical results.
  void recall(const Memory& memory);
  /// As it was before its first solution.
  void forget();
  /// Iterations of the last solution.
  int iterations() const { return memory_.iterations; }

 private:
  /// Nodes next to each other, whose own mobility is factorised.
  struct Chunk {
    std::vector<int> nodes;
    Eigen::MatrixXd factor;  ///< Cholesky's, its lower triangle
    VectorX part;
  };
  void place(const VectorX& q);
  void assemble();
  void add_row(int node);
  double* row(int node, int entry);
  bool factorize(const VectorX& q);
  void precondition(const VectorX& from, VectorX& to);
  void guess();
  bool iterate(double tolerance);
  void multiply_held(const VectorX& x, VectorX& y) const;
  void solve_held(VectorX& x);
  double sharpen_wave();
  void set_edge_drag();

  const Model& model_;
  std::ptrdiff_t line_;  ///< numbers a component
  VectorX node_length_, inverse_length_;
  // One slot for each node of each rod, one after the other; segment s runs from slot s to s + 1, or is none.
  std::vector<int> slot_node_;
  std::vector<int> segment_edge_;  ///< -1: none
  std::ptrdiff_t segments_;        ///< including those that fill the last line
  VectorX start_, direction_, length_, inverse_segment_, of_start_, of_end_;
  VectorX lower_, diagonal_;
  std::vector<std::ptrdiff_t> row_start_;
  std::vector<Chunk> chunks_;
  VectorX position_, right_, residual_, scaled_, search_, image_;
  VectorX node_drag_, edge_drag_;  ///< the local drag for unit viscosity: of nodes, and between them [m]
  VectorX held_;                   ///< per node, local drag and inertia [m]
  VectorX kept_;
  Memory memory_;
};

}  // namespace withe
