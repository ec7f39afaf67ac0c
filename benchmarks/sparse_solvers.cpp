// Time to factorise the matrix of a Newton iteration, and to solve with it once, for rods that are joined or touch. The
// benchmark compares our sparse LDL^T with Eigen's SimplicialLDLT and CHOLMOD. Each uses its own approximate minimum
// degree ordering, computed beforehand, CHOLMOD also METIS. It also runs conjugate gradients on settled piles.

#include <benchmark/benchmark.h>

#include <Eigen/SparseCholesky>
#include <cmath>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "common/check.hpp"
#include "integrators/dynamics.hpp"
#include "scenes.hpp"
#include "solvers/band_ldlt.hpp"
#include "step_problem.hpp"

#ifdef WITHE_HAS_CHOLMOD
#include <cholmod.h>
#endif

namespace withe {
namespace {

constexpr double kRadius = 0.02;

testing::RodMaterial slender() {
  testing::RodMaterial m;
  m.bend1 = m.bend2 = m.twist = 1e-4 * m.stretch;
  m.rotary = 1e-4 * m.density;
  return m;
}

/// Limbs of 40 edges that leave `from` in many directions.
void add_limbs(testing::SceneBuilder& builder, const Vector3& from, int count, double length,
               std::vector<RodPass>& passes) {
  for (int k = 0; k < count; ++k) {
    const double angle = 2.0 * testing::kPi * k / count;
    const Vector3 way(std::cos(angle), std::sin(angle), -0.3 - 0.02 * k);
    passes.push_back({builder.add_rod(testing::line(from, from + length * way, 41), slender()), 0});
  }
}

/// Eight limbs joined at a hub.
SceneDescription star() {
  testing::SceneBuilder builder;
  std::vector<RodPass> passes;
  add_limbs(builder, Vector3::Zero(), 8, 1.0, passes);
  return builder.join(passes).scene;
}

/// Four limbs joined at a hub, each of which branches into three.
SceneDescription tree() {
  testing::SceneBuilder builder;
  std::vector<RodPass> hub;
  add_limbs(builder, Vector3::Zero(), 4, 1.0, hub);
  for (const RodPass& limb : hub) {
    const int end = builder.last_node(limb.rod);
    const int node = builder.scene.rods[static_cast<std::size_t>(limb.rod)].nodes[static_cast<std::size_t>(end)];
    std::vector<RodPass> passes{{limb.rod, end}};
    add_limbs(builder, builder.scene.positions.row(node).transpose(), 3, 0.3, passes);
    builder.join(passes);
  }
  return builder.join(hub).scene;
}

/// Layers of rods of 20 nodes, each pressed across the one below.
SceneDescription pile(int rods, int layers) {
  testing::SceneBuilder builder;
  builder.scene.contact.rods = true;
  builder.scene.contact.distance_tolerance = 0.1 * kRadius;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-0.45, 0.45);
  for (int i = 0; i < rods; ++i) {
    const double along = uniform(random), height = 2.05 * kRadius * (i % layers);
    const double across = (i / layers + 0.5) / ((rods + layers - 1) / layers) - 0.5;
    const Vector3 middle = i % 2 ? Vector3(across, 0.05 * along, height) : Vector3(0.05 * along, across, height);
    const Vector3 half = i % 2 ? Vector3(0, 0.5, 0) : Vector3(0.5, 0, 0);
    builder.add_rod(testing::line(middle - half, middle + half, 20), slender());
    RodDescription& rod = builder.scene.rods.back();
    rod.contact_radius.setConstant(rod.rest_lengths.size(), kRadius);
  }
  return builder.scene;
}

/// Square net of cords, which are pinned to each other at their nodes.
SceneDescription net(int cords) {
  testing::SceneBuilder builder;
  for (int cord = 0; cord < cords; ++cord) {
    for (bool across : {false, true}) {
      MatrixX3 points(cords, 3);
      for (int i = 0; i < cords; ++i) points.row(i) << (across ? cord : i), (across ? i : cord), 0;
      builder.add_rod(0.05 * points, slender());
    }
  }
  return builder.scene;
}

/// The matrix of a step that sets out from where a scene is drawn.
struct Problem : BenchmarkProblem {
  VectorX force;

