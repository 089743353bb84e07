// The Python module `_palpate`. The package `palpate` around it shows its names; types and docstrings of it are in __init__.pyi.
#include "bindings/python/module.hpp"

#include "common/base/error.hpp"

namespace palpate::python {

PYBIND11_MODULE(_palpate, module) {
  module.doc() = "Palpate in C++, for the package palpate.";
  module.attr("__version__") = PALPATE_VERSION;
  // Other exceptions of C++ are RuntimeError, with the same text (pybind11).
  const auto input_error = pybind11::register_exception<InputError>(module, "InputError", PyExc_ValueError);
  input_error.attr("__module__") = "palpate";
  input_error.attr("__doc__") =
      "A file, an argument or a call that cannot be used. Its text has where, what, and what was expected.";
  add_scene(module);
  add_patch(module);
  add_room(module);
  add_rooms(module);
  add_task(module);
  add_motion(module);
  add_replay(module);
  add_recording(module);
  add_client(module);
  add_viewer(module);
}

}  // namespace palpate::python
