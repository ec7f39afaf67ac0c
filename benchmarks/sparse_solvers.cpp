// Factorising the matrix of a Newton iteration, and solving with it once, where rods are joined or touch: our sparse
// LDL^T beside Eigen's SimplicialLDLT and CHOLMOD, each with its own approximate minimum degree, found beforehand.

#include <benchmark/benchmark.h>

#include <Eigen/SparseCholesky>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "scenes.hpp"
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

/// The matrix of a step that sets out from where a scene is drawn.
struct Problem : StepProblem {
  VectorX force;

  explicit Problem(const SceneDescription& scene) : StepProblem(scene, false) {
    if (Contact* contact = equations.contact()) {
      contact->set_parameters(parameters);
      contact->initialise(state);
    }
    equations.begin(state, parameters, 1e-3, false);
    Evaluation e;
    equations.evaluate(state.q, true, nullptr, e);
    force = VectorX::Ones(state.q.size());
  }

  /// Its lower triangle.
  Eigen::SparseMatrix<double> matrix() {
    const SparsityPattern& pattern = equations.assembler().pattern();
    std::vector<Eigen::Triplet<double>> entries;
    for (int column = 0; column < pattern.size; ++column)
      for (int p = pattern.column_starts[static_cast<std::size_t>(column)];
           p < pattern.column_starts[static_cast<std::size_t>(column) + 1]; ++p) {
        const int row = pattern.row_indices[static_cast<std::size_t>(p)];
        if (row < column) continue;
        entries.emplace_back(row, column, solver().values()[static_cast<std::size_t>(solver().offset(row, column))]);
      }
    Eigen::SparseMatrix<double> result(pattern.size, pattern.size);
    result.setFromTriplets(entries.begin(), entries.end());
    return result;
  }
};

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

void by_eigen(benchmark::State& run, const SceneDescription& scene) {
  Problem p(scene);
  const Eigen::SparseMatrix<double> matrix = p.matrix();
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
void by_cholmod(benchmark::State& run, const SceneDescription& scene, int supernodal) {
  Problem p(scene);
  Eigen::SparseMatrix<double> matrix = p.matrix();
  cholmod_common common;
  cholmod_start(&common);
  common.supernodal = supernodal;
  common.nmethods = 1;
  common.method[0].ordering = CHOLMOD_AMD;
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
                                  {"pile of 60 rods", withe::pile(60, 20)}};
  const auto add = [](const std::string& name, auto action) {
    benchmark::RegisterBenchmark(name.c_str(), action)->Unit(benchmark::kMicrosecond);
  };
  for (const auto& [name, scene] : scenes) {
    add(name + "/withe", [&scene](benchmark::State& run) { withe::by_withe(run, scene); });
    add(name + "/Eigen SimplicialLDLT", [&scene](benchmark::State& run) { withe::by_eigen(run, scene); });
#ifdef WITHE_HAS_CHOLMOD
    for (const auto& [how, supernodal] :
         {std::pair{"simplicial", CHOLMOD_SIMPLICIAL}, {"supernodal", CHOLMOD_SUPERNODAL}})
      add(name + "/CHOLMOD " + how,
          [&scene, supernodal](benchmark::State& run) { withe::by_cholmod(run, scene, supernodal); });
#endif
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