  explicit Problem(const SceneDescription& scene) : BenchmarkProblem(scene, false, Integrator::backward_euler) {
    if (Contact* contact = equations.contact()) contact->initialise(state, parameters);
    equations.begin(state, parameters, StepRule::backward_euler, 1e-3);
    StepData e;
    equations.evaluate(state.q, true, nullptr, e);
    force = VectorX::Ones(state.q.size());
  }
};

/// Lower triangle of the matrix of the last evaluation.
Eigen::SparseMatrix<double> lower_triangle(BenchmarkProblem& p) {
  const SparsityPattern& pattern = p.equations.assembler().pattern();
  LinearSolver& solver = p.solver();
  std::vector<Eigen::Triplet<double>> entries;
  for (int column = 0; column < pattern.size; ++column)
    for (int k = pattern.column_starts[static_cast<std::size_t>(column)];
         k < pattern.column_starts[static_cast<std::size_t>(column) + 1]; ++k) {
      const int row = pattern.row_indices[static_cast<std::size_t>(k)];
      if (row < column) continue;
      entries.emplace_back(row, column, solver.values()[static_cast<std::size_t>(solver.offset(row, column))]);
    }
  Eigen::SparseMatrix<double> result(pattern.size, pattern.size);
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

void by_withe(benchmark::State& run, const SceneDescription& scene) {
  Problem p(scene);
  const auto solver = make_linear_solver(p.equations.assembler().pattern(), Symmetry::symmetric, SolverKind::sparse);
  std::copy(p.solver().values().begin(), p.solver().values().end(), solver->values().begin());
  VectorX x;
  for ([[maybe_unused]] auto _ : run) {
    if (solver->factorize().status != FactorStatus::ok) run.SkipWithError("singular");
    x = p.force;
    solver->solve({x.data(), static_cast<std::size_t>(x.size())});
    benchmark::DoNotOptimize(x.data());
  }
  run.counters["unknowns"] = static_cast<double>(x.size());
}

/// Rods of 20 nodes, laid crosswise in ten layers on a floor, with lagged friction: the pile of contact.py.
SceneDescription rods_on_a_floor(int rods) {
  constexpr double kLength = 0.1, kThin = 2e-3, kModulus = 1e6, kDensity = 1000.0, kAcross = 0.2 * kLength;
  constexpr int kLayers = 10;
  const double area = testing::kPi * kThin * kThin, second = 0.25 * area * kThin * kThin;
  const testing::RodMaterial rubber{.stretch = kModulus * area,
                                    .bend1 = kModulus * second,
                                    .bend2 = kModulus * second,
                                    .twist = kModulus / 3.0 * 2.0 * second,
                                    .density = kDensity * area,
                                    .rotary = kDensity * 2.0 * second};
  testing::SceneBuilder builder;
  builder.scene.gravity = Vector3(0, 0, -9.81);
  ContactDescription& contact = builder.scene.contact;
  contact.rods = true;
  contact.friction = 0.3;
  contact.friction_law = FrictionLaw::lagged;
  contact.obstacles.emplace_back();
  contact.obstacle_friction = MatrixX3::Constant(1, 3, 0.3);
  std::mt19937 random(0);
  std::uniform_real_distribution<double> uniform(0.0, 0.1 * kAcross);
  const int rows = std::max(1, static_cast<int>(std::lround(std::sqrt(rods / kLayers * 0.2 / 1.1))));
  for (int i = 0; i < rods; ++i) {
    const int layer = i % kLayers, place = i / kLayers;
    Vector3 middle(1.1 * kLength * (place % rows) + uniform(random), kAcross * (place / rows) + uniform(random),
                   (1.005 + 2.005 * layer) * kThin);
    Vector3 half(0.5 * kLength, 0, 0);
    if (layer % 2) std::swap(middle.x(), middle.y()), std::swap(half.x(), half.y());
    builder.add_rod(testing::line(middle - half, middle + half, 20), rubber);
    RodDescription& rod = builder.scene.rods.back();
    rod.contact_radius.setConstant(rod.rest_lengths.size(), kThin);
  }
  return builder.scene;
}

/// The system of a Newton iteration in a pile whose rods press on each other, after 8 ms.
struct Settled : BenchmarkProblem {
  static constexpr double kStep = 1e-3;  // [s]
  Eigen::SparseMatrix<double> matrix;    // all of it
  VectorX residual;

  explicit Settled(const SceneDescription& scene) : BenchmarkProblem(scene, false, Integrator::backward_euler) {
    const Newton newton(model, options);
    Predictor predictor;
    StepWorkspace work;
    predictor.resize(state.q.size());
    equations.contact()->initialise(state, parameters);
    for (int k = 0; k < 8; ++k) {
      Prescribed prescribed;
      prescribed.held.q = state.q;
      const StepPlan plan{StepRule::backward_euler, kStep, 0};
      for (int tries = 0; tries < 9; ++tries) {
        const StepResult r =
            implicit_step(equations, newton, options, parameters, prescribed, plan, state, predictor, work);
        if (r.accepted) break;
        require(r.too_deep && tries < 8, "the pile did not settle");
        equations.contact()->stiffen(state, false);
      }
    }
    equations.begin(state, parameters, StepRule::backward_euler, kStep);
    equations.evaluate(state.q, true, nullptr, work.newton.data);
    residual = work.newton.data.residual;
    const Eigen::SparseMatrix<double> lower = lower_triangle(*this);
    matrix = lower.selfadjointView<Eigen::Lower>();
  }

  static Settled& of(int rods) {
    static std::map<int, std::unique_ptr<Settled>> all;
    std::unique_ptr<Settled>& one = all[rods];
    if (!one) one = std::make_unique<Settled>(rods_on_a_floor(rods));
    return *one;
  }
};

/// Solver of the couplings within single rods that lie inside the band of the stencils.
std::unique_ptr<LinearSolver> bands_of_rods(const Settled& p) {
  constexpr int kHalfBandwidth = 10;
  const int unknowns = p.model.dof_count / static_cast<int>(p.model.description.rods.size());
  const auto inside = [=](int i, int j) { return i / unknowns == j / unknowns && std::abs(i - j) <= kHalfBandwidth; };
  SparsityPattern pattern{p.model.dof_count, {0}, {}};
  for (int column = 0; column < pattern.size; ++column) {
    for (Eigen::SparseMatrix<double>::InnerIterator entry(p.matrix, column); entry; ++entry)
      if (inside(static_cast<int>(entry.row()), column)) pattern.row_indices.push_back(static_cast<int>(entry.row()));
    pattern.column_starts.push_back(static_cast<int>(pattern.row_indices.size()));
  }
  std::unique_ptr<LinearSolver> bands = make_band_ldlt(pattern);
  for (int column = 0; column < pattern.size; ++column)
    for (Eigen::SparseMatrix<double>::InnerIterator entry(p.matrix, column); entry; ++entry)
      if (entry.row() >= column && inside(static_cast<int>(entry.row()), column))
        bands->values()[static_cast<std::size_t>(bands->offset(static_cast<int>(entry.row()), column))] = entry.value();
  return bands;
}

void settled_by_factors(benchmark::State& run, int rods) {
  Settled& p = Settled::of(rods);
  VectorX x;
  for ([[maybe_unused]] auto _ : run) {
    if (p.solver().factorize().status != FactorStatus::ok) run.SkipWithError("singular");
    x = p.residual;
    p.solver().solve({x.data(), static_cast<std::size_t>(x.size())});
    benchmark::DoNotOptimize(x.data());
  }
  run.counters["unknowns"] = static_cast<double>(x.size());
  run.counters["error"] = (p.matrix * x - p.residual).norm() / p.residual.norm();
}

/// Until the residual has become `tolerance` times smaller.
void settled_by_gradients(benchmark::State& run, int rods, double tolerance) {
  Settled& p = Settled::of(rods);
  const std::unique_ptr<LinearSolver> bands = bands_of_rods(p);
  VectorX x, r, z, d, image;
  int iterations = 0;
  for ([[maybe_unused]] auto _ : run) {
    if (bands->factorize().status != FactorStatus::ok) run.SkipWithError("singular");
    const auto precondition = [&] {
      z = r;
      bands->solve({z.data(), static_cast<std::size_t>(z.size())});
    };
    x.setZero(p.residual.size());
    r = p.residual;
    precondition();
    d = z;
    const double least = tolerance * r.norm();
    double product = r.dot(z);
    for (iterations = 0; r.norm() > least && iterations < 5000; ++iterations) {
      image.noalias() = p.matrix * d;
      const double along = product / d.dot(image);
      x += along * d;
      r -= along * image;
      precondition();
      const double before = std::exchange(product, r.dot(z));
      d = z + (product / before) * d;
    }
    benchmark::DoNotOptimize(x.data());
  }
  run.counters["iterations of CG"] = iterations;
  run.counters["error"] = (p.matrix * x - p.residual).norm() / p.residual.norm();
}

void by_eigen(benchmark::State& run, const SceneDescription& scene) {
  Problem p(scene);
  const Eigen::SparseMatrix<double> matrix = lower_triangle(p);
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver;
  solver.analyzePattern(matrix);
  VectorX x;
  for ([[maybe_unused]] auto _ : run) {
    solver.factorize(matrix);
    if (solver.info() != Eigen::Success) run.SkipWithError("singular");
    x = solver.solve(p.force);
    benchmark::DoNotOptimize(x.data());
  }
}

#ifdef WITHE_HAS_CHOLMOD
void by_cholmod(benchmark::State& run, const SceneDescription& scene, int supernodal, int ordering) {
  Problem p(scene);
  Eigen::SparseMatrix<double> matrix = lower_triangle(p);
  cholmod_common common;
  cholmod_start(&common);
  common.supernodal = supernodal;
  common.nmethods = 1;
  common.method[0].ordering = ordering;
  cholmod_sparse a{};
  a.nrow = a.ncol = static_cast<std::size_t>(matrix.rows());
  a.nzmax = static_cast<std::size_t>(matrix.nonZeros());
  a.p = matrix.outerIndexPtr();
  a.i = matrix.innerIndexPtr();
  a.x = matrix.valuePtr();
  a.stype = -1;
  a.itype = CHOLMOD_INT;
  a.xtype = CHOLMOD_REAL;
  a.dtype = CHOLMOD_DOUBLE;
  a.sorted = a.packed = 1;
  cholmod_dense b{};
  b.nrow = b.nzmax = b.d = a.nrow;
  b.ncol = 1;
  b.x = p.force.data();
  b.xtype = CHOLMOD_REAL;
  b.dtype = CHOLMOD_DOUBLE;
  cholmod_factor* factor = cholmod_analyze(&a, &common);
  for ([[maybe_unused]] auto _ : run) {
    cholmod_factorize(&a, factor, &common);
    if (common.status != CHOLMOD_OK) run.SkipWithError("not positive definite");
    cholmod_dense* x = cholmod_solve(CHOLMOD_A, factor, &b, &common);
    cholmod_free_dense(&x, &common);
  }
  cholmod_free_factor(&factor, &common);
  cholmod_finish(&common);
}
#endif

}  // namespace
}  // namespace withe

