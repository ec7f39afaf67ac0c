#pragma once
/// One function per room, which registers its types with the module. In Python, words represent enums.

#include <pybind11/pybind11.h>

#include <array>
#include <stdexcept>
#include <string>
#include <utility>

namespace withe::bindings {

namespace py = pybind11;

void register_model(py::module_& module);
void register_integrators(py::module_& module);
void register_world(py::module_& module);
void register_batch(py::module_& module);
void register_vision(py::module_& module);
void register_elastica(py::module_& module);
void register_deployment(py::module_& module);

/// Words for the values of an enum.
template <class Enum, std::size_t count>
using Words = std::array<std::pair<const char*, Enum>, count>;

template <class Enum, std::size_t count>
Enum from_word(const Words<Enum, count>& words, const std::string& word) {
  for (const auto& [name, value] : words)
    if (word == name) return value;
  throw std::invalid_argument("unknown word: " + word);
}

template <class Enum, std::size_t count>
std::string to_word(const Words<Enum, count>& words, Enum value) {
  for (const auto& [name, other] : words)
    if (other == value) return name;
  throw std::invalid_argument("unknown value of an enum");
}

/// A member that is an enum in C++ and a word in Python.
template <class Class, class Enum, std::size_t count, class... Options>
void def_word(py::class_<Class, Options...>& type, const char* name, Enum Class::* member,
              const Words<Enum, count>& words) {
  type.def_property(
      name, [member, &words](const Class& self) { return to_word(words, self.*member); },
      [member, &words](Class& self, const std::string& word) { self.*member = from_word(words, word); });
}

}  // namespace withe::bindings
