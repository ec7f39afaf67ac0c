#include <pybind11/stl.h>

#include "bindings.hpp"
#include "integrators/options.hpp"

namespace withe::bindings {
namespace {

constexpr Words<Integrator, 6> kIntegrators{{{"static", Integrator::statics},
                                             {"backward_euler", Integrator::backward_euler},
                                             {"implicit_midpoint", Integrator::implicit_midpoint},
                                             {"energy_momentum", Integrator::energy_momentum},
                                             {"fourth_order", Integrator::fourth_order},
                                             {"verlet", Integrator::verlet}}};
constexpr Words<Heuristic, 19> kHeuristics{{{"reuse_across_steps", Heuristic::reuse_across_steps},
                                            {"reuse_within_step", Heuristic::reuse_within_step},
                                            {"rest_from_reuse", Heuristic::rest_from_reuse},
                                            {"refresh_after_slow", Heuristic::refresh_after_slow},
                                            {"forget_contraction", Heuristic::forget_contraction},
                                            {"late_matrix", Heuristic::late_matrix},
                                            {"matrix_worth", Heuristic::matrix_worth},
                                            {"reject_stagnation", Heuristic::reject_stagnation},
                                            {"surface_search", Heuristic::surface_search},
                                            {"search_descent", Heuristic::search_descent},
                                            {"drop_geometric", Heuristic::drop_geometric},
                                            {"start_accelerated", Heuristic::start_accelerated},
                                            {"start_plain", Heuristic::start_plain},
                                            {"start_continuation", Heuristic::start_continuation},
                                            {"start_record", Heuristic::start_record},
                                            {"few_iterations", Heuristic::few_iterations},
                                            {"hold_sticking", Heuristic::hold_sticking},
                                            {"predict_friction", Heuristic::predict_friction},
                                            {"supports_linear", Heuristic::supports_linear}}};
constexpr Words<SolverKind, 3> kSolvers{
    {{"automatic", SolverKind::automatic}, {"band", SolverKind::band}, {"sparse", SolverKind::sparse}}};

}  // namespace

void register_integrators(py::module_& module) {
  py::class_<Options> options(module, "Options", "Choices of a simulation.");
  options.def(py::init<>())
      .def_readwrite("time_step", &Options::time_step)
      .def_readwrite("adaptive", &Options::adaptive)
      .def_readwrite("tolerance", &Options::tolerance)
      .def_readwrite("duration", &Options::duration)
      .def_readwrite("planar", &Options::planar)
      .def_readwrite("mixed", &Options::mixed)
      .def_readwrite("step_tolerance", &Options::step_tolerance)
      .def_readwrite("force_tolerance", &Options::force_tolerance)
      .def_readwrite("max_iterations", &Options::max_iterations)
      .def_readwrite("max_halvings", &Options::max_halvings)
      .def_readwrite("max_steps", &Options::max_steps)
      .def_readwrite("threads", &Options::threads);
  def_word(options, "integrator", &Options::integrator, kIntegrators);
  def_word(options, "solver", &Options::solver, kSolvers);
  options.def("switch_off",
              [](Options& self, const std::string& word) { self.heuristics.switch_off(from_word(kHeuristics, word)); });
  std::vector<std::string> heuristics;
  for (const auto& [word, value] : kHeuristics) heuristics.emplace_back(word);
  options.attr("heuristics") = py::tuple(py::cast(heuristics));
}

}  // namespace withe::bindings
