#include "bindings.hpp"

PYBIND11_MODULE(_core, module) {
  module.doc() = "The engine of withe. Use the package withe instead: it checks what it is given.";
  module.attr("__version__") = WITHE_VERSION;
  withe::bindings::register_model(module);
  withe::bindings::register_integrators(module);
  withe::bindings::register_world(module);
  withe::bindings::register_batch(module);
  withe::bindings::register_vision(module);
  withe::bindings::register_elastica(module);
  withe::bindings::register_deployment(module);
}
