#pragma once
/// Equations of a scene whose supports hold or let slide, as functions of the unknowns.

#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "derivative_check.hpp"
#include "states.hpp"
#include "steps/equations.hpp"

namespace withe::testing {

inline constexpr StepRule kRules[] = {StepRule::statics, StepRule::backward_euler, StepRule::midpoint,
                                      StepRule::energy_momentum};

/// The residual of a case in one step of a rule.
struct CaseResidual {
  CaseResidual(const Case& of, StepRule under)
      : c(of),
        rule(under),
        interval(under == StepRule::statics ? 0.0 : 0.3),
        parameters(initial_parameters(of.model)),
        with(of.model, {.rule = under}) {
    begin();
  }
  void begin() { with.begin(c.state, parameters, rule, interval, prescribed); }
  /// Hands go there in the step.
  void move_hands(std::vector<SupportPose> poses) {
    prescribed.supports = std::move(poses);
    begin();
  }
  VectorX operator()(const VectorX& q) {
    with.evaluate(q, false, nullptr, data);
    return data.full_residual;
  }
  MatrixX matrix(const VectorX& q) {
    with.evaluate(q, true, nullptr, data);
    const Eigen::Index n = c.model.dof_count;
    MatrixX J(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
      VectorX e = VectorX::Unit(n, i), y(n);
      with.assembler().solver().multiply({e.data(), static_cast<std::size_t>(n)},
                                         {y.data(), static_cast<std::size_t>(n)});
      J.col(i) = y;
    }
    return J;
  }
  const Case& c;
  StepRule rule;
  double interval;
  Parameters parameters;
  Prescribed prescribed;
  Equations with;
  StepData data;
};

/// Without supports.
inline Case bare(const Case& c) {
  Case out = c;
  for (Support& support : out.model.supports) support.active = false;
  return out;
}

/// Forces are those of the energy that read-outs have.
inline void expect_forces_of_energy(const Case& c, double increment) {
  CaseResidual with(c, StepRule::statics);
  const auto energy = [&](const VectorX& q) {
    State there = c.state;
    there.q = q;
    Configuration configuration;
    compute_configuration(c.model, there, q, configuration);
    return hand_energy(c.model, with.parameters.measure, there, configuration);
  };
  const Case without = bare(c);
  CaseResidual rest(without, StepRule::statics);
  const VectorX forces = with(c.q) - rest(c.q);
  EXPECT_TRUE(gradient_matches(energy, c.q, forces, increment)) << c.name;
  EXPECT_NEAR(with.data.potential - rest.data.potential, energy(c.q), 1e-12) << c.name;
}

/// The wrenches of all hands are what the rod feels of them.
inline void expect_wrench_is_felt(const Case& c, StepRule rule) {
  CaseResidual with(c, rule);
  const Case without = bare(c);
  CaseResidual rest(without, rule);
  const VectorX forces = rest(c.q) - with(c.q);
  Wrench sum;
  for (const Wrench& wrench : with.data.hands) sum.force += wrench.force, sum.moment += wrench.moment;
  if (c.model.planar()) sum.moment -= c.model.plane->origin.cross(sum.force);  // where its unknowns begin
  for (const auto& [u, omega] : rigid_motions(c.model))
    EXPECT_NEAR(forces.dot(rigid_motion(c, u, omega)), sum.force.dot(u) + sum.moment.dot(omega), 1e-12) << c.name;
}

}  // namespace withe::testing
