// Viewer: the body at a server, as it moves (bindings/core/live_viewer.hpp).
#include "bindings/core/live_viewer.hpp"
#include "bindings/python/arrays.hpp"
#include "bindings/python/module.hpp"

namespace palpate::python {
namespace {

/// A moment as Python holds it.
struct View {
  std::shared_ptr<const ViewMoment> moment;
};

/// A tool of a moment, which it keeps.
struct ViewedTool {
  std::shared_ptr<const ViewMoment> moment;
  const ToolView* tool = nullptr;
};

py::object update(LiveViewer& viewer, double most_s) {
  bool shown = false;
  {
    const py::gil_scoped_release others_run;
    shown = viewer.update(from_seconds(most_s));
  }
  if (!shown) return py::none();
  return py::cast(View{viewer.moment()});
}

py::list viewed_tools(const View& view) {
  py::list tools;
  for (const ToolView& tool : view.moment->tools) tools.append(ViewedTool{view.moment, &tool});
  return tools;
}

py::array_t<double> rest_of(const LiveViewer& viewer) {
  const auto& vertices = viewer.mesh().vertices;
  py::array_t<double> rest({static_cast<py::ssize_t>(vertices.size()), py::ssize_t{3}});
  auto* position = reinterpret_cast<Vec3*>(rest.mutable_data());
  for (const MeshVertex& vertex : vertices) *position++ = vertex.rest;
  return rest;
}

py::array_t<std::uint32_t> viewed_triangles(const LiveViewer& viewer) {
  const auto& triangles = viewer.mesh().triangles;
  py::array_t<std::uint32_t> copy({static_cast<py::ssize_t>(triangles.size()), py::ssize_t{3}});
  std::copy(triangles.begin(), triangles.end(), reinterpret_cast<Triangle*>(copy.mutable_data()));
  return copy;
}

}  // namespace

void add_viewer(py::module_& module) {
  py::class_<ViewedTool>(module, "ViewedTool", "A tool as a viewer sees it. Arrays are read-only views.")
      .def_property_readonly(
          "station", [](const ViewedTool& t) { return t.tool->station; }, "Name of its station.")
      .def_property_readonly(
          "position", [](py::object self) { return vector(self.cast<const ViewedTool&>().tool->position, self); },
          "Its position, (3,) [m].")
      .def_property_readonly(
          "force", [](py::object self) { return vector(self.cast<const ViewedTool&>().tool->force, self); },
          "Force on it, (3,) [N].")
      .def_property_readonly(
          "torque", [](py::object self) { return vector(self.cast<const ViewedTool&>().tool->torque, self); },
          "Torque on an instrument, about the tool point, (3,) [N m].")
      .def_property_readonly(
          "orientation",
          [](py::object self) -> py::object {
            const Orientation& turn = self.cast<const ViewedTool&>().tool->orientation;
            return turn ? py::object(quaternion(*turn, self)) : py::none();
          },
          "Its orientation, a quaternion x, y, z, w, (4,); None where its device has none.")
      .def_property_readonly(
          "opening", [](const ViewedTool& t) { return t.tool->opening; }, "Opening of its jaws, 0 to 1.")
      .def_property_readonly(
          "contact", [](const ViewedTool& t) { return t.tool->contact; }, "True when it touches.");

  py::class_<View>(module, "View", "The body at one moment. It stays as it is when the viewer updates.")
      .def_property_readonly(
          "positions",
          [](py::object self) {
            return rows(std::span<const Eigen::Vector3f>(self.cast<const View&>().moment->shape.positions), self);
          },
          "Positions of the surface's vertices, (vertices, 3) [m], float32. A read-only view.")
      .def_property_readonly("tools", &viewed_tools, "The tools in the room; none while the server is silent.");

  const ViewerOptions usual;
  py::class_<LiveViewer>(
      module, "Viewer",
      "A viewer at a server: sees the body and the tools on it.\n\n"
      "Viewer(server, station=\"viewer\", room=\"\", key=\"\", token=\"\"): server is HOST:PORT; key and token are\n"
      "files. One thread at a time. Raises InputError for an address or key that cannot be read.")
      .def(py::init([](const std::string& server, const std::string& station, const std::string& room, const std::string& key,
                       const std::string& token) {
             const py::gil_scoped_release others_run;
             return std::make_unique<LiveViewer>(ViewerOptions{server, station, room, key, token});
           }),
           py::arg("server"), py::arg("station") = usual.station, py::kw_only(), py::arg("room") = usual.room,
           py::arg("key") = usual.key_file, py::arg("token") = usual.token_file)
      .def(
          "wait",
          [](LiveViewer& viewer, double most_s) {
            const py::gil_scoped_release others_run;
            viewer.wait(from_seconds(most_s));
          },
          py::arg("most_s") = 5.0,
          "Waits until mesh and shape have arrived. Raises RuntimeError with the reason when the server refuses the viewer, or\n"
          "after most_s seconds.")
      .def("update", &update, py::arg("most_s") = 0.0,
           "Handles the network for most_s seconds, at least once, and returns the View that is due; None while there is none.\n"
           "Call it at least four times a second.")
      .def_property_readonly(
          "scene", [](const LiveViewer& viewer) { return viewer.welcome().scene; }, "Name of the scene.")
      .def_property_readonly("rest", &rest_of,
                             "Positions of the vertices at rest, (vertices, 3) [m]; valid after wait(). A copy.")
      .def_property_readonly("triangles", &viewed_triangles,
                             "Triangles of the vertices, (triangles, 3); valid after wait(). A copy.")
      .def_property_readonly("mesh_version", &LiveViewer::mesh_version, "Grows with every new mesh.");
}

}  // namespace palpate::python
