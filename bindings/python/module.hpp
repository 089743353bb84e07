// The parts of the module `_palpate`: each adds its classes and functions.
#pragma once

#include <pybind11/pybind11.h>

namespace palpate::python {

void add_scene(pybind11::module_& module);
void add_patch(pybind11::module_& module);
void add_room(pybind11::module_& module);
void add_rooms(pybind11::module_& module);
void add_task(pybind11::module_& module);
void add_motion(pybind11::module_& module);
void add_replay(pybind11::module_& module);
void add_recording(pybind11::module_& module);
void add_client(pybind11::module_& module);
void add_viewer(pybind11::module_& module);

}  // namespace palpate::python
