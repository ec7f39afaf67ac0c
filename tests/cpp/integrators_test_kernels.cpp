// The kernels on packs against the same sums stencil by stencil, in every scene and state.

#include <gtest/gtest.h>

#include "elasticity/discrete_elements.hpp"
#include "elasticity/discrete_gradient.hpp"
#include "integrators/step_parts.hpp"
#include "states.hpp"

namespace withe {
namespace {

using testing::Case;

/// Forces and matrix of all stencils, each by itself: what `stretch`, `bend`, `half` (index, local) say of one.
template <class Stretch, class Bend, class Half>
void add_one_by_one(const Model& model, Assembler& assembler, VectorX& force, VectorX& magnitude,
                    const Stretch& stretch, const Bend& bend, const Half& half) {
  std::fill(assembler.solver().values().begin(), assembler.solver().values().end(), 0.0);
  force.setZero(model.dof_count);
  magnitude.setZero(model.dof_count);
  Local local;
  const auto add_all = [&](const ElementTable& table, int count, const auto& set) {
    for (int i = 0; i < count; ++i) {
      set(i, local);
      table.add_gradient(i, local.gradient, 1.0, force, magnitude);
      table.add_hessian(i, local.hessian, 1.0, assembler.solver().values());
    }
  };
  add_all(assembler.stretch, model.edge_count, stretch);
  add_all(assembler.bend, static_cast<int>(model.bend.size()), bend);
  add_all(assembler.half, static_cast<int>(model.half.size()), half);
  assembler.project(force);
  assembler.project_matrix();
}

/// Elastic forces and matrix, each stencil by itself.
void add_stencil_by_stencil(const Case& c, Assembler& assembler, const ElasticCoefficients& k, VectorX& force,
                            VectorX& magnitude) {
  Configuration configuration;
  compute_configuration(c.model, c.state, c.q, configuration);
  add_one_by_one(
      c.model, assembler, force, magnitude,
      [&](int e, Local& out) { stretch_local(c.model, k, configuration, e, true, nullptr, out); },
      [&](int b, Local& out) { bend_local(c.model, bend_coefficients(k, b), configuration, b, true, out); },
      [&](int h, Local& out) { half_local(c.model, c.q, half_coefficients(k, h), configuration, h, true, out); });
}

/// Discrete gradients of the step to c.q and their matrix, each stencil by itself.
void add_discrete_stencil_by_stencil(const Case& c, Assembler& assembler, const ElasticCoefficients& k,
                                     const double* given_force, VectorX& force, VectorX& magnitude) {
  Configuration start, middle, end;
  const VectorX change = c.q - c.state.q;
  compute_configuration(c.model, c.state, c.state.q, start);
  compute_configuration(c.model, c.state, 0.5 * (c.state.q + c.q), middle);
  compute_configuration(c.model, c.state, c.q, end);
  const DiscreteStep step{start, middle, end, c.q, change};
  add_one_by_one(
      c.model, assembler, force, magnitude,
      [&](int e, Local& out) { discrete_stretch_local(c.model, k, step, e, true, given_force, out); },
      [&](int b, Local& out) { discrete_bend_local(c.model, bend_coefficients(k, b), step, b, true, out); },
      [&](int h, Local& out) { discrete_half_local(c.model, half_coefficients(k, h), step, h, true, out); });
}

/// More stencils than a pack has lanes, and a remainder.
std::vector<Case> long_cases() {
  std::vector<Case> cases;
  testing::RodMaterial curved;
  curved.curvature = {0.4, -0.3};
  curved.natural_twist = 0.5;
  testing::RodMaterial round = curved;
  round.bend2 = round.bend1;
  round.natural_twist = 0.0;
  for (int nodes : {3, 4, 6, 7, 23}) {
    testing::SceneBuilder open, flat, closed, circle;
    open.add_rod(testing::helix(nodes), curved);
    open.add_rod(testing::line(Vector3(3, 0, 0), Vector3(4, 0, 1), nodes + 2), curved);
    flat.add_rod(testing::arc(nodes), round, false, Vector3::UnitY());
    closed.add_rod(testing::ring(nodes, 1.0, 0.3), curved, true);
    circle.add_rod(testing::ring(nodes, 1.0, 0.0), round, true, Vector3::UnitZ());
    for (const auto& [name, builder] : {std::pair{"open", &open}, std::pair{"flat", &flat}, std::pair{"ring", &closed},
                                        std::pair{"ring in a plane", &circle}})
      for (Case& c : testing::states_of(name + std::to_string(nodes), builder->scene)) cases.push_back(std::move(c));
  }
  return cases;
}

void expect_same_matrix(Assembler& assembler, Assembler& reference, double tolerance, const std::string& name) {
  const std::span<const double> a = assembler.solver().values(), b = reference.solver().values();
  ASSERT_EQ(a.size(), b.size());
  double greatest = 0.0, difference = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    greatest = std::max(greatest, std::abs(b[i]));
    difference = std::max(difference, std::abs(a[i] - b[i]));
  }
  EXPECT_LT(difference, tolerance * greatest) << name;
}

void expect_same_sums(const Case& c, Integrator integrator) {
  Options options;
  options.integrator = integrator;  // energy-momentum: whole lines instead of triangles
  Equations equations(c.model, equation_options(options));
  Assembler reference(c.model, {}, equations.asymmetries().empty() ? Symmetry::symmetric : Symmetry::unsymmetric,
                      SolverKind::automatic);
  const Parameters parameters = initial_parameters(c.model);
  StepData evaluation, alone;
  equations.begin(c.state, parameters, StepRule::statics, 0.0);
  equations.evaluate(c.q, true, nullptr, evaluation);
  VectorX force, magnitude;
  add_stencil_by_stencil(c, reference, equations.elastic(), force, magnitude);
  const double scale = magnitude.maxCoeff() + 1.0;
  EXPECT_LT((evaluation.residual - force).cwiseAbs().maxCoeff(), 1e-12 * scale) << c.name;
  EXPECT_LT((evaluation.magnitude - magnitude).cwiseAbs().maxCoeff(), 1e-12 * scale) << c.name;
  expect_same_matrix(equations.assembler(), reference, 1e-12, c.name);
  equations.evaluate(c.q, false, nullptr, alone);
  EXPECT_LT((evaluation.residual - alone.residual).cwiseAbs().maxCoeff(), 1e-13 * scale) << c.name;
}

TEST(StencilKernels, AddUpToWhatStencilsGiveOneByOne) {
  for (const Case& c : testing::all_cases()) expect_same_sums(c, Integrator::implicit_midpoint);
  for (const Case& c : long_cases()) expect_same_sums(c, Integrator::implicit_midpoint);
}

TEST(StencilKernels, FillUnsymmetricMatricesToo) {
  for (const Case& c : testing::all_cases()) expect_same_sums(c, Integrator::energy_momentum);
  for (const Case& c : long_cases()) expect_same_sums(c, Integrator::energy_momentum);
}

TEST(StencilKernels, TakeTheOrdinaryStencilsOfOpenRods) {
  for (const Case& c : long_cases()) {
    if (c.name.rfind("ring", 0) == 0) continue;
    const Assembler assembler(c.model, {}, Symmetry::symmetric, SolverKind::automatic);
    EXPECT_EQ(assembler.regular.stencil.size(), c.model.bend.size()) << c.name;
    EXPECT_TRUE(assembler.regular.other_edges.empty()) << c.name;
  }
}

/// Couples of edges that spin and turn, edge by edge: at its head I omega (dt/dt x t) / l, and the opposite at its
/// tail.
VectorX spin_couples(const Model& model, const Parameters& parameters, const Configuration& c, const VectorX& v) {
  VectorX force = VectorX::Zero(model.dof_count);
  for (std::size_t e = 0; e < c.edge.size(); ++e) {
    const int a = model.tail_dof[e], b = model.head_dof[e];
    const Vector3 t = to_eigen(c.edge[e].tangent), rate = v.segment<3>(b) - v.segment<3>(a);
    const double l = c.length[static_cast<Eigen::Index>(e)];
    const double spin = parameters.edge_inertia[static_cast<Eigen::Index>(e)] * v[model.edge_dof[e]];
    const Vector3 head = (spin / (l * l)) * rate.cross(t);
    force.segment<3>(b) += head;
    force.segment<3>(a) -= head;
  }
  return force;
}

void expect_explicit_forces(const Case& c) {
  Options options;
  options.integrator = Integrator::verlet;
  Equations equations(c.model, equation_options(options)), implicit(c.model, equation_options(options));
  const Parameters parameters = initial_parameters(c.model);
  VectorX v(c.model.dof_count);
  for (Eigen::Index i = 0; i < v.size(); ++i) v[i] = std::sin(1.0 + 3.0 * static_cast<double>(i));
  State next = c.state;
  StepData lean, general;
  const double turn = advance(c.model, c.state, c.q, lean.configuration, next);
  equations.begin(next, parameters, StepRule::verlet, 0.0);
  equations.evaluate_forces(v, lean);

  State moved = c.state;
  Configuration configuration;
  compute_configuration(c.model, c.state, c.q, configuration);
  accept_configuration(c.model, c.q, configuration, moved);
  implicit.begin(moved, parameters, StepRule::statics, 0.0);
  implicit.evaluate(moved.q, false, nullptr, general);
  VectorX expected = general.full_residual;
  if (!c.model.planar()) {
    expected += spin_couples(c.model, parameters, configuration, v);
    double largest = 0.0;
    for (std::size_t e = 0; e < moved.tangent.size(); ++e)
      largest = std::max(largest, std::acos(std::min(dot(c.state.tangent[e], moved.tangent[e]), 1.0)));
    EXPECT_NEAR(turn, largest, 1e-7) << c.name;
    for (std::size_t e = 0; e < moved.tangent.size(); ++e)
      EXPECT_LT((to_eigen(next.director[e]) - to_eigen(moved.director[e])).norm(), 1e-14) << c.name;
    EXPECT_LT((next.bend_tau - moved.bend_tau).cwiseAbs().sum(), 1e-12) << c.name;
  }
  const double scale = general.magnitude.maxCoeff() + 1.0;
  EXPECT_LT((next.q - moved.q).norm(), 1e-15) << c.name;
  EXPECT_LT((lean.full_residual - expected).cwiseAbs().maxCoeff(), 1e-11 * scale) << c.name;
}

TEST(StencilKernels, GiveTheForcesOfExplicitSteps) {
  for (const Case& c : testing::all_cases()) expect_explicit_forces(c);
  for (const Case& c : long_cases()) expect_explicit_forces(c);
}

/// Adds the discrete gradient of one bending stencil, by itself.
void add_discrete_gradient(const Case& c, const ElasticCoefficients& k, const Configuration (&at_step)[3], int stencil,
                           VectorX& force) {
  const auto& [start, middle, end] = at_step;
  const BendStencil& s = c.model.bend[static_cast<std::size_t>(stencil)];
  const std::size_t edge[2] = {static_cast<std::size_t>(s.edge[0]), static_cast<std::size_t>(s.edge[1])};
  const auto row = [&](const auto& table) { return Vec3d{table(stencil, 0), table(stencil, 1), table(stencil, 2)}; };
  DiscreteMoment<double> m;
  discrete_moment<false>(k.measure, start.edge[edge[0]], end.edge[edge[0]], start.edge[edge[1]], end.edge[edge[1]],
                         row(start.bend_strain), row(end.bend_strain), row(k.bend_natural), row(k.bend_stiffness), m);
  for (int i : {0, 1}) {
    const EdgeFrame<double>&f0 = start.edge[edge[i]], &f = middle.edge[edge[i]], &f1 = end.edge[edge[i]];
    const MovingEdge<double> moving(f0.tangent, f0.inverse_length, f1.tangent, f1.inverse_length, f.tangent,
                                    f.inverse_length, turn_of_directors(f0, f1));
    const Vec3d moment = i == 0 ? m.moment : -m.moment;
    const Vector3 pull = to_eigen(moving.force(moment) + moving.torque(moment) * f.spin);
    force.segment<3>(c.model.head_dof[edge[i]]) += pull;
    force.segment<3>(c.model.tail_dof[edge[i]]) -= pull;
    force[c.model.edge_dof[edge[i]]] += moving.torque(moment);
  }
}

void expect_discrete_gradient(const Case& c) {
  Options options;
  options.integrator = Integrator::energy_momentum;
  Equations equations(c.model, equation_options(options));
  Parameters parameters = initial_parameters(c.model);
  parameters.gravity.setZero();
  equations.begin(c.state, parameters, StepRule::energy_momentum, 0.0);
  const VectorX z = 0.5 * (c.state.q + c.q);
  StepData evaluation, alone, ahead, behind;
  equations.evaluate(z, true, nullptr, evaluation);

  Configuration at_step[3];
  const VectorX q[3] = {c.state.q, z, c.q};
  for (int i = 0; i < 3; ++i) compute_configuration(c.model, c.state, q[i], at_step[i]);
  VectorX force = VectorX::Zero(c.model.dof_count);
  for (int e = 0; e < c.model.edge_count; ++e) {
    const auto i = static_cast<std::size_t>(e);
    const double sum = at_step[0].length[e] + at_step[2].length[e];
    const double strain = 0.5 * sum / c.model.edge_length[e] - 1.0;
    const int tail = c.model.tail_dof[i], head = c.model.head_dof[i];
    const Vector3 pull =
        equations.elastic().stretch_stiffness[e] * strain * 2.0 / sum * (z.segment<3>(head) - z.segment<3>(tail));
    force.segment<3>(head) += pull;
    force.segment<3>(tail) -= pull;
  }
  for (int b = 0; b < static_cast<int>(c.model.bend.size()); ++b)
    add_discrete_gradient(c, equations.elastic(), at_step, b, force);
  const double scale = evaluation.magnitude.maxCoeff() + 1.0;
  EXPECT_LT((evaluation.full_residual - force).cwiseAbs().maxCoeff(), 1e-11 * scale) << c.name;

  const VectorX x = testing::RandomNumbers(5).vector(z.size());
  VectorX expected(x.size()), y(x.size());
  const auto n = static_cast<std::size_t>(x.size());
  equations.assembler().solver().multiply({x.data(), n}, {y.data(), n});
  equations.evaluate(z, false, nullptr, alone);
  EXPECT_LT((evaluation.residual - alone.residual).cwiseAbs().maxCoeff(), 1e-13 * scale) << c.name;
  const double step = 1e-6 * c.increment;
  equations.evaluate(z + step * x, false, nullptr, ahead);
  equations.evaluate(z - step * x, false, nullptr, behind);
  expected = (ahead.residual - behind.residual) / (2.0 * step);
  EXPECT_LT((y - expected).norm(), 1e-5 * expected.norm()) << c.name;
}

/// `given`: with axial forces of their own in the matrix, as in Newton's mixed method.
void expect_same_discrete_sums(const Case& c, bool given) {
  Options options;
  options.integrator = Integrator::energy_momentum;
  Equations equations(c.model, equation_options(options));
  Assembler reference(c.model, {}, Symmetry::unsymmetric, SolverKind::automatic);
  Parameters parameters = initial_parameters(c.model);
  parameters.gravity.setZero();
  const VectorX z = 0.5 * (c.state.q + c.q), drawn = 10.0 * testing::RandomNumbers(3).vector(c.model.edge_count);
  const double* axial = given ? drawn.data() : nullptr;
  StepData evaluation, alone;
  equations.begin(c.state, parameters, StepRule::energy_momentum, 0.0);
  equations.evaluate(z, true, axial, evaluation);
  VectorX force, magnitude;
  add_discrete_stencil_by_stencil(c, reference, equations.elastic(), axial, force, magnitude);
  const double scale = magnitude.maxCoeff() + 1.0;
  // Quotients by 1 + cos of what an edge turns against the next lose digits where stencils fold over.
  EXPECT_LT((evaluation.residual - force).cwiseAbs().maxCoeff(), 1e-11 * scale) << c.name;
  EXPECT_LT((evaluation.magnitude - magnitude).cwiseAbs().maxCoeff(), 1e-11 * scale) << c.name;
  expect_same_matrix(equations.assembler(), reference, 1e-11, c.name);
  equations.evaluate(z, false, axial, alone);
  EXPECT_LT((evaluation.residual - alone.residual).cwiseAbs().maxCoeff(), 1e-13 * scale) << c.name;
}

TEST(StencilKernels, AddUpToTheDiscreteGradientsThatStencilsGiveOneByOne) {
  for (bool given : {false, true}) {
    for (const Case& c : testing::all_cases()) expect_same_discrete_sums(c, given);
    for (const Case& c : long_cases()) expect_same_discrete_sums(c, given);
  }
}

TEST(StencilKernels, GiveDiscreteGradientsInSpace) {
  int count = 0;
  for (const Case& c : long_cases()) {
    if (c.model.planar() || (c.q - c.state.q).norm() < 1e-2) continue;
    expect_discrete_gradient(c);
    ++count;
  }
  EXPECT_GT(count, 20);
}

}  // namespace
}  // namespace withe
