// Patch, a reduced model of the body at a tool, and Player, which plays it.
#include "bindings/core/local_room.hpp"
#include "bindings/python/arrays.hpp"
#include "bindings/python/frames.hpp"
#include "bindings/python/module.hpp"
#include "common/player/player.hpp"

namespace palpate::python {
namespace {

/// A view of a matrix or vector of the patch.
template <class Member>
auto matrix_of(Member member) {
  return [member](py::object self) { return matrix(self.cast<const FramePatch&>().patch().*member, self); };
}
template <class Member>
auto vector_of(Member member) {
  return [member](py::object self) { return vector(self.cast<const FramePatch&>().patch().*member, self); };
}

py::array surface_of(const FramePatch& patch, py::handle owner) {
  const PortSurface& surface = patch.patch().surface;
  return column(std::span(surface.vertices).first(static_cast<std::size_t>(surface.vertex_count)), &PortVertex::position, owner);
}

py::array patch_triangles(const FramePatch& patch, py::handle owner) {
  const PortSurface& surface = patch.patch().surface;
  return view(surface.triangles.front().data(), {surface.triangle_count, 3}, {sizeof(Triangle), sizeof(std::uint32_t)}, owner);
}

/// Plays a patch along a path, a tick a position.
py::tuple play(PatchPlayer& player, const Positions& path) {
  const std::vector<ToolSample> poses = poses_of(path, "path");
  for (std::size_t k = 0; k < poses.size(); ++k) check_pose(poses[k], "path[" + std::to_string(k) + "]");
  const auto ticks = static_cast<py::ssize_t>(poses.size());
  py::array_t<double> forces({ticks, py::ssize_t{3}}), torques({ticks, py::ssize_t{3}});
  py::array_t<bool> contact(ticks);
  auto* force = reinterpret_cast<Vec3*>(forces.mutable_data());
  auto* torque = reinterpret_cast<Vec3*>(torques.mutable_data());
  bool* touches = contact.mutable_data();
  {
    const py::gil_scoped_release others_run;
    for (const ToolSample& pose : poses) {
      const PlayerOutput out = player.advance({player.time() + kTick, pose.position, pose.orientation, pose.opening});
      *force++ = out.force;
      *torque++ = out.torque;
      *touches++ = out.contact;
    }
  }
  return py::make_tuple(std::move(forces), std::move(contact), std::move(torques));
}

}  // namespace

void add_patch(py::module_& module) {
  py::class_<FramePatch>(
      module, "Patch",
      "A reduced model of the body at one tool, valid from its stamp on (common/patch/patch.hpp has the equations):\n"
      "q'' + damping q' + diag(stiffness) q = g + u, with r modes. Arrays are read-only views.")
      .def_property_readonly(
          "stamp_s", [](const FramePatch& p) { return seconds(p.patch().stamp); }, "Time of the body for which it was made [s].")
      .def_property_readonly(
          "scheme", [](const FramePatch& p) { return std::string(name_of(p.patch().scheme)); },
          "The scheme that made it: hold, tangent, ring, port or hyper.")
      .def_property_readonly(
          "touching", [](const FramePatch& p) { return p.patch().touching; }, "True when the tool touches at the stamp.")
      .def_property_readonly(
          "modes", [](const FramePatch& p) { return p.patch().modes(); }, "Number of modes r.")
      .def_property_readonly(
          "nonlinear", [](const FramePatch& p) { return p->terms.elements.count() > 0; },
          "True when it has forces beyond the tangent.")
      .def_property_readonly(
          "valid_for_s", [](const FramePatch& p) { return seconds(p.patch().valid_for); },
          "Age beyond which a client fades its force out [s].")
      .def_property_readonly(
          "trust_radius_m", [](const FramePatch& p) { return p.patch().trust_radius_m; },
          "Distance of the tool from its place at the stamp beyond which a client fades the force out [m].")
      .def_property_readonly("force", vector_of(&Patch::force), "Force on the tool at the stamp, (3,) [N].")
      .def_property_readonly("stiffness", vector_of(&Patch::stiffness), "Squared frequencies of the modes, (r,) [1/s^2].")
      .def_property_readonly("damping", matrix_of(&Patch::damping), "Damping of the modes, (r, r) [1/s].")
      .def_property_readonly("g", vector_of(&Patch::g), "Residual force on the modes at the stamp, (r,) [kg^1/2 m/s^2].")
      .def_property_readonly("q_rate", vector_of(&Patch::q_rate), "Rates of the modes at the stamp, (r,) [kg^1/2 m/s].")
      .def_property_readonly("k_port", matrix_of(&Patch::k_port), "A grasp: stiffness of the port, (3, 3) [N/m].")
      .def_property_readonly("d_port", matrix_of(&Patch::d_port), "A grasp: damping of the port, (3, 3) [N s/m].")
      .def_property_readonly("b_k", matrix_of(&Patch::b_k), "A grasp: force of the tool's displacement on the modes, (r, 3).")
      .def_property_readonly("b_d", matrix_of(&Patch::b_d), "A grasp: force of the tool's velocity on the modes, (r, 3).")
      .def_property_readonly("c_static", matrix_of(&Patch::c_static), "A touch: compliance that no mode carries, (3, 3) [m/N].")
      .def_property_readonly(
          "surface", [](py::object self) { return surface_of(self.cast<const FramePatch&>(), self); },
          "A touch: vertices of the surface near the contact at the stamp, (vertices, 3) [m].")
      .def_property_readonly(
          "triangles", [](py::object self) { return patch_triangles(self.cast<const FramePatch&>(), self); },
          "A touch: triangles of that surface, (triangles, 3) indices of vertices.")
      .def("__repr__", [](const FramePatch& p) {
        return "<palpate.Patch " + std::string(name_of(p.patch().scheme)) + " at " + std::to_string(seconds(p.patch().stamp)) +
               " s, " + std::to_string(p.patch().modes()) + " modes>";
      });

  py::class_<PatchPlayer>(module, "Player",
                          "Plays a patch, a tick of 1 ms at a time, from its stamp on. Copies the patch. One thread at a time.")
      .def(py::init([](const FramePatch& p) { return PatchPlayer(p.patch(), p->terms); }), py::arg("patch"))
      .def_property_readonly(
          "t_s", [](const PatchPlayer& player) { return seconds(player.time()); }, "Time of the last tick [s].")
      .def_property_readonly(
          "force", [](const PatchPlayer& player) { return py::array_t<double>(3, player.output().force.data()); },
          "Force on the tool at the last tick, (3,) [N].")
      .def_property_readonly(
          "contact", [](const PatchPlayer& player) { return player.output().contact; },
          "True when the tool touches at the last tick.")
      .def("play", &play, py::arg("path"),
           "Moves the tool along path, (n, 3) [m], a position every millisecond after t_s; (n, 7) or (n, 8) as in Room.step.\n\n"
           "Returns the forces on the tool, (n, 3) [N], whether it touches, (n,), and the torques on an instrument, (n, 3) [N "
           "m].\n"
           "Runs without the interpreter's lock. Raises InputError for another shape or poses that are none.");
}

}  // namespace palpate::python
