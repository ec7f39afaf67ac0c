// Contact and friction in the equations of a step: exact matrices for every class, law and scheme, balance of forces
// and moments, work that is never gained.

#include <gtest/gtest.h>

#include "derivative_check.hpp"
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

/// Every class of contact: edges that cross, ends on edges, ends on ends, parallel edges; planes, spheres, capsules.
std::vector<Named> touching_scenes() {
  std::vector<Named> scenes;
  const auto pair = [&](const std::string& name, const Vector3& start, const Vector3& end) {
    SceneBuilder b = touching_scene(false);
    add_rod(b, Vector3(-0.5, 0, 0), Vector3(0.5, 0, 0), 2);
    add_rod(b, start, end, 2);
    scenes.push_back({name, b.scene});
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
    b.scene.contact.obstacle_friction = VectorX::Constant(1, 0.6);
    scenes.push_back({name, b.scene});
  };
  obstacle("plane", {ObstacleKind::plane, Vector3::Zero(), Vector3(0.1, 0.2, 1).normalized(), 0, ""}, false);
  obstacle("sphere", {ObstacleKind::capsule, Vector3(0.1, 0, -0.4), Vector3(0.1, 0, -0.4), 0.4, ""}, false);
  obstacle("capsule", {ObstacleKind::capsule, Vector3(0.1, -1, -0.4), Vector3(0.3, 1, -0.3), 0.4, ""}, false);
  obstacle("plane in a plane", {ObstacleKind::plane, Vector3::Zero(), Vector3(0.1, 0, 1).normalized(), 0, ""}, true);
  obstacle("sphere in a plane", {ObstacleKind::capsule, Vector3(0.1, 0, -0.4), Vector3(0.1, 0, -0.4), 0.4, ""}, true);
  return scenes;
}

/// A state with velocities, and a configuration that has slipped, spun and turned since the start of the step.
Case slipped(const Named& named, double size) {
  const Model model = build_model(named.scene, std::nullopt);
  Case c{named.name, model, initial_state(model), {}, 1e-3};
  testing::RandomNumbers random(5);
  c.state.v = 0.3 * random.vector(model.dof_count);
  c.q = c.state.q + size * random.vector(model.dof_count);
  return c;
}

void expect_exact(const Case& c, Integrator integrator, Inner inner) {
  Options options;
  options.integrator = integrator;
  Equations equations(c.model, options);
  const Parameters parameters = initial_parameters(c.model);
  State state = c.state;
  equations.contact()->set_parameters(parameters);
  equations.contact()->initialise(state);
  state.contacts.clear();
  for (const ContactReport& r : equations.contact()->report(state)) {
    ContactRecord record;
    record.key = r.key;
    record.stick = {0.01, 0.002, -0.01};
    record.stiffness = 40.0;
    state.contacts.push_back(record);
  }
  std::sort(state.contacts.begin(), state.contacts.end(),
            [](const ContactRecord& a, const ContactRecord& b) { return a.key < b.key; });
  equations.begin(state, parameters, 0.3, integrator == Integrator::energy_momentum, inner);
  Evaluation evaluation;
  const Eigen::Index n = c.model.dof_count;
  equations.evaluate(c.q, true, nullptr, evaluation);
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
      << c.name << ", law " << static_cast<int>(c.model.description.contact.friction_law) << ", inner "
      << static_cast<int>(inner);
}

TEST(Contact, MatrixIsExactForEveryClassLawAndScheme) {
  for (Named named : touching_scenes())
    for (FrictionLaw law : {FrictionLaw::implicit, FrictionLaw::lagged, FrictionLaw::anchored}) {
      named.scene.contact.friction_law = law;
      const Case c = slipped(named, 0.02);
      expect_exact(c, Integrator::backward_euler, Inner::end);
      expect_exact(c, Integrator::implicit_midpoint, Inner::middle);
    }
}

}  // namespace
}  // namespace withe
