// Hands that yield, among the equations: forces are those of their energy, matrices the derivatives of forces, and what
// they do to the rod is what the rod feels.

#include <memory>
#include <utility>

#include <gtest/gtest.h>

#include "case_residual.hpp"
#include "model/edge_vectors.hpp"
#include "states.hpp"
#include "steps/equations.hpp"

namespace withe {
namespace {

using testing::Case;
using testing::CaseResidual;
using testing::derivative_matches;
using testing::expect_forces_of_energy;
using testing::expect_wrench_is_felt;
using testing::gradient_matches;
using testing::kRules;
using testing::MatrixX;
using testing::RandomNumbers;
using testing::SceneBuilder;

HandDescription yielding(double at, double length) {
  HandDescription hand;
  hand.at = at;
  hand.length = length;
  hand.yields = true;
  hand.stiffness = {3.0, 5.0, 4.0, 0.6, 0.9, 0.7};
  return hand;
}

/// A short hand within an edge and a long one over three, away from where they grasped.
std::vector<Case> cases(bool planar, double force_limit) {
  SceneBuilder builder;
  testing::RodMaterial material;
  if (planar) material.bend2 = material.bend1;
  builder.add_rod(planar ? testing::arc(7) : testing::helix(7), material, false, Vector3(0.0, 1.0, 0.0));
  const double whole = builder.scene.rods[0].rest_lengths.sum();
  for (const auto& [share, length] : {std::pair{0.2, 0.0}, {0.65, 0.4}}) {
    builder.support(SupportKind::hand, {0, 0});
    HandDescription& hand = builder.scene.supports.back().hand = yielding(share * whole, length * whole);
    hand.force_limit = force_limit;
    if (force_limit < 1.0) hand.stiffness = {4.0, 4.0, 4.0, 0.6, 0.9, 0.7};  // whose matrix is exact
  }
  std::vector<Case> out = testing::states_of(planar ? "arc" : "helix", builder.scene);
  RandomNumbers random(5);
  for (Case& c : out)
    for (std::size_t s = 0; s < c.model.supports.size(); ++s) {
      HandState& hand = c.state.hands[s];
      Configuration drawn;
      compute_configuration(c.model, c.state, c.state.q, drawn);
      const Vector3 normal = planar ? c.model.plane->normal : Vector3(0.3, -0.8, 0.5).normalized();
      const auto in_plane = [&](const Vector3& v) -> Vector3 {
        return planar ? Vector3(v - normal * normal.dot(v)) : v;
      };
      hand.rotation = rotation_exp(0.2 * normal);
      hand.position = in_plane(0.1 * random.vector()) + Vector3(0.2, 0.0, -0.1);
      hand.twist.setZero(static_cast<Eigen::Index>(c.model.supports[s].touched.size()));
      for (const TouchedEdge& touched : c.model.supports[s].touched) {
        const Vector3 tail = node_vector(c.model, c.state.q, c.model.edge_tail[at(touched.edge)]),
                      head = node_vector(c.model, c.state.q, c.model.edge_head[at(touched.edge)]);
        const Vector3 origin = planar ? c.model.plane->origin : Vector3(Vector3::Zero());
        hand.points.push_back(in_plane(0.1 * random.vector()) +
                              hand.rotation.transpose() *
                                  (origin + tail + touched.place * (head - tail) - hand.position));
        hand.edges.push_back(hand.rotation.transpose() * edge_directors(c.model, drawn, touched.edge));
        hand.slip.push_back(Vector3::Zero());
      }
    }
  return out;
}

std::vector<Case> all_cases(double force_limit = INFINITY) {
  std::vector<Case> out = cases(false, force_limit);
  for (Case& c : cases(true, force_limit)) out.push_back(std::move(c));
  return out;
}

/// Hands turn by an angle in the step, and move.
std::vector<SupportPose> turned_hands(const Case& c, double angle) {
  std::vector<SupportPose> poses;
  const Vector3 axis = c.model.planar() ? c.model.plane->normal : Vector3(0.6, 0.0, 0.8);
  for (const HandState& hand : c.state.hands)
    poses.push_back({hand.position + Vector3(0.02, 0.0, 0.0), rotation_exp(angle * axis) * hand.rotation});
  return poses;
}

TEST(HandForces, MatrixIsTheDerivativeOfTheResidualUnderEveryRuleHeldOrSlipping) {
  for (double limit : {static_cast<double>(INFINITY), 0.05})
    for (StepRule rule : kRules)
      for (Case c : all_cases(limit)) {
        if (rule == StepRule::energy_momentum && c.q == c.state.q)
          c.q += 10.0 * c.increment * RandomNumbers(8).vector(c.q.size());
        CaseResidual residual(c, rule);
        residual.move_hands(turned_hands(c, 0.3));
        const MatrixX J = residual.matrix(c.q);
        EXPECT_TRUE(derivative_matches([&](const VectorX& q) { return residual(q); }, c.q, J, 0.3 * c.increment))
            << c.name << ", rule " << static_cast<int>(rule) << ", limit " << limit;
      }
}

TEST(HandForces, ForcesAreThoseOfTheEnergyThatReadOutsHave) {
  for (const Case& c : all_cases()) expect_forces_of_energy(c, 0.3 * c.increment);
}

TEST(HandForces, WrenchIsWhatTheRodFeels) {
  for (double limit : {static_cast<double>(INFINITY), 0.05})
    for (const Case& c : all_cases(limit)) expect_wrench_is_felt(c, StepRule::statics);
}

/// A step of a scene whose hands have other poses, slips and stiffness, given by numbers in a row. Each hand has the
/// displacement and rotation of its start, and of its end, six stiffnesses and the limit, relative to its own. The
/// slips follow.
struct Varied {
  Varied(const Case& of, StepRule under, const VectorX& numbers) : c(of), rule(under) {
    Eigen::Index next = 0;
    const auto vector = [&] { return Vector3(numbers.segment<3>(std::exchange(next, next + 3))); };
    const Vector3 axis = c.model.planar() ? c.model.plane->normal : Vector3(0.6, 0.0, 0.8);
    for (std::size_t s = 0; s < c.state.hands.size(); ++s) {
      HandState& hand = c.state.hands[s];
      const Vector3 to = hand.position + Vector3(0.02, 0.0, 0.0);
      const Matrix3 turned = rotation_exp(0.3 * axis) * hand.rotation;
      hand.position += vector();
      hand.rotation = rotation_exp(vector()) * hand.rotation;
      const Vector3 shift = vector(), turn = vector();
      prescribed.supports.push_back({to + shift, rotation_exp(turn) * turned});
      HandDescription& own = c.model.supports[s].description.hand;
      for (double& k : own.stiffness) k *= 1.0 + numbers(next++);
      own.force_limit *= 1.0 + numbers(next++);
    }
    for (HandState& hand : c.state.hands)
      for (Vector3& slip : hand.slip) slip += vector();
  }
  static Eigen::Index size(const Case& c) {
    Eigen::Index count = 0;
    for (const HandState& hand : c.state.hands) count += 19 + 3 * static_cast<Eigen::Index>(hand.slip.size());
    return count;
  }
  /// Residual at z; and what hands remember of that of a step to q1, the slips one after the other.
  void evaluate(const VectorX& z, StepData& data) {
    parameters = initial_parameters(c.model);
    equations = std::make_unique<Equations>(c.model, EquationOptions{.rule = rule, .exact = true});
    equations->begin(c.state, parameters, rule, rule == StepRule::statics ? 0.0 : 0.3, prescribed);
    equations->evaluate(z, false, nullptr, data);
  }
  VectorX slips(const VectorX& q1) const {
    State after = c.state;
    Configuration configuration;
    compute_configuration(c.model, c.state, q1, configuration);
    after.q = q1;
    equations->hands()->accept(prescribed.supports, configuration, after);
    std::vector<double> out;
    for (const HandState& hand : after.hands)
      for (const Vector3& slip : hand.slip) out.insert(out.end(), {slip.x(), slip.y(), slip.z()});
    return Eigen::Map<const VectorX>(out.data(), static_cast<Eigen::Index>(out.size()));
  }
  /// Derivatives of the adjoint by the numbers.
  VectorX gradient(const StepAdjoint& by) const {
    VectorX out(size(c));
    Eigen::Index next = 0;
    const auto put = [&](const auto& row) {
      out.segment(next, row.size()) = row.transpose();
      next += row.size();
    };
    for (Eigen::Index s = 0; s < by.hands.positions.rows(); ++s) {
      put(by.hands.positions.row(s));
      put(by.hands.rotations.row(s));
      put(by.hands_end.positions.row(s));
      put(by.hands_end.rotations.row(s));
      const HandDescription& own = c.model.supports[static_cast<std::size_t>(s)].description.hand;
      for (int i = 0; i < 6; ++i) out(next++) = by.coefficients.hand_stiffness(s, i) * own.stiffness[at(i)];
      const double limit = by.coefficients.hand_limit(s);
      out(next++) = limit == 0.0 ? 0.0 : limit * own.force_limit;
    }
    for (Eigen::Index k = 0; k < by.hands.slips.rows(); ++k) put(by.hands.slips.row(k));
    return out;
  }

