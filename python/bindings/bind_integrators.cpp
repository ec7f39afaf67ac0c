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
constexpr Words<LineSearch, 3> kLineSearches{{{"automatic", LineSearch::automatic},
                                              {"goldstein_price", LineSearch::goldstein_price},
                                              {"none", LineSearch::none}}};
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
      .def_readwrite("max_halvings", &Options::max_halvings);
  def_word(options, "integrator", &Options::integrator, kIntegrators);
  def_word(options, "solver", &Options::solver, kSolvers);
  def_word(options, "line_search", &Options::line_search, kLineSearches);
}

}  // namespace withe::bindings
