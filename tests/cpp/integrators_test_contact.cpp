// Contact and friction in the equations of a step: exact matrices for every class, law and scheme, balance of forces
// and moments, work that is never gained.

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <array>

#include "derivative_check.hpp"
#include "geometry/tube.hpp"
#include "integrators/dynamics.hpp"
#include "states.hpp"

namespace withe {
namespace {

using testing::Case;
using testing::derivative_matches;
using testing::line;
using testing::MatrixX;
using testing::SceneBuilder;

constexpr double kRadius = 0.3;

SceneBuilder touching_scene(bool planar) {
  SceneBuilder builder;
  builder.scene.contact.rods = true;
  builder.scene.contact.friction = 0.4;
  builder.scene.contact.distance_tolerance = 0.3;
  builder.scene.contact.slip_tolerance = 0.5;
  builder.scene.contact.stiffness = 40.0;
  (void)planar;
  return builder;
}

void add_rod(SceneBuilder& builder, const Vector3& start, const Vector3& end, int nodes) {
  testing::RodMaterial material;
  material.bend2 = material.bend1;
  builder.add_rod(line(start, end, nodes), material, false, Vector3::UnitY());
  RodDescription& rod = builder.scene.rods.back();
  rod.contact_radius.setConstant(rod.rest_lengths.size(), kRadius);
}

struct Named {
  std::string name;
  SceneDescription scene;
};

/// An edge from start to end beside one along x.
Named edge_pair(const std::string& name, const Vector3& start, const Vector3& end) {
  SceneBuilder b = touching_scene(false);
  add_rod(b, Vector3(-0.5, 0, 0), Vector3(0.5, 0, 0), 2);
  add_rod(b, start, end, 2);
  return {name, b.scene};
}

/// Every class of contact: edges that cross, ends on edges, ends on ends, parallel edges; planes, spheres, capsules.
std::vector<Named> touching_scenes() {
  std::vector<Named> scenes;
  const auto pair = [&](const std::string& name, const Vector3& start, const Vector3& end) {
    scenes.push_back(edge_pair(name, start, end));
  };
  pair("crossing", Vector3(0.1, -0.4, 0.5), Vector3(0.2, 0.5, 0.6));
  pair("nearly parallel", Vector3(-0.4, 0.02, 0.5), Vector3(0.6, -0.03, 0.52));
  pair("parallel", Vector3(-0.2, 0, 0.5), Vector3(0.8, 0, 0.5));
  pair("end on edge", Vector3(0.1, 0.1, 0.5), Vector3(0.2, 0.3, 1.5));
  pair("end on end", Vector3(0.8, 0.1, 0.4), Vector3(1.6, 0.3, 0.9));
  pair("one edge behind the other", Vector3(1.0, 0.05, 0.02), Vector3(2.0, 0.1, 0.1));
  const auto obstacle = [&](const std::string& name, const ObstacleDescription& o, bool planar) {
    SceneBuilder b = touching_scene(planar);
    b.scene.contact.rods = false;
    add_rod(b, Vector3(-0.5, 0, 0.25), Vector3(0.5, 0, 0.35), 3);
    if (planar) b.scene.gravity = Vector3(0.5, 0, -3);
    b.scene.contact.obstacles.push_back(o);
    b.scene.contact.obstacle_friction = MatrixX3::Constant(1, 3, 0.6);
    scenes.push_back({name, b.scene});
  };
  obstacle("plane", {ObstacleKind::plane, Vector3::Zero(), Vector3(0.1, 0.2, 1).normalized(), 0, ""}, false);
  obstacle("sphere", {ObstacleKind::capsule, Vector3(0.1, 0, -0.4), Vector3(0.1, 0, -0.4), 0.4, ""}, false);
  obstacle("capsule", {ObstacleKind::capsule, Vector3(0.1, -1, -0.4), Vector3(0.3, 1, -0.3), 0.4, ""}, false);
  ObstacleDescription tube{ObstacleKind::shape, Vector3::Zero(), Vector3::Zero(), 0, ""};
  tube.shape = std::make_shared<Tube>(std::vector<Vec3d>{{-0.8, 0.05, 3.01}, {0.8, -0.05, 3.19}},
                                      std::vector<Vec3d>{{0.0, 0.1, 3.1}}, 3.0, 0.05);
  obstacle("tube", tube, false);
  obstacle("plane in a plane", {ObstacleKind::plane, Vector3::Zero(), Vector3(0.1, 0, 1).normalized(), 0, ""}, true);
  obstacle("sphere in a plane", {ObstacleKind::capsule, Vector3(0.1, 0, -0.4), Vector3(0.1, 0, -0.4), 0.4, ""}, true);
  return scenes;
}

/// A state with velocities, and a configuration that has slipped, spun and turned since the start of the step.
Case slipped(const Named& named, double size, std::optional<bool> planar = std::nullopt) {
  const Model model = build_model(named.scene, planar);
  Case c{named.name, model, initial_state(model), {}, 1e-3};
  testing::RandomNumbers random(5);
  c.state.v = 0.3 * random.vector(model.dof_count);
  c.q = c.state.q + size * random.vector(model.dof_count);
  return c;
}

/// `predicted`: after a step of Newton's method that changes nothing, whose friction is that at hand. `approach`: at
/// which the surfaces have just met.
void expect_exact(const Case& c, Integrator integrator, StepRule rule, bool predicted = false, double approach = 0.0) {
  Options options;
  options.integrator = integrator;
  Equations equations(c.model, equation_options(options));
  const Parameters parameters = initial_parameters(c.model);
  State state = c.state;
  equations.contact()->initialise(state, parameters);
  state.contacts.clear();
  for (const ContactReport& r : equations.contact()->report(state, parameters)) {
    ContactRecord record;
    record.key = r.key;
    record.stick = {0.01, 0.002, -0.01};
    record.stiffness = 40.0;
    record.approach = approach;
    state.contacts.push_back(record);
  }
  std::sort(state.contacts.begin(), state.contacts.end(),
            [](const ContactRecord& a, const ContactRecord& b) { return a.key < b.key; });
  equations.begin(state, parameters, rule, 0.3);
  StepData evaluation;
  const Eigen::Index n = c.model.dof_count;
  equations.evaluate(c.q, true, nullptr, evaluation);
  if (predicted) {
    ContactLinearisation linearisation;
    equations.predict_friction(VectorX::Zero(n), 1.0, linearisation);
    equations.evaluate(c.q, true, nullptr, evaluation, linearisation);
  }
  ASSERT_GT(equations.contact()->count(), 0) << c.name;
  MatrixX J(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const VectorX e = VectorX::Unit(n, i);
    VectorX y(n);
    equations.assembler().solver().multiply({e.data(), static_cast<std::size_t>(n)},
                                            {y.data(), static_cast<std::size_t>(n)});
    J.col(i) = y;
  }
  const auto residual = [&](const VectorX& d) {
    equations.evaluate(c.q + d, false, nullptr, evaluation);
    return evaluation.residual;
  };
  EXPECT_TRUE(derivative_matches(residual, VectorX::Zero(n), J, c.increment))
      << c.name << ", law " << static_cast<int>(c.model.description.contact.friction_law) << ", rule "
      << static_cast<int>(rule);
}

constexpr FrictionLaw kFrictionLaws[] = {FrictionLaw::implicit, FrictionLaw::lagged, FrictionLaw::anchored,
                                         FrictionLaw::semi_explicit};

/// Pairs at either side of a border between classes, and ever nearer to parallel.
std::vector<Named> border_scenes() {
  std::vector<Named> scenes;
  const auto pair = [&](const std::string& name, const Vector3& start, const Vector3& end) {
    scenes.push_back(edge_pair(name, start, end));
  };
  for (double past : {-2e-3, 2e-3}) {
    const double s_ends = 0.5 * (1.0 + kParallelWeight * 4.0 * kRadius * kRadius) + past;  // edge a, beyond its end
    pair("end on edge and end on end", Vector3(s_ends, 0, 0.5), Vector3(s_ends, 0.3, 1.5));
    const double t_ends = 0.5 * kParallelWeight * 4.0 * kRadius * kRadius + past;  // edge b, before its start
    pair("crossing and end on edge", Vector3(0.1, t_ends, 0.5), Vector3(0.1, 1.0 + t_ends, 0.5));
  }
  for (double turn : {1e-2, 1e-4, 1e-8})
    pair("nearly parallel", Vector3(-0.3, -0.5 * turn, 0.5), Vector3(0.7, 0.5 * turn, 0.5));
  return scenes;
}

TEST(Contact, MatrixIsExactNextToTheBordersOfClassesAndToParallelEdges) {
  for (Named named : border_scenes())
    for (FrictionLaw law : kFrictionLaws) {
      named.scene.contact.friction_law = law;
      Case c = slipped(named, 2e-4);
      c.increment = 3e-5;
      expect_exact(c, Integrator::backward_euler, StepRule::backward_euler);
    }
}

TEST(Contact, MatrixIsExactForEveryEnergy) {
  for (Named named : touching_scenes())
    for (ContactLaw law : {ContactLaw::imcv1, ContactLaw::barrier, ContactLaw::spillmann_teschner}) {
      named.scene.contact.law = law;
      if (law == ContactLaw::barrier)
        for (RodDescription& rod : named.scene.rods) rod.contact_radius *= 0.6;
      Case c = slipped(named, 0.02);
      if (law == ContactLaw::barrier) c.increment = 2e-4;
      expect_exact(c, Integrator::backward_euler, StepRule::backward_euler);
    }
}

/// Contact in the step from a case's state to its q.
struct ContactStep {
  explicit ContactStep(const Case& c, bool conserving = false) : state(c.state), contact(c.model) {
    const Parameters parameters = initial_parameters(c.model);
    contact.initialise(state, parameters);
    contact.begin(state, parameters, 0.3, conserving ? Pressing::mean_direction : Pressing::end);
    contact.update(c.q);
  }
  ContactStep(const ContactStep&) = delete;
  ContactStep& operator=(const ContactStep&) = delete;

