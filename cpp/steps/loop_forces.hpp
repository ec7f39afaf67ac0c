#pragma once
/// Closed loops of joints between rigid bodies.
///
/// Joints of bodies form a tree. The joint that would close a loop has a massless copy of its second body. Multipliers
/// hold the copy C and the body B together at the end of each step:
///   x_C = x_B    (a point of both),    w_C = w_B    (Cayley vectors of their turns in the step).
/// The force E lambda and the moment E mu act on C, and their opposites on B. E contains axes of C at the start of the
/// step. Under the midpoint rules both points are in the middle of their chords, and the chords are equal. So the
/// multipliers do no work, and have no resultant force or moment: energy and momenta are exact as in a tree.
///
/// The force is E (lambda + s E^T g) with the gap g, an augmented Lagrangian. The second part is zero in the solution.
/// It makes the matrix regular where the tree alone is not, and its pivots positive. The stiffness s is that of
/// weights and springs, and of the inertia of B in a step.
///
/// Loops may have constraints that others imply: hinges of a four-bar linkage are parallel, so its parts never leave
/// their plane. Only an independent set of constraints is kept, and multipliers of the others are zero. The set is
/// found where the scene is drawn: by a decomposition of the rates of forces and moments in principal axes, so that
/// multipliers of a planar mechanism lie in its plane.

#include <array>

#include "steps/term.hpp"

namespace withe {

class LoopForces final : public Term {
 public:
  explicit LoopForces(const Model& model);

  void declare(std::vector<ElementTable*>& tables) override { tables.push_back(&table_); }
  std::string note() const override;
  void begin(StepProblem& problem) override;
  void add(const StepProblem& problem, StepData& data, const Assembler& assembler,
           std::span<double> values) const override;
  void add_rounding(const StepProblem& problem, StepData& data) const override;
  void add_adjoint(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                   StepAdjoint& adjoint) const override;

  /// Distance, and turn times the length of the scene, by which constraints that others should imply are violated at
  /// z [m].
  double greatest_violation(const StepProblem& problem, const VectorX& z) const;
  /// Adds to a symmetric matrix a stiffness along the constraints, and takes the multipliers out of the matrix. Its
  /// eigenvalues are then positive where those of the constrained scene are.
  void condense(const Assembler& assembler, const LinearSolver& from, LinearSolver& symmetric) const;

 private:
  static constexpr int kMost = 6;
  struct Closure {
    Matrix3 axes = Matrix3::Identity(), turning_axes = Matrix3::Identity();  ///< in the axes of the drawn copy
    std::array<bool, kMost> keeps{};
  };
  /// Gap and turn between copy and body at z, in the axes of the closure, over the derivative of the end of a step by
  /// z.
  std::array<double, kMost> gaps(const StepProblem& problem, const VectorX& z, std::size_t loop, Matrix3& axes,
                                 Matrix3& turning_axes) const;
  void find_closures(const Model& model);

  ElementTable table_;  ///< copy's point, body's point, copy's frame, body's frame, multipliers
  std::vector<Closure> closures_;
  std::vector<double> stiffness_, turning_stiffness_;  ///< per loop, s of forces [N/m] and of moments [N m]
};

}  // namespace withe
