// Room: a body and the tools on it in this process (bindings/core/local_room.hpp).
#include "bindings/core/local_room.hpp"

#include <pybind11/stl.h>

#include <map>

#include "bindings/python/arrays.hpp"
#include "bindings/python/frames.hpp"
#include "bindings/python/module.hpp"

namespace palpate::python {
namespace {

/// Tools of a step: an array is the path of tool 1; a dict has paths by id.
using Paths = std::vector<std::pair<StationId, std::vector<ToolSample>>>;

void add(Paths& paths, StationId id, const py::handle& path) {
  const std::string where = "path of tool " + std::to_string(id);
  const Positions array = Positions::ensure(path);
  if (!array) throw InputError(where, "is no array of numbers", "an array of the shape (n, 3) [m]");
  paths.emplace_back(id, poses_of(array, where));
}

StationId tool_named(const py::handle& key) {
  py::detail::make_caster<StationId> caster;
  if (!caster.load(key, true)) throw InputError("path", "is of tool " + py::repr(key).cast<std::string>(), "the tools 1, 2, ...");
  return py::detail::cast_op<StationId>(caster);
}

Paths paths_of(const py::object& given) {
  Paths paths;
  if (py::isinstance<py::dict>(given))
    for (const auto& [id, path] : given.cast<py::dict>()) add(paths, tool_named(id), path);
  else
    add(paths, 1, given);
  return paths;
}

LocalStep options_of(bool patches, const std::string& scheme, int order, double horizon_s, bool shape) {
  if (!(horizon_s >= 0 && horizon_s <= 1)) throw InputError("horizon_s", "is " + std::to_string(horizon_s), "0 to 1");
  if (order < 0 || order > 2 * kMaxModes)
    throw InputError("order", "is " + std::to_string(order), "0 to " + std::to_string(2 * kMaxModes));
  return {.patches = patches, .scheme = scheme_named(scheme), .order = order, .horizon = from_seconds(horizon_s), .shape = shape};
}

Frame step(LocalRoom& room, const py::object& given, bool patches, const std::string& scheme, int order, double horizon_s,
           bool shape, const std::map<StationId, std::string>& held) {
  const LocalStep options = options_of(patches, scheme, order, horizon_s, shape);
  const Paths paths = paths_of(given);
  std::vector<LocalTool> tools;
  for (const auto& [id, path] : paths) tools.push_back({id, path, held.contains(id) ? held.at(id) : std::string()});
  const py::gil_scoped_release others_run;
  return std::make_shared<FrameResult>(room.step(tools, options));
}

Frame step_alone(LocalRoom& room, std::size_t ticks, bool shape) {
  const py::gil_scoped_release others_run;
  return std::make_shared<FrameResult>(room.step_alone(ticks, {.shape = shape}));
}

py::list frame_tools(const Frame& frame) {
  py::list tools;
  for (const StationFrame& tool : frame->stations) tools.append(FrameTool{frame, &tool});
  return tools;
}

FrameTool tool_of(const Frame& frame, StationId id) {
  for (const StationFrame& tool : frame->stations)
    if (tool.id == id) return {frame, &tool};
  throw InputError("tool " + std::to_string(id), "is not in this frame", "the id of a tool of the step");
}

py::object patch_of(const FrameTool& tool) {
  if (!tool->patch) return py::none();
  return py::cast(FramePatch{tool});
}

}  // namespace

void add_room(py::module_& module) {
  py::class_<FrameTool>(module, "FrameTool", "A tool at the end of a step. Arrays are read-only views.")
      .def_property_readonly(
          "id", [](const FrameTool& tool) { return tool->id; }, "Number that the caller gave it.")
      .def_property_readonly(
          "position", [](py::object self) { return vector(self.cast<const FrameTool&>()->tool, self); },
          "Its position, (3,) [m].")
      .def_property_readonly(
          "force", [](py::object self) { return vector(self.cast<const FrameTool&>()->force, self); },
          "Force of the full model on it, (3,) [N].")
      .def_property_readonly(
          "torque", [](py::object self) { return vector(self.cast<const FrameTool&>()->torque, self); },
          "Torque of the full model on an instrument, about the tool point, (3,) [N m].")
      .def_property_readonly(
          "orientation", [](py::object self) { return quaternion(self.cast<const FrameTool&>()->turn, self); },
          "Its orientation, a quaternion x, y, z, w from its frame to that of the scene, (4,).")
      .def_property_readonly(
          "opening", [](const FrameTool& tool) { return tool->opening; }, "Opening of its jaws, 0 to 1.")
      .def_property_readonly(
          "contact", [](const FrameTool& tool) { return tool->contact; }, "True when it touches or holds the body.")
      .def_property_readonly("patch", &patch_of, "Its patch; None when it is out of reach, or patches were not wanted.");

  py::class_<FrameResult, Frame>(module, "Frame", "The body and its tools at the end of a step.")
      .def_property_readonly(
          "t_s", [](const Frame& frame) { return seconds(frame->stamp); }, "Time of the body [s].")
      .def_property_readonly(
          "shape", [](py::object self) { return rows(std::span<const Vec3>(self.cast<const FrameResult&>().positions), self); },
          "Positions of all vertices, (vertices, 3) [m]; (0, 3) with shape=False. A view.")
      .def_property_readonly("tools", &frame_tools, "The tools of the step, in its order.")
      .def("tool", &tool_of, py::arg("id") = 1, "The tool of this number. Raises InputError when the step had none.")
      .def_property_readonly(
          "steps", [](const Frame& frame) { return frame->steps; }, "Number of steps of the integrator.")
      .def_property_readonly(
          "failed", [](const Frame& frame) { return frame->failed; },
          "True when the step did not converge: the body is at rest in its last good shape, without patches.")
      .def_property_readonly(
          "asleep", [](const Frame& frame) { return frame->asleep; },
          "True when the body is in equilibrium and no tool is near.");

  const LocalStep usual;
  py::class_<LocalRoom>(
      module, "Room",
      "A body and the tools on it, in this process and in virtual time.\n\n"
      "Room(scene) has the body at rest at 0 s. Nothing is drawn at random: the same calls give the same bits, as in\n"
      "C++. One thread at a time; several rooms in several threads run side by side, as steps release the\n"
      "interpreter's lock.")
      .def(py::init([](const Scene& scene) {
             const py::gil_scoped_release others_run;
             return std::make_unique<LocalRoom>(scene);
           }),
           py::arg("scene"))
      .def_property_readonly(
          "t_s", [](const LocalRoom& room) { return seconds(room.now()); }, "Time of the body [s].")
      .def_property_readonly("integrator", &LocalRoom::integrator, "The integrator that moves the body, and why, in one line.")
      .def(
          "step", &step, py::arg("path"), py::kw_only(), py::arg("patches") = usual.patches,
          py::arg("scheme") = std::string(name_of(usual.scheme)), py::arg("order") = usual.order,
          py::arg("horizon_s") = static_cast<double>(usual.horizon.count()) / 1e6,  // prints as 0.1
          py::arg("shape") = usual.shape, py::arg("held") = std::map<StationId, std::string>(),
          "Moves tools and body, and returns the Frame at the end.\n\n"
          "path: positions of tool 1 at t_s + 1 ms, t_s + 2 ms, ..., (n, 3) [m], 1 to 1000 of them; or a dict of such paths by\n"
          "tool (1, 2, ...). For an instrument (n, 7), with the orientation x, y, z, w of a quaternion, or (n, 8), with the\n"
          "opening of jaws, 0 to 1; without orientation it stands upright. A tool that was not in the last step starts at its "
          "first position; one that is missing is removed.\n"
          "patches: make a patch for each tool, by scheme (hold, tangent, ring, port, hyper), with order states (0: as the "
          "scheme\n"
          "has them), that predicts the hands for horizon_s [s]. shape: copy the positions of all vertices.\n"
          "held: a dict of names by tool, of a scene with several; a tool that comes without one holds the first.\n"
          "Raises InputError for paths of other shapes and poses that are none, as positions that are not finite or beyond 10 m.")
      .def("step_alone", &step_alone, py::arg("ticks"), py::kw_only(), py::arg("shape") = usual.shape,
           "Lets the body move without tools for ticks milliseconds (1 to 1000), and returns the Frame.")
      .def("reset", &LocalRoom::reset,
           "Puts the body back to rest at the beginning of the next step; its last bits are not those of a new one.")
      .def("renew", &LocalRoom::renew, py::call_guard<py::gil_scoped_release>(),
           "Begins anew at 0 s, with the bits of Room(scene), in less time.");
}

}  // namespace palpate::python