  Case c;
  StepRule rule;
  Prescribed prescribed;
  Parameters parameters;
  std::unique_ptr<Equations> equations;
};

/// Directions that stay in the plane of a planar scene: what leaves it has no meaning there.
VectorX allowed(const Case& c) {
  VectorX out = VectorX::Ones(Varied::size(c));
  if (!c.model.planar()) return out;
  const Vector3 in_plane = Vector3::Ones() - c.model.plane->normal.cwiseAbs(), about = c.model.plane->normal.cwiseAbs();
  for (std::size_t s = 0; s < c.state.hands.size(); ++s)
    for (int i = 0; i < 4; ++i)
      out.segment<3>(static_cast<Eigen::Index>(19 * s) + 3 * i) = i % 2 == 0 ? in_plane : about;
  const auto slips = static_cast<Eigen::Index>(19 * c.state.hands.size());
  out.tail(out.size() - slips).setZero();  // along d1, d2, t, whichever of these lie in the plane
  return out;
}

TEST(HandForces, AdjointIsTheDerivativeByPosesSlipsAndStiffness) {
  RandomNumbers random(21);
  for (double limit : {static_cast<double>(INFINITY), 0.05})
    for (StepRule rule : kRules)
      for (Case c : all_cases(limit)) {
        if (rule == StepRule::energy_momentum && c.q == c.state.q)
          c.q += 10.0 * c.increment * random.vector(c.q.size());
        const VectorX none = VectorX::Zero(Varied::size(c)), free = allowed(c);
        const VectorX rows = random.vector(c.model.dof_count);
        Varied step(c, rule, none);
        StepData data;
        step.evaluate(c.q, data);
        const Eigen::Index slips = step.slips(c.q).size();
        CoefficientAdjoint coefficients(c.model, 0);
        HandAdjoint after(c.model);
        for (Eigen::Index k = 0; k < after.slips.rows(); ++k) after.slips.row(k) = 3.0 * random.vector().transpose();
        if (c.model.planar()) after.slips.setZero();
        const VectorX by_slips = Eigen::Map<const VectorX>(after.slips.data(), slips);
        StepAdjoint adjoint(c.model, rows, {}, after, coefficients);
        VectorX by_end = VectorX::Zero(c.model.dof_count);
        step.equations->hands()->add_slip_adjoint(step.equations->problem(), c.q, adjoint, by_end);
        step.equations->hands()->add_adjoint(step.equations->problem(), data, step.equations->assembler(), adjoint);
        const auto scalar = [&](const VectorX& numbers) {
          Varied other(c, rule, free.cwiseProduct(numbers));
          StepData there;
          other.evaluate(c.q, there);
          return rows.dot(there.full_residual) + by_slips.dot(other.slips(c.q));
        };
        EXPECT_TRUE(gradient_matches(scalar, none, free.cwiseProduct(step.gradient(adjoint)), 1e-3))
            << c.name << ", rule " << static_cast<int>(rule) << ", limit " << limit;
        if (by_end.isZero()) continue;  // nothing slips
        const auto kept = [&](const VectorX& q1) { return by_slips.dot(step.slips(q1)); };
        EXPECT_TRUE(gradient_matches(kept, c.q, by_end, 0.3 * c.increment)) << c.name << ", limit " << limit;
      }
}

}  // namespace
}  // namespace withe
