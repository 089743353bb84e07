// Scene: a body and its tool, as read from a file.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "bindings/python/arrays.hpp"
#include "bindings/python/module.hpp"
#include "server/body/unload.hpp"
#include "server/room/room.hpp"

namespace palpate::python {
namespace {

const char* name_of(ContactKind contact) { return contact == ContactKind::attach ? "attach" : "touch"; }

/// The scene of an instance of the Python class, and the instance, which keeps the memory of views.
template <class Make>
auto with_scene(Make make) {
  return [make](py::object self) { return make(self.cast<const Scene&>(), self); };
}

py::array scene_triangles(const Scene& scene, py::handle owner) {
  const auto& triangles = scene.body.triangles;
  return view(triangles.empty() ? nullptr : triangles.front().data(), {static_cast<py::ssize_t>(triangles.size()), 3},
              {sizeof(Triangle), sizeof(std::uint32_t)}, owner);
}

}  // namespace

void add_scene(py::module_& module) {
  py::class_<Scene, std::shared_ptr<Scene>>(
      module, "Scene",
      "A body and its tool, with every default filled in (docs/reference/scenes.md).\n\n"
      "Scene(file, mesh_folders=()) reads a scene file; meshes lie below its folder or one of mesh_folders.\n"
      "Raises InputError with file, line, field, value and what was expected.")
      .def(py::init([](const std::filesystem::path& file, const MeshFolders& mesh_folders) {
             const py::gil_scoped_release others_run;
             return std::make_shared<Scene>(open_scene(file, mesh_folders));
           }),
           py::arg("file"), py::arg("mesh_folders") = MeshFolders{})
      .def_static(
          "from_json",
          [](const std::string& text, const std::string& name, const MeshFolders& mesh_folders) {
            const py::gil_scoped_release others_run;
            return std::make_shared<Scene>(opened(read_scene(text, name, mesh_folders), name));
          },
          py::arg("text"), py::arg("name") = "scene", py::arg("mesh_folders") = MeshFolders{},
          "Reads a scene from its JSON text; name stands for the file in errors. Raises InputError.")
      .def_readonly("name", &Scene::name, "Name of the scene.")
      .def_property_readonly(
          "contact", [](const Scene& scene) { return name_of(scene.tool.contact); },
          "\"touch\": the tool pushes on the surface; \"attach\": it holds a node.")
      .def_property_readonly(
          "home",
          [](const Scene& scene) {
            const Vec3 home = home_of(scene);
            return py::array_t<double>(3, home.data());
          },
          "Start of a tool, (3,) [m]: 20 mm above the top of the body, or the node that it holds.")
      .def_property_readonly(
          "nodes", with_scene([](const Scene& scene, py::handle owner) { return rows(std::span(scene.body.nodes), owner); }),
          "Positions of all nodes at rest, (nodes, 3) [m]. A view.")
      .def_property_readonly(
          "vertices",
          [](const Scene& scene) {
            const std::vector<Vec3> at = vertices_at_rest(scene.body);
            py::array_t<double> copy({static_cast<py::ssize_t>(at.size()), py::ssize_t{3}});
            if (!at.empty()) std::copy_n(at.front().data(), 3 * at.size(), copy.mutable_data());
            return copy;
          },
          "Positions of all vertices at rest, (vertices, 3) [m]: the nodes, and after them those of a cut body's surface that\n"
          "are no nodes. A copy.")
      .def_property_readonly("masses_kg", with_scene([](const Scene& scene, py::handle owner) {
                               return view(scene.body.masses_kg.data(), {static_cast<py::ssize_t>(scene.body.masses_kg.size())},
                                           {sizeof(double)}, owner);
                             }),
                             "Masses of the nodes, (nodes,) [kg]. A view.")
      .def_property_readonly("fixed", with_scene([](const Scene& scene, py::handle owner) {
                               return view(reinterpret_cast<const bool*>(scene.body.fixed.data()),
                                           {static_cast<py::ssize_t>(scene.body.fixed.size())}, {sizeof(bool)}, owner);
                             }),
                             "True for nodes that never move, (nodes,). A view.")
      .def_property_readonly("triangles", with_scene(scene_triangles),
                             "Outer surface: indices of vertices, (triangles, 3), counter-clockwise seen from outside. A view.")
      .def_property_readonly(
          "contact_stiffness_n_m", [](const Scene& scene) { return scene.tool.contact_stiffness_n_m; },
          "Stiffness of the contact between tool and surface [N/m].")
      .def_property_readonly(
          "friction", [](const Scene& scene) { return scene.tool.friction; }, "Coulomb's coefficient of friction.")
      .def("__repr__", [](const Scene& scene) {
        return "<palpate.Scene \"" + scene.name + "\", " + std::to_string(scene.body.nodes.size()) + " nodes, " +
               name_of(scene.tool.contact) + ">";
      });
}

}  // namespace palpate::python