int main(int argc, char** argv) {
  using Scene = std::pair<std::string, withe::SceneDescription>;
  const std::vector<Scene> scenes{{"star of 8 limbs", withe::star()},
                                  {"tree of 16 limbs", withe::tree()},
                                  {"pile of 60 rods", withe::pile(60, 20)},
                                  {"net of 20 x 20 cords", withe::net(20)},
                                  {"net of 40 x 40 cords", withe::net(40)}};
  const auto add = [](const std::string& name, auto action) {
    benchmark::RegisterBenchmark(name.c_str(), action)->Unit(benchmark::kMicrosecond);
  };
  for (const auto& [name, scene] : scenes) {
    add(name + "/withe", [&scene](benchmark::State& run) { withe::by_withe(run, scene); });
    add(name + "/Eigen SimplicialLDLT", [&scene](benchmark::State& run) { withe::by_eigen(run, scene); });
#ifdef WITHE_HAS_CHOLMOD
    for (const auto& [how, supernodal, ordering] : {std::tuple{"simplicial", CHOLMOD_SIMPLICIAL, CHOLMOD_AMD},
                                                    {"supernodal", CHOLMOD_SUPERNODAL, CHOLMOD_AMD},
                                                    {"supernodal, METIS", CHOLMOD_SUPERNODAL, CHOLMOD_METIS}})
      add(name + "/CHOLMOD " + how, [&scene, supernodal, ordering](benchmark::State& run) {
        withe::by_cholmod(run, scene, supernodal, ordering);
      });
#endif
  }
  for (int rods : {60, 250, 1000}) {
    const std::string name = "settled pile of " + std::to_string(rods) + " rods";
    add(name + "/withe", [rods](benchmark::State& run) { withe::settled_by_factors(run, rods); });
    for (const auto& [digits, tolerance] : {std::pair{"1e-6", 1e-6}, {"1e-10", 1e-10}})
      add(name + "/conjugate gradients to " + digits,
          [rods, tolerance](benchmark::State& run) { withe::settled_by_gradients(run, rods, tolerance); });
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
