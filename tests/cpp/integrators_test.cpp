// The whole residual of a step against its matrix, for every scheme, and what Newton's method promises.

#include <gtest/gtest.h>

#include <limits>

#include "derivative_check.hpp"
#include "integrators/dynamics.hpp"
#include "integrators/statics.hpp"
#include "states.hpp"
#include "steps/inertia.hpp"

namespace withe {
namespace {

using testing::Case;
using testing::derivative_matches;
using testing::kPi;
using testing::MatrixX;
using testing::RodMaterial;
using testing::SceneBuilder;

enum class Scheme { statics, backward_euler, implicit_midpoint, energy_momentum };
constexpr Scheme kSchemes[] = {Scheme::statics, Scheme::backward_euler, Scheme::implicit_midpoint,
                               Scheme::energy_momentum};

Options options_of(Scheme scheme) {
  Options options;
  options.integrator = scheme == Scheme::statics             ? Integrator::statics
                       : scheme == Scheme::backward_euler    ? Integrator::backward_euler
                       : scheme == Scheme::implicit_midpoint ? Integrator::implicit_midpoint
                                                             : Integrator::energy_momentum;
  return options;
}

StepRule rule_of(Scheme scheme) { return equation_options(options_of(scheme)).rule; }

double interval_of(Scheme scheme, double dt) {
  return scheme == Scheme::statics ? 0.0 : scheme == Scheme::backward_euler ? dt : 0.5 * dt;
}

/// Compares d(residual) / dz with the solver's matrix, on the directions that supports leave free; or with the exact
/// one, on all.
void expect_matrix_is_exact(Case c, Scheme scheme, double dt, bool exact = false) {
  // The discrete gradient divides by the step, so differences about a step of nothing are rounding.
  if (scheme == Scheme::energy_momentum && c.q == c.state.q)
    c.q += 10.0 * c.increment * testing::RandomNumbers(8).vector(c.q.size());
  EquationOptions options = equation_options(options_of(scheme));
  options.exact = exact;
  Equations equations(c.model, options);
  const Parameters parameters = initial_parameters(c.model);
  equations.begin(c.state, parameters, rule_of(scheme), interval_of(scheme, dt));
  StepData evaluation;
  const VectorX& rows = exact ? evaluation.full_residual : evaluation.residual;
  const Eigen::Index n = c.model.dof_count;
  MatrixX free(n, n), J(n, n);
  equations.evaluate(c.q, true, nullptr, evaluation);
  const VectorX with_matrix = rows;
  const double scale = evaluation.row_magnitude.maxCoeff();
  for (Eigen::Index i = 0; i < n; ++i) {
    VectorX e = VectorX::Unit(n, i), y(n);
    if (!exact) equations.assembler().project(e);
    free.col(i) = e;
    equations.assembler().solver().multiply({e.data(), static_cast<std::size_t>(n)},
                                            {y.data(), static_cast<std::size_t>(n)});
    J.col(i) = y;
  }
  const auto residual = [&](const VectorX& d) {
    equations.evaluate(c.q + free * d, false, nullptr, evaluation);
    return rows;
  };
  EXPECT_LE((residual(VectorX::Zero(n)) - with_matrix).cwiseAbs().maxCoeff(), 1e-13 * scale) << c.name;
  EXPECT_TRUE(derivative_matches(residual, VectorX::Zero(n), J, c.increment))
      << c.name << ", scheme " << static_cast<int>(scheme) << ", dt " << dt;
}

/// With drag; and viscosity, where the matrix takes the rates that the residual does (not under the midpoint rules).
RodMaterial lossy(Scheme scheme) {
  RodMaterial m;
  const bool midpoint = scheme == Scheme::implicit_midpoint || scheme == Scheme::energy_momentum;
  m.viscous_time = midpoint ? 0.0 : 0.05;
  m.drag = 0.4;
  return m;
}

/// Gravity and velocities everywhere.
std::vector<Case> moving_cases(const RodMaterial& material) {
  std::vector<Case> cases = testing::all_cases(material);
  testing::RandomNumbers random(21);
  for (Case& c : cases) {
    c.model.description.gravity = c.model.planar() ? Vector3(1.0, 0.0, -3.0) : Vector3(1.0, 0.5, -3.0);
    c.state.v = 0.3 * random.vector(c.model.dof_count);
  }
  return cases;
}

TEST(GuessRecord, TriesWhatMissesEverMoreRarelyAndWhatHelpsAtOnce) {
  GuessRecord record;
  std::vector<int> tried;
  for (int solve = 0; solve < 40; ++solve) {
    if (record.skipped()) continue;
    tried.push_back(solve);
    record.note(false);
  }
  EXPECT_EQ(tried, (std::vector<int>{0, 2, 6, 14, 30}));
  record.note(true);
  EXPECT_FALSE(record.skipped());
  EXPECT_FALSE(record.skipped());
}

TEST(Equations, MatrixIsTheDerivativeOfTheResidualForEverySchemeAndScene) {
  for (Scheme scheme : kSchemes)
    for (const Case& c : moving_cases(lossy(scheme))) expect_matrix_is_exact(c, scheme, 0.3);
}

TEST(Equations, TheSameProblemGivesTheSameBitsWhateverWasEvaluatedBetween) {
  for (Scheme scheme : kSchemes)
    for (const Case& c : moving_cases(lossy(Scheme::backward_euler))) {
      Equations equations(c.model, equation_options(options_of(scheme)));
      const Parameters parameters = initial_parameters(c.model);
      equations.begin(c.state, parameters, rule_of(scheme), interval_of(scheme, 0.3));
      StepData first, again, between;
      equations.evaluate(c.q, true, nullptr, first);
      const std::span<const double> values = equations.assembler().solver().values();
      const std::vector<double> matrix(values.begin(), values.end());
      equations.evaluate(0.5 * (c.q + c.state.q), true, nullptr, between);
      equations.evaluate(c.q, true, nullptr, again);
      EXPECT_TRUE(first.residual == again.residual && first.potential == again.potential) << c.name;
      EXPECT_TRUE(std::equal(matrix.begin(), matrix.end(), equations.assembler().solver().values().begin())) << c.name;
    }
}

TEST(Equations, MatrixIsExactWithoutDragAndViscosity) {
  for (const Case& c : moving_cases({}))
    for (Scheme scheme : kSchemes) expect_matrix_is_exact(c, scheme, 0.3);
}

/// Springs across every scene and along its first edge; dampers where the matrix takes them as the residual does.
TEST(Equations, MatrixIsExactWithSpringsBetweenNodesThatNoRodCouples) {
  for (Scheme scheme : kSchemes)
    for (Case c : moving_cases({})) {
      const double damping = scheme == Scheme::implicit_midpoint ? 0.0 : 0.6;
      c.model.description.springs = {{{0, c.model.node_count - 1}, 5.0, 0.8, damping}, {{1, 0}, 7.0, 0.0, damping}};
      expect_matrix_is_exact(c, scheme, 0.3);
      for (SpringDescription& spring : c.model.description.springs) spring.damping = 0.6;
      expect_matrix_is_exact(c, scheme, 0.3, true);
    }
}

/// Rods that revolute joints and moments on what turns drive, in a plane or in space.
std::vector<Case> driven(bool planar, double damping) {
  SceneBuilder builder = testing::hinged();
  if (planar) {
    RodMaterial material;
    material.bend2 = material.bend1;
    builder = SceneBuilder();
    const Vector3 o(0.1, 0.0, 0.2), y = Vector3::UnitY();
    builder.add_rod(testing::line(Vector3(-1.8, 0.0, 0.1), o, 3), material, false, y);
    builder.add_rod(testing::line(o, Vector3(1.0, 0.0, 1.5), 4), material, false, y);
    builder.join_revolute({{0, 2}}, {1, 0}, y);
  }
  const Vector3 moment = planar ? Vector3(0.0, 0.8, 0.0) : Vector3(0.3, 0.8, -0.5);
  for (bool follower : {false, true}) builder.load(LoadKind::moment, {planar ? 1 : 2, 0}, moment, follower);
  for (JointLink& link : builder.scene.joints[0].links) {
    link.stiffness = 2.0;
    link.rest_angle = 0.7;
    link.damping = damping;
    link.moment = -0.6;
  }
  return testing::states_of("driven joint", builder.scene);
}

TEST(Equations, MatrixIsExactWithMotorsSpringsAndDampersOfRevoluteJoints) {
  for (Scheme scheme : kSchemes)
    for (bool planar : {false, true})
      for (double damping : {0.0, 0.4})
        for (const Case& c : driven(planar, damping)) {
          EXPECT_EQ(c.model.planar(), planar);
          // Newton's method takes rows of frames as they are by their Cayley vectors, where steps have moments.
          if (scheme != Scheme::energy_momentum) expect_matrix_is_exact(c, scheme, 0.3);
          expect_matrix_is_exact(c, scheme, 0.3, true);
        }
}

/// Along every rod there and back, at offsets that vary, and straight from the first rod's first edge to the last's
/// last.
void add_tendons(Model& model) {
  SceneDescription& scene = model.description;
  testing::RandomNumbers random(17);
  const auto add = [&](const std::vector<TendonGuide>& guides, double tension) {
    TendonDescription tendon{.guides = guides, .offsets = {}, .tension = tension};
    tendon.offsets.resize(static_cast<Eigen::Index>(guides.size()), 2);
    for (auto row : tendon.offsets.rowwise()) row = Vector2(0.3, -0.2).transpose() + 0.2 * random.vector(2).transpose();
    scene.tendons.push_back(std::move(tendon));
  };
  const auto last_edge = [&](std::size_t rod) { return static_cast<int>(scene.rods[rod].rest_lengths.size()) - 1; };
  for (std::size_t r = 0; r < scene.rods.size(); ++r) {
    const int rod = static_cast<int>(r), last = last_edge(r);
    std::vector<TendonGuide> guides = {{rod, 0, GuidePlace::start}};
    for (int e = 0; e <= last; ++e) guides.push_back({rod, e});
    guides.push_back({rod, last, GuidePlace::end});
    add(guides, 7.0);
    std::reverse(guides.begin(), guides.end());
    add(guides, 4.0);
  }
  const std::size_t end = scene.rods.size() - 1;
  add({{0, 0}, {static_cast<int>(end), last_edge(end)}}, 5.0);
  add({{0, 0, GuidePlace::start}, {static_cast<int>(end), last_edge(end), GuidePlace::end}}, 5.0);
}

TEST(Equations, MatrixIsExactWithTendonsAlongRodsAndStraightAcross) {
  for (Scheme scheme : kSchemes)
    for (Case c : moving_cases({})) {
      add_tendons(c.model);
      expect_matrix_is_exact(c, scheme, 0.3);
      expect_matrix_is_exact(c, scheme, 0.3, true);
    }
}

/// Between the ends of every rod, and from the first rod's first edge to the last's last.
void add_torsions(Model& model) {
  SceneDescription& scene = model.description;
  testing::RandomNumbers random(23);
  const auto last_edge = [&](int rod) {
    return static_cast<int>(scene.rods[static_cast<std::size_t>(rod)].rest_lengths.size()) - 1;
  };
  const auto add = [&](int rod, int edge, int other, int other_edge) {
    if (rod == other && edge == other_edge) return;
    const Vector3 axis = model.planar() ? model.plane->normal : Vector3(random.vector(3).normalized());
    const auto index = static_cast<std::size_t>(model.rod_first_edge[static_cast<std::size_t>(other)] + other_edge);
    const Vector3 along = model.planar() ? to_eigen(model.initial_tangent[index]) : Vector3(random.vector(3));
    const Vector3 reference = (along - along.dot(axis) * axis).normalized();
    scene.torsions.push_back({{rod, other}, {edge, other_edge}, axis, reference, 6.0, 0.4});
  };
  const int end = static_cast<int>(scene.rods.size()) - 1;
  for (int r = 0; r <= end; ++r) add(r, 0, r, last_edge(r));
  add(0, 0, end, last_edge(end));
}

TEST(Equations, MatrixIsExactWithTorsionSprings) {
  for (Scheme scheme : kSchemes)
    for (Case c : moving_cases({})) {
      add_torsions(c.model);
      expect_matrix_is_exact(c, scheme, 0.3);
      expect_matrix_is_exact(c, scheme, 0.3, true);
    }
}

void expect_exact_under_loads(bool planar) {
  for (Scheme scheme : kSchemes) {
    SceneBuilder builder;
    RodMaterial material = lossy(scheme);
    if (planar) material.bend2 = material.bend1;
    const MatrixX3 points = planar ? testing::arc(6) : testing::helix(6);
    builder.add_rod(points, material, false, Vector3(0.0, 1.0, 0.0));
    builder.scene.gravity = planar ? Vector3(1, 0, -3) : Vector3(1, 0.5, -3);
    builder.scene.added_mass(3) = 0.7;
    const Vector3 direction = planar ? Vector3(0.4, 0, -0.9) : Vector3(0.4, 0.3, -0.9);
    const Vector3 moment = planar ? Vector3(0, 0.8, 0) : Vector3(0.3, 0.8, -0.5);
    builder.load(LoadKind::force, {0, 5}, direction);
    builder.load(LoadKind::force, {0, 4}, direction, true);
    builder.load(LoadKind::distributed, {0, 0}, direction, true);
    builder.load(LoadKind::distributed, {0, 0}, direction);
    builder.load(LoadKind::moment, {0, 0}, moment);
    builder.load(LoadKind::moment, {0, 3}, moment);
    builder.support(SupportKind::clamp, {0, 0});
    for (const Case& c : testing::states_of("loads", builder.scene)) expect_matrix_is_exact(c, scheme, 0.3);
  }
}

TEST(Equations, MatrixIsExactUnderEveryKindOfLoad) {
  for (bool planar : {false, true}) expect_exact_under_loads(planar);
}

void expect_exact_between_supports(bool slides, Scheme scheme, const RodMaterial& material, bool exact = false) {
  const Vector3 axis(0.6, 0.0, 0.8);
  const Matrix3 free = slides ? Matrix3(axis * axis.transpose()) : Matrix3::Zero();
  SceneBuilder builder = testing::tee(JointForm::frame, false, material);
  builder.support(SupportKind::clamp, {0, 0}, free);
  builder.support(SupportKind::pin, {1, 0}, free);
  builder.support(SupportKind::hold_edge, {2, 2}, free);
  for (const Case& c : testing::states_of("supports", builder.scene)) expect_matrix_is_exact(c, scheme, 0.3, exact);
}

TEST(Equations, MatrixIsExactBetweenSupportsOfEveryKind) {
  for (bool slides : {false, true})
    for (Scheme scheme : kSchemes) expect_exact_between_supports(slides, scheme, lossy(scheme));
}

/// With all that turns and dissipates.
RodMaterial whole(double rotary) {
  RodMaterial material = lossy(Scheme::backward_euler);
  material.rotary = rotary;
  return material;
}

TEST(Equations, ExactMatrixHasEveryDerivativeInMotion) {
  for (const Case& c : moving_cases(whole(0.3)))
    for (Scheme scheme : kSchemes) expect_matrix_is_exact(c, scheme, 0.3, true);
}

TEST(Equations, ExactMatrixHasThoseByWhatSupportsHold) {
  for (bool slides : {false, true})
    for (Scheme scheme : kSchemes) expect_exact_between_supports(slides, scheme, whole(0.3), true);
}

TEST(Equations, MatrixWithRotaryInertiaIsExactWhereNothingMovesYet) {
  // The couple of an edge that spins and turns is left out of the matrix; it vanishes at the start of a step.
  RodMaterial material;
  material.rotary = 0.3;
  for (Case c : testing::all_cases(material)) {
    Configuration configuration;
    compute_configuration(c.model, c.state, c.q, configuration);
    accept_configuration(c.model, c.q, configuration, c.state);
    c.q = c.state.q;
    for (Scheme scheme : {Scheme::backward_euler, Scheme::implicit_midpoint}) expect_matrix_is_exact(c, scheme, 0.3);
  }
}

/// Rows of frames are moments in energy-momentum steps, and otherwise derivatives of the energy by a Cayley vector. If
/// nothing has moved yet, both agree, but their Jacobians differ by a rotation of half of the frame's rotation.
VectorX half_turned(const Model& model, const VectorX& force, const VectorX& x) {
  VectorX out = VectorX::Zero(x.size());
  for (int dof : model.frame_dof)
    if (!model.planar()) out.segment<3>(dof) = 0.5 * Vector3(x.segment<3>(dof)).cross(Vector3(force.segment<3>(dof)));
  return out;
}

TEST(Equations, EnergyMomentumIsMidpointWhereNothingMovesYet) {
  for (Case c : testing::all_cases()) {
    c.state.q = c.q;
    for (int dof : c.model.frame_dof)
      if (!c.model.planar()) c.q.segment<3>(dof).setZero();
    c.state.q = c.q;
    const Parameters parameters = initial_parameters(c.model);
    Equations a(c.model, equation_options(options_of(Scheme::energy_momentum))),
        b(c.model, equation_options(options_of(Scheme::implicit_midpoint)));
    a.begin(c.state, parameters, StepRule::energy_momentum, 0.0);
    b.begin(c.state, parameters, StepRule::statics, 0.0);
    Configuration here;
    compute_configuration(c.model, c.state, c.q, here);
    if (!c.model.planar()) accept_configuration(c.model, c.q, here, c.state);
    StepData ea, eb;
    a.evaluate(c.q, true, nullptr, ea);
    b.evaluate(c.q, true, nullptr, eb);
    EXPECT_LT((ea.residual - eb.residual).norm(), 1e-12 * (1.0 + eb.magnitude.norm())) << c.name;
    VectorX x = testing::RandomNumbers(2).vector(c.model.dof_count);
    a.assembler().project(x);
    const auto n = static_cast<std::size_t>(x.size());
    VectorX ya(x.size()), yb(x.size());
    a.assembler().solver().multiply({x.data(), n}, {ya.data(), n});
    b.assembler().solver().multiply({x.data(), n}, {yb.data(), n});
    VectorX expected = yb + half_turned(c.model, eb.full_residual, x);
    a.assembler().project(expected);
    EXPECT_LT((ya - expected).norm(), 1e-11 * yb.norm()) << c.name;
  }
}

TEST(Equations, MixedNewtonSharesTheResidual) {
  for (const Case& c : moving_cases(lossy(Scheme::backward_euler))) {
    Equations equations(c.model, equation_options(options_of(Scheme::backward_euler)));
    const Parameters parameters = initial_parameters(c.model);
    equations.begin(c.state, parameters, StepRule::backward_euler, 0.1);
    StepData plain, mixed;
    const VectorX axial = VectorX::Constant(c.model.edge_count, 2.5);
    equations.evaluate(c.q, true, nullptr, plain);
    equations.evaluate(c.q, true, axial.data(), mixed);
    EXPECT_EQ((plain.residual - mixed.residual).norm(), 0.0) << c.name;
  }
}

TEST(Equations, EnergyMomentumForcesDoTheWorkOfTheEnergyTheyChange) {
  // The discrete gradient times what it works over is the change of the energy, whatever the step: without masses,
  // drag and gravity the residual of statics is all there is.
  for (const Case& c : testing::all_cases()) {
    if (c.increment < 1e-2) continue;
    Equations equations(c.model, equation_options(options_of(Scheme::energy_momentum)));
    Parameters parameters = initial_parameters(c.model);
    parameters.gravity.setZero();
    equations.begin(c.state, parameters, StepRule::energy_momentum, 0.0);
    StepData evaluation;
    const VectorX z = 0.5 * (c.state.q + c.q);
    equations.evaluate(z, false, nullptr, evaluation);
    const auto energy_at = [&](const VectorX& q) {
      Configuration configuration;
      compute_configuration(c.model, c.state, q, configuration);
      double sum = 0.0;
      for (int e = 0; e < c.model.edge_count; ++e)
        sum += stretch_energy_of(c.model, equations.elastic(), configuration, e);
      for (int b = 0; b < static_cast<int>(c.model.bend.size()); ++b) {
        const BendTwistEnergy part = bend_energy_of(equations.elastic(), configuration, b);
        sum += part.bend + part.twist;
      }
      for (int h = 0; h < static_cast<int>(c.model.half.size()); ++h) {
        const BendTwistEnergy part = half_energy_of(equations.elastic(), configuration, h);
        sum += part.bend + part.twist;
      }
      return sum;
    };
    const double change = energy_at(c.q) - energy_at(c.state.q);
    // Rows of frames in space are moments over their Cayley vectors.
    VectorX over;
    set_working_change(equations.problem(), evaluation, c.q - c.state.q, over);
    for (int dof : c.model.frame_dof)
      if (!c.model.planar()) over.segment<3>(dof) = c.q.segment<3>(dof) - c.state.q.segment<3>(dof);
    EXPECT_NEAR(evaluation.full_residual.dot(over), change, 1e-11 * (1.0 + energy_at(c.q))) << c.name;
  }
}

TEST(Equations, SpinCoupleDoesNoWorkAndAddsNoForce) {
  RodMaterial still, spinning;
  spinning.rotary = 0.3;
  SceneBuilder a, b;
  a.add_rod(testing::helix(6), still);
  b.add_rod(testing::helix(6), spinning);
  const Case with = testing::states_of("spin", b.scene)[3], without = testing::states_of("still", a.scene)[3];
  const auto residual = [](const Case& c) {
    Equations equations(c.model, equation_options(options_of(Scheme::backward_euler)));
    const Parameters parameters = initial_parameters(c.model);
    equations.begin(c.state, parameters, StepRule::backward_euler, 0.2);
    StepData evaluation;
    equations.evaluate(c.q, false, nullptr, evaluation);
    return evaluation.full_residual;
  };
  const VectorX difference = residual(with) - residual(without);
  Vector3 force = Vector3::Zero();
  double work = 0.0, size = 0.0;
  for (int i = 0; i < with.model.node_count; ++i) {
    const int dof = with.model.node_dof[at(i)];
    const Vector3 f = difference.segment<3>(dof);
    force += f;
    size += f.norm();
    work += f.dot(with.q.segment<3>(dof) - with.state.q.segment<3>(dof));
  }
  EXPECT_GT(size, 1e-2);
  EXPECT_LT(force.norm(), 1e-12);
  EXPECT_NEAR(work, 0.0, 1e-12);
}

/// Moves every unknown by its rounding, to and fro: no row may change by more than Newton's method takes for balanced.
void expect_rounding_within_floor(const Case& c, double dt) {
  Equations equations(c.model, equation_options(options_of(Scheme::backward_euler)));
  const Parameters parameters = initial_parameters(c.model);
  equations.begin(c.state, parameters, StepRule::backward_euler, dt);
  StepData there, beside;
  equations.evaluate(c.q, false, nullptr, there);
  testing::RandomNumbers random(5);
  for (int sample = 0; sample < 10; ++sample) {
    const VectorX rounding = 0.5 * random.vector(c.q.size()).cwiseSign().cwiseProduct(c.q);
    equations.evaluate(c.q + std::numeric_limits<double>::epsilon() * rounding, false, nullptr, beside);
    for (Eigen::Index i = 0; i < c.q.size(); ++i)
      EXPECT_LE(std::abs(beside.residual(i) - there.residual(i)), 10.0 * there.floor(i)) << c.name << ", row " << i;
  }
}

TEST(Equations, FloorCoversRoundingAfterManyTurns) {
  RodMaterial material;
  material.rotary = 0.3;
  for (Case c : testing::all_cases(material)) {
    if (c.model.planar()) continue;
    for (int dof : c.model.edge_dof) {
      c.q(dof) += 2000.0 * kPi;
      c.state.q(dof) += 2000.0 * kPi;
    }
    for (double dt : {1e-2, 1e-6}) expect_rounding_within_floor(c, dt);
  }
}

TEST(Equations, FloorCoversRoundingWhereARodFoldsOver) {
  // A stencil twisted by half a turn folds over at next to no energy: the mean of its directors vanishes.
  for (double twist : {0.0, 0.999 * kPi}) {
    SceneBuilder builder;
    MatrixX3 points(4, 3);
    points << 0, 0, 0, 1, 0, 0, 2, 0, 0, 1.001, 0.01, 0;
    builder.add_rod(points);
    Case c = testing::states_of("fold", builder.scene, false).front();
    c.q(c.model.edge_dof[2]) += twist;
    testing::follow_twists(c);
    for (double dt : {1e-2, 1e-6}) expect_rounding_within_floor(c, dt);
  }
}

TEST(Newton, ConvergesQuadraticallyWithTheExactMatrix) {
  SceneBuilder builder;
  builder.add_rod(testing::helix(8));
  builder.scene.gravity = Vector3(0, 0, -0.2);
  builder.support(SupportKind::clamp, {0, 0});
  const Model model = build_model(builder.scene, false);
  Options options = options_of(Scheme::backward_euler);
  options.mixed = false;
  options.force_tolerance = 1e-13;
  Equations equations(model, equation_options(options));
  const Newton newton(model, options);
  const Parameters parameters = initial_parameters(model);
  const State state = initial_state(model);
  equations.begin(state, parameters, StepRule::backward_euler, 0.05);
  NewtonWorkspace work;
  std::vector<double> residuals;
  for (int count = 1; count <= 8; ++count) {
    VectorX z = state.q;
    newton.solve(equations, z, {.max_iterations = count}, work);
    residuals.push_back(work.data.residual.norm());
  }
  bool quadratic = false;
  for (std::size_t i = 1; i < residuals.size(); ++i)
    quadratic =
        quadratic || (residuals[i - 1] < 1e-2 && residuals[i] < 10.0 * residuals[i - 1] * residuals[i - 1] + 1e-13);
  EXPECT_TRUE(quadratic);
  EXPECT_LT(residuals.back(), 1e-11);
}

TEST(StableStep, IsTwoOverTheHighestFrequency) {
  SceneBuilder builder;
  RodMaterial material;
  material.rotary = 0.3;
  builder.add_rod(testing::helix(6), material);
  builder.support(SupportKind::pin, {0, 0});
  const Model model = build_model(builder.scene, false);
  Equations equations(model, equation_options(options_of(Scheme::statics)));
  Parameters parameters = initial_parameters(model);
  parameters.lumped = true;
  const State state = initial_state(model);
  StepWorkspace work;
  const double step = stable_step(equations, parameters, Prescribed::nothing(), state, work);
  equations.begin(state, parameters, StepRule::statics, 0.0);
  equations.evaluate(state.q, true, nullptr, work.newton.data);
  // The same by a dense eigenproblem, by repeated multiplication of the dense matrix.
  const Eigen::Index n = model.dof_count;
  MatrixX K(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    VectorX e = VectorX::Unit(n, i), y(n);
    equations.assembler().project(e);
    equations.assembler().solver().multiply({e.data(), static_cast<std::size_t>(n)},
                                            {y.data(), static_cast<std::size_t>(n)});
    K.col(i) = y;
  }
  MassMatrix mass;
  set_mass(model, parameters, mass);
  const VectorX scale = mass.rows.cwiseSqrt().cwiseInverse();
  const MatrixX A = scale.asDiagonal() * K * scale.asDiagonal();
  VectorX x = testing::RandomNumbers(4).vector(n);
  double value = 0.0;
  for (int k = 0; k < 5000; ++k) {
    const VectorX y = A * x;
    value = y.norm();
    x = y / value;
  }
  EXPECT_NEAR(step, 2.0 / std::sqrt(value), 2e-3 * step);
}

/// By how much a small motion has grown after many explicit steps, `of_stable` the stable one long.
double growth(const RodMaterial& material, double of_stable) {
  SceneBuilder builder;
  builder.add_rod(testing::line(Vector3::Zero(), Vector3(1.0, 0.5, 0.2), 6), material);
  const Model model = build_model(builder.scene, false);
  Options options;
  options.integrator = Integrator::verlet;
  Equations equations(model, equation_options(options));
  Parameters parameters = initial_parameters(model);
  parameters.lumped = true;
  State state = initial_state(model);
  StepWorkspace work;
  const double dt = of_stable * stable_step(equations, parameters, Prescribed::nothing(), state, work);
  Prescribed prescribed;
  prescribed.held.q = state.q;
  state.v = 1e-10 * testing::RandomNumbers(4).vector(model.dof_count);
  const double before = state.v.norm();
  for (int k = 0; k < 1000; ++k)
    if (!verlet_step(equations, parameters, prescribed, dt, state, work).accepted) return INFINITY;
  return state.v.norm() / before;
}

TEST(StableStep, IsWhereSmallMotionsBeginToGrowHoweverTheyAreDamped) {
  for (double drag : {0.0, 0.4, 40.0, 4000.0})
    for (double viscous_time : {0.0, 0.05}) {
      RodMaterial material;
      material.rotary = 0.3;
      material.drag = drag;
      material.viscous_time = viscous_time;
      EXPECT_LT(growth(material, 0.98), 10.0) << drag << " " << viscous_time;
      EXPECT_GT(growth(material, 1.02), 1e3) << drag << " " << viscous_time;
    }
}

}  // namespace
}  // namespace withe
