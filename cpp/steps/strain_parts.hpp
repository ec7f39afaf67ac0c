#pragma once
/// The stiffness of equations with the digits that its strains have: sums of stiffnesses of short edges leave few of a
/// slow motion's.

#include <vector>

#include <Eigen/Sparse>

#include "steps/equations.hpp"

namespace withe {

/// Splits the stiffness into a sum and a remainder. The sum is k g g^T over the strains of all stencils and the angles
/// of all joints, with g their gradients. The remainder has these stiffnesses removed, but keeps their forces.
class StrainParts {
 public:
  StrainParts(const Equations& system, const State& state, const Configuration& configuration);

  /// Entries of g, with one row per strain, and k.
  const std::vector<Eigen::Triplet<double>>& gradients() const { return gradients_; }
  const std::vector<double>& stiffnesses() const { return stiffnesses_; }
  /// Coefficients with negligible stiffnesses, and natural strains that keep the forces unchanged.
  const ElasticCoefficients& without() const { return without_; }

 private:
  void add_row(const ElementTable& table, int element, const double* gradient, double stiffness);
  void add_rows(const ElementTable& table, int stencil, const StrainGradients& strains, const Columns3& stiffness,
                Columns3& less, Columns3& shifted);

  ElasticCoefficients without_;
  std::vector<Eigen::Triplet<double>> gradients_;
  std::vector<double> stiffnesses_;
};

struct Curvature {
  double value = 0;     ///< w^T K w [J]
  double rounding = 0;  ///< a bound on what rounding makes of it
};

/// Curvature of the potential along a direction w, at the state with which the problem has begun.
Curvature curvature_along(Equations& system, const State& state, const VectorX& direction, StepData& scratch);

}  // namespace withe
