// One Newton iteration (forces, exact Hessian, factor, solve, update) of an open rod, beside LAPACK's dpbsv on the same
// band: at 101 to 10,001 nodes, in space and in a plane. WITHE_LAPACKS names the libraries to compare with, as
// label=path=symbol;label=path=symbol: each is opened by itself, so that none sees the other's BLAS.

#include <benchmark/benchmark.h>
#include <dlfcn.h>

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "scenes.hpp"
#include "step_problem.hpp"
#include "steps/elastic_forces.hpp"

namespace withe {
namespace {

constexpr int kNodes[] = {101, 201, 1001, 10001};
constexpr double kStep = 2.5e-3;  // [s]

/// A rubber rod half a metre long, bent, falling and turning: everything that a step has to look at is there.
SceneDescription open_rod(int nodes, bool planar) {
  const double radius = 5e-3, area = testing::kPi * radius * radius, second = 0.25 * testing::kPi * std::pow(radius, 4);
  testing::RodMaterial m;
  m.stretch = 1e6 * area;
  m.bend1 = m.bend2 = 1e6 * second;
  m.twist = 1e6 / 3.0 * 2.0 * second;
  m.density = 1200.0 * area;
  m.rotary = 1200.0 * 2.0 * second;
  MatrixX3 points(nodes, 3);
  for (int i = 0; i < nodes; ++i) {
    const double angle = 2.0 * i / (nodes - 1.0);
    points.row(i) << 0.25 * std::sin(angle), planar ? 0.0 : 0.1 * angle, 0.25 * std::cos(angle);
  }
  testing::SceneBuilder builder;
  builder.add_rod(points, m, false, Vector3::UnitY());
  builder.scene.gravity = Vector3(0, 0, -9.81);
  return builder.scene;
}

/// The equations of one midpoint step of such a rod, at a configuration a little off their root.
struct Problem : BenchmarkProblem {
  VectorX z;

  Problem(int nodes, bool planar) : BenchmarkProblem(open_rod(nodes, planar), planar) {
    const auto size = static_cast<double>(state.v.size());
    for (Eigen::Index i = 0; i < state.v.size(); ++i) state.v(i) = 0.1 * std::sin(4.0 * static_cast<double>(i) / size);
    z = state.q + 0.5 * kStep * state.v;
    equations.begin(state, parameters, StepRule::backward_euler, 0.5 * kStep);
  }
};

void newton_iteration(benchmark::State& run, bool planar) {
  const auto nodes = static_cast<int>(run.range(0));
  Problem p(nodes, planar);
  NewtonWorkspace work;
  LinearSolver& solver = p.solver();
  VectorX next = p.z;
  work.step.setZero(p.z.size());
  p.equations.evaluate(p.z, true, nullptr, work.data);
  predict_axial_force(p.equations.problem(), work.data, work.step, work.axial_force);
  for ([[maybe_unused]] auto _ : run) {
    p.equations.evaluate(p.z, true, work.axial_force.data(), work.data);
    if (solver.factorize().status != FactorStatus::ok) run.SkipWithError("singular");
    work.step = -work.data.residual;
    solver.solve({work.step.data(), static_cast<std::size_t>(work.step.size())});
    predict_axial_force(p.equations.problem(), work.data, work.step, work.axial_force);
    next = p.z + work.step;
    benchmark::DoNotOptimize(next.data());
  }
  run.counters["us_per_node"] =
      benchmark::Counter(1e-6 * nodes, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

/// Processor time of this thread [s], which does not count other processes.
double processor_time() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// LAPACK's dpbsv from one library, with Fortran's hidden length of the first argument.
using Dpbsv = void (*)(const char*, const int*, const int*, const int*, double*, const int*, double*, const int*, int*,
                       std::size_t);

void dpbsv(benchmark::State& run, Dpbsv solve) {
  Problem p(static_cast<int>(run.range(0)), false);
  NewtonWorkspace work;
  p.equations.evaluate(p.z, true, nullptr, work.data);
  const LinearSolver& solver = p.solver();
  const int n = solver.size(), width = 10, rows = width + 1, one = 1;
  // The lower band, column by column: its entries come out of A x, x one at every 21st unknown.
  std::vector<double> band(static_cast<std::size_t>(n * rows), 0.0), matrix, right;
  const int apart = 2 * width + 1;
  VectorX x(n), y(n);
  for (int first = 0; first < std::min(apart, n); ++first) {
    for (int i = 0; i < n; ++i) x(i) = i % apart == first ? 1.0 : 0.0;
    solver.multiply({x.data(), static_cast<std::size_t>(n)}, {y.data(), static_cast<std::size_t>(n)});
    for (int column = first; column < n; column += apart)
      for (int row = column; row <= std::min(n - 1, column + width); ++row)
        band[static_cast<std::size_t>(column * rows + row - column)] = y(row);
  }
  for ([[maybe_unused]] auto _ : run) {
    matrix = band;
    right.assign(work.data.residual.data(), work.data.residual.data() + n);
    int info = 0;
    const double start = processor_time();
    solve("L", &n, &width, &one, matrix.data(), &rows, right.data(), &n, &info, 1);
    run.SetIterationTime(processor_time() - start);
    if (info != 0) run.SkipWithError("dpbsv failed");
  }
}

void register_lapacks(const char* list) {
  std::stringstream entries(list);
  for (std::string entry; std::getline(entries, entry, ';');) {
    std::stringstream parts(entry);
    std::string label, path, symbol;
    std::getline(parts, label, '=');
    std::getline(parts, path, '=');
    std::getline(parts, symbol, '=');
    void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
    void* found = library != nullptr ? dlsym(library, symbol.c_str()) : nullptr;
    if (found == nullptr) {
      std::fprintf(stderr, "%s is left out: %s\n", label.c_str(), dlerror());
      continue;
    }
    const auto solve = reinterpret_cast<Dpbsv>(found);
    for (int nodes : kNodes)
      benchmark::RegisterBenchmark(("dpbsv " + label).c_str(), [solve](benchmark::State& run) { dpbsv(run, solve); })
          ->Arg(nodes)
          ->UseManualTime()
          ->Unit(benchmark::kMicrosecond);
  }
}

}  // namespace
}  // namespace withe

int main(int argc, char** argv) {
  for (const bool planar : {false, true})
    for (int nodes : withe::kNodes)
      benchmark::RegisterBenchmark(planar ? "newton planar" : "newton",
                                   [planar](benchmark::State& run) { withe::newton_iteration(run, planar); })
          ->Arg(nodes)
          ->Unit(benchmark::kMicrosecond);
  if (const char* list = std::getenv("WITHE_LAPACKS")) withe::register_lapacks(list);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