  State state;
  Contact contact;
};

/// Sum of all contact forces at c.q, and its derivative.
struct ContactSum {
  VectorX gradient;
  MatrixX hessian;
};

ContactSum sum_of_contacts(const Case& c, bool conserving) {
  const ContactStep step(c, conserving);
  const Eigen::Index n = c.model.dof_count;
  ContactSum sum{VectorX::Zero(n), MatrixX::Zero(n, n)};
  for (int i = 0; i < step.contact.count(); ++i) {
    ContactLocal local;
    int dofs[kContactUnknowns];
    step.contact.local(i, true, local);
    step.contact.unknowns(i, dofs);
    for (int k = 0; k < kContactUnknowns; ++k) {
      if (dofs[k] < 0) continue;
      sum.gradient(dofs[k]) += local.gradient[k];
      for (int l = 0; l < kContactUnknowns; ++l)
        if (dofs[l] >= 0) sum.hessian(dofs[k], dofs[l]) += local.hessian[k][l];
    }
  }
  return sum;
}

/// The closed form of a rod in a plane beside a plane, against the general formulas.
TEST(Contact, OfARodInAPlaneWithAPlaneIsThatOfTheSameRodInSpace) {
  testing::RandomNumbers random(23);
  for (const Named& drawn : touching_scenes()) {
    if (drawn.name != "plane in a plane") continue;
    for (FrictionLaw law : {FrictionLaw::implicit, FrictionLaw::anchored})
      for (int k = 0; k < 40; ++k) {
        Named named = drawn;
        named.scene.contact.friction_law = law;
        named.scene.contact.centreline_friction = k % 5 == 4;
        const double size = 0.2 * std::pow(10.0, -0.03 * k);
        Case flat = slipped(named, 0.0, true), space = slipped(named, 0.0, false);
        const Plane& plane = *flat.model.plane;
        MatrixX axes = MatrixX::Zero(space.model.dof_count, flat.model.dof_count);
        for (int i = 0; i < flat.model.node_count; ++i) {
          axes.block<3, 1>(space.model.node_dof[at(i)], flat.model.node_dof[at(i)]) = plane.first;
          axes.block<3, 1>(space.model.node_dof[at(i)], flat.model.node_dof[at(i)] + 1) = plane.second;
        }
        const VectorX change = size * random.vector(flat.model.dof_count);
        flat.q += change;
        space.q += axes * change;
        flat.state.v = random.vector(flat.model.dof_count);
        space.state.v = axes * flat.state.v;
        const ContactSum a = sum_of_contacts(flat, k % 2 == 1), b = sum_of_contacts(space, k % 2 == 1);
        EXPECT_GT(a.gradient.norm(), 0.0);
        EXPECT_LT((a.gradient - axes.transpose() * b.gradient).norm(), 1e-11 * a.gradient.norm()) << k;
        // Shares of mean directions are quotients of differences.
        const double accuracy = k % 2 == 1 ? 1e-7 : 1e-11;
        EXPECT_LT((a.hessian - axes.transpose() * b.hessian * axes).norm(), accuracy * a.hessian.norm()) << k;
      }
  }
}

/// Eigenvalues of pressing alone.
VectorX pressing_eigenvalues(const Case& c, bool geometric) {
  ContactStep step(c);
  Contact& contact = step.contact;
  ContactLocal local;
  contact.local(0, true, local, {.geometric = geometric});
  MatrixX H(kContactUnknowns, kContactUnknowns);
  for (int i = 0; i < kContactUnknowns; ++i)
    for (int j = 0; j < kContactUnknowns; ++j) H(i, j) = local.hessian[i][j];
  return Eigen::SelfAdjointEigenSolver<MatrixX>(H).eigenvalues();
}

TEST(Contact, WithoutGeometricStiffnessResistsOnlyWhereSurfacesNear) {
  for (Named named : touching_scenes()) {
    if (named.scene.rods.size() != 2) continue;
    named.scene.contact.friction = 0.0;
    const Case c = slipped(named, 0.02, false);
    const VectorX exact = pressing_eigenvalues(c, true), straight = pressing_eigenvalues(c, false);
    const double greatest = straight(kContactUnknowns - 1);
    EXPECT_LT(exact(0), -1e-3 * greatest) << named.name;
    EXPECT_GT(greatest, 0.0) << named.name;
    EXPECT_LT(straight.head(kContactUnknowns - 1).cwiseAbs().maxCoeff(), 1e-12 * greatest) << named.name;
  }
}

TEST(Contact, MatrixIsExactForEveryClassLawAndScheme) {
  for (Named named : touching_scenes())
    for (FrictionLaw law : kFrictionLaws) {
      named.scene.contact.friction_law = law;
      const Case c = slipped(named, 0.02);
      expect_exact(c, Integrator::backward_euler, StepRule::backward_euler);
      expect_exact(c, Integrator::implicit_midpoint, StepRule::midpoint);
      expect_exact(c, Integrator::energy_momentum, StepRule::energy_momentum);
    }
}

TEST(Contact, MatrixIsExactInAnImpactWithAndWithoutRestitution) {
  for (Named named : touching_scenes())
    for (FrictionLaw law : kFrictionLaws)
      for (double restitution : {1.0, 0.5}) {
        named.scene.contact.friction_law = law;
        named.scene.contact.restitution = restitution;
        named.scene.contact.obstacle_restitution = VectorX::Constant(1, restitution);
        Case c = slipped(named, 0.02);
        expect_exact(c, Integrator::backward_euler, StepRule::backward_euler, false, 5.0);
        expect_exact(c, Integrator::implicit_midpoint, StepRule::midpoint, false, 5.0);
        expect_exact(c, Integrator::energy_momentum, StepRule::energy_momentum, false, 5.0);
      }
}

TEST(PressingLaw, WorksAsMuchOverAStepAsContactStoresWhileSurfacesMeet) {
  testing::RandomNumbers random(3);
  for (ContactLaw law : {ContactLaw::imcv2, ContactLaw::imcv1, ContactLaw::spillmann_teschner})
    for (int k = 0; k < 200; ++k) {
      const double radii = 1.0, tolerance = 0.1;
      const PressingLaw pressing{law, radii, tolerance, 7.0, 0.0, 1.0};
      const double start = radii + 0.1 * random.normal();
      const double end = start + std::pow(10.0, -0.05 * k) * 0.1 * random.normal();
      const double stored = 7.0 * (pressing.energy(end).value - pressing.energy(start).value);
      EXPECT_NEAR(pressing.at(start, end).first * (end - start), stored, 1e-9 * std::abs(stored) + 1e-15);
      // It never pushes more than the surfaces do that are nearest.
      const double most = std::min(7.0 * pressing.energy(std::min(start, end)).first, 0.0);
      EXPECT_GE(pressing.at(start, end).first, most * (1.0 + 1e-12));
    }
}

TEST(Contact, MatrixIsExactWhereFrictionIsPredictedAsItIs) {
  for (Named named : touching_scenes())
    for (FrictionLaw law : kFrictionLaws) {
      named.scene.contact.friction_law = law;
      expect_exact(slipped(named, 0.02), Integrator::backward_euler, StepRule::backward_euler, true);
    }
}

/// Generalised forces of the contact of two edges at c.q, over a0, a1, b0, b1 and both angles.
std::array<double, kContactUnknowns> forces_of_pair(const Case& c) {
  ContactStep step(c);
  const Contact& contact = step.contact;
  std::array<double, kContactUnknowns> sum{};
  for (int i = 0; i < contact.count(); ++i) {
    ContactLocal local;
    contact.local(i, false, local);
    for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += local.gradient[k];
  }
  return sum;
}

/// Work of all contacts over the step to c.q, pressing included [J].
double work_of_contact(const Case& c) {
  ContactStep step(c);
  const Contact& contact = step.contact;
  double work = 0.0;
  for (int i = 0; i < contact.count(); ++i) {
    ContactLocal local;
    int dofs[kContactUnknowns];
    contact.local(i, false, local);
    contact.unknowns(i, dofs);
    for (int k = 0; k < kContactUnknowns; ++k)
      if (dofs[k] >= 0) work += local.gradient[k] * (c.q(dofs[k]) - c.state.q(dofs[k]));
  }
  return work;
}

TEST(Contact, PressingGainsNothingAndTurnsNothingInAnEnergyMomentumStep) {
  testing::RandomNumbers random(11);
  int gained_else = 0;
  for (Named named : touching_scenes()) {
    named.scene.contact.friction = 0.0;
    named.scene.contact.obstacle_friction.setZero();
    for (int k = 0; k < 40; ++k) {
      Case c = slipped(named, 0.0, false);
      const VectorX change = (0.002 * (k + 1)) * random.vector(c.model.dof_count);
      c.q = c.state.q + change;
      gained_else += ContactStep(c).contact.pressing_gain(change) > 1e-6;
      const ContactStep step(c, true);
      EXPECT_LT(step.contact.pressing_gain(change), 1e-13) << named.name << ", " << k;
      if (named.scene.rods.size() != 2) continue;
      ContactLocal local;
      int dofs[kContactUnknowns];
      step.contact.local(0, false, local);
      step.contact.unknowns(0, dofs);
      Vector3 moment = Vector3::Zero();
      for (int node = 0; node < 4; ++node) {
        const double* g = local.gradient + 3 * node;
        const Vector3 middle = c.state.q.segment<3>(dofs[3 * node]) + 0.5 * change.segment<3>(dofs[3 * node]);
        moment += middle.cross(Vector3(g[0], g[1], g[2]));
      }
      EXPECT_LT(moment.norm(), 1e-12) << named.name << ", " << k;
    }
  }
  EXPECT_GT(gained_else, 10);
}

TEST(Contact, ForcesAndMomentsOfAPairAddUpToNothingUnderEveryLaw) {
  for (Named named : touching_scenes()) {
    if (named.scene.rods.size() != 2) continue;
    for (FrictionLaw law : kFrictionLaws) {
      named.scene.contact.friction_law = law;
      Case c = slipped(named, 0.02, false);
      if (law == FrictionLaw::lagged || law == FrictionLaw::semi_explicit) c.q = c.state.q;  // whose J they use
      if (law == FrictionLaw::semi_explicit) c.state.v *= 10.0;
      const auto at = [&](int node) -> Vector3 {
        return c.q.segment<3>(c.model.node_dof[static_cast<std::size_t>(node)]);
      };
      // Measured from where they are, edges turn with the pair by what its spin has along them.
      for (int e : {0, 1})
        c.state.tangent[static_cast<std::size_t>(e)] = to_vec3((at(2 * e + 1) - at(2 * e)).normalized());
      const auto g = forces_of_pair(c);
      Vector3 force = Vector3::Zero(), moment = Vector3::Zero();
      double size = 0.0;
      for (int node = 0; node < 4; ++node) {
        const Vector3 f(g[static_cast<std::size_t>(3 * node)], g[static_cast<std::size_t>(3 * node + 1)],
                        g[static_cast<std::size_t>(3 * node + 2)]);
        force += f;
        moment += at(node).cross(f);
        size = std::max(size, f.norm());
      }
      for (int e : {0, 1})
        moment += g[static_cast<std::size_t>(12 + e)] * to_eigen(c.state.tangent[static_cast<std::size_t>(e)]);
      ASSERT_GT(size, 0.1) << named.name;
      EXPECT_LT(force.norm(), 1e-13 * size) << named.name << ", law " << static_cast<int>(law);
      EXPECT_LT(moment.norm(), 1e-12 * size) << named.name << ", law " << static_cast<int>(law);
    }
  }
}

TEST(Contact, FrictionTakesWorkUnderEveryLawHoweverSurfacesSlip) {
  for (Named named : touching_scenes())
    for (FrictionLaw law : {FrictionLaw::implicit, FrictionLaw::lagged, FrictionLaw::semi_explicit}) {
      named.scene.contact.friction_law = law;
      for (double size : {-0.1, -0.01, 0.01, 0.1}) {
        const Case c = slipped(named, size);
        const auto with = work_of_contact(c);
        Named smooth = named;
        smooth.scene.contact.friction = 0.0;
        smooth.scene.contact.obstacle_friction.setZero();
        Case without = slipped(smooth, size);
        EXPECT_GE(with - work_of_contact(without), -1e-14 * std::abs(with))
            << named.name << ", law " << static_cast<int>(law);
      }
    }
}

}  // namespace
}  // namespace withe
