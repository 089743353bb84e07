// Motion: positions of a tool over time, from arrays, a file, or a gesture on a body's surface.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "bench/measure/examination.hpp"
#include "bench/measure/surface_gesture.hpp"
#include "bindings/python/arrays.hpp"
#include "bindings/python/module.hpp"
#include "common/motion/motion.hpp"

namespace palpate::python {
namespace {

using Times = py::array_t<double, py::array::c_style | py::array::forcecast>;

Motion motion_of(const Times& t_s, const Positions& positions) {
  const std::vector<ToolSample> at = poses_of(positions, "positions");
  if (t_s.ndim() != 1 || static_cast<std::size_t>(t_s.size()) != at.size())
    throw InputError("t_s", "has " + std::to_string(t_s.size()) + " times", std::to_string(at.size()) + ", one a position");
  std::vector<MotionPoint> points;
  MotionHolds holds;
  for (std::size_t k = 0; k < at.size(); ++k) {
    points.push_back({t_s.data()[k], at[k].position});
    if (at[k].orientation) holds.orientations.emplace_back(*at[k].orientation);
    if (positions.shape(1) == kPoseColumns) holds.openings.push_back(at[k].opening);
  }
  return Motion(std::move(points), std::move(holds));
}

Motion gesture_named(const Scene& scene, const std::string& name) {
  const auto gesture = surface_gesture_from_name(name);
  if (gesture) return surface_gesture(scene, *gesture);
  std::string names;
  for (const std::string_view known : kSurfaceGestureNames) names += (names.empty() ? "" : ", ") + std::string(known);
  throw InputError("gesture \"" + name + "\"", "is unknown", "one of " + names);
}

py::array_t<double> path_of(const Motion& motion) {
  const auto ticks = static_cast<py::ssize_t>(motion.duration().count() / 1000) + 1;
  const bool jaws = !motion.holds().openings.empty();
  const py::ssize_t columns = jaws ? kPoseColumns : motion.holds().orientations.empty() ? 3 : 7;
  py::array_t<double> path({ticks, columns});
  for (py::ssize_t k = 0; k < ticks; ++k) {
    const Micros t{1000 * k};
    double* row = path.mutable_data() + k * columns;
    std::copy_n(motion.position(t).data(), 3, row);
    if (columns > 3) std::copy_n(motion.orientation(t).value_or(Rotation::Identity()).coeffs().data(), 4, row + 3);
    if (jaws) row[7] = motion.opening(t);
  }
  return path;
}

}  // namespace

void add_motion(py::module_& module) {
  py::class_<Motion>(
      module, "Motion",
      "Positions of a tool over time, linear in between.\n\n"
      "Motion(t_s, positions): times from 0, ascending, (n,) [s], and positions, (n, 3) [m], or poses, (n, 7) or (n, 8), as in\n"
      "Room.step. Raises InputError unless there are at least two, finite and within 10 m.")
      .def(py::init(&motion_of), py::arg("t_s"), py::arg("positions"))
      .def_static(
          "read", [](const std::filesystem::path& file) { return read_motion(file); }, py::arg("file"),
          "Reads a CSV file t_s,x_m,y_m,z_m, which may have further columns: qx,qy,qz,qw (the tool's orientation), buttons (bit "
          "n:\n"
          "button n) and opening (of jaws). write() keeps them, and replay() plays them.\n"
          "Raises InputError with file and line.")
      .def(
          "write", [](const Motion& motion, const std::filesystem::path& file) { write_motion(file, motion); }, py::arg("file"),
          "Writes a file that read() reads back to the same bits.")
      .def_static(
          "gesture", &gesture_named, py::arg("scene"), py::arg("name"),
          "A hand on this body's surface: press, stroke, tap, circle, tour or insert (bench/measure/surface_gesture.hpp).")
      .def_static(
          "examination", [](const Scene& scene) { return examination(scene); }, py::arg("scene"),
          "The motion of `palpate-lab accuracy`: press, stroke, tap and release at the top of the body.")
      .def_property_readonly("duration_s", &Motion::duration_s, "Time of the last position [s].")
      .def_property_readonly(
          "t_s", [](py::object self) { return column(self.cast<const Motion&>().points(), &MotionPoint::t_s, self); },
          "Times, (n,) [s]. A view.")
      .def_property_readonly(
          "positions", [](py::object self) { return column(self.cast<const Motion&>().points(), &MotionPoint::position, self); },
          "Positions, (n, 3) [m]. A view.")
      .def("path", &path_of,
           "Positions at 0, 1, 2, ... ms, (ticks, 3) [m]; (ticks, 7) with orientations, (ticks, 8) with openings of jaws as "
           "well.");
}

}  // namespace palpate::python
