// Recording: motion and force of every hand of a recorded session, and the body's shapes, as arrays.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "bindings/python/arrays.hpp"
#include "bindings/python/module.hpp"
#include "common/assessment/session.hpp"
#include "common/assessment/session_metrics.hpp"
#include "common/io/mapped_file.hpp"

namespace palpate::python {
namespace {

class Recording {
 public:
  explicit Recording(const std::filesystem::path& file)
      : name_(file.string()), file_(file), reader_(file_.bytes(), name_), session_(read_session(reader_)) {}

  const std::string& name() const { return name_; }
  RecordingReader& reader() { return reader_; }
  const Session& session() const { return session_; }
  const SessionHand& hand(const std::string& name) const {
    std::string names;
    for (const SessionHand& hand : session_.hands) {
      if (hand.name == name) return hand;
      names += (names.empty() ? "" : ", ") + hand.name;
    }
    throw InputError("station \"" + name + "\"", "is no hand in " + name_,
                     names.empty() ? "no name: nobody moved" : "one of " + names);
  }

 private:
  std::string name_;
  MappedFile file_;
  RecordingReader reader_;
  Session session_;
};

using Held = std::shared_ptr<Recording>;

/// A hand of a recording, which it keeps.
struct RecordedHand {
  Held recording;
  const SessionHand* hand = nullptr;
};

template <class Item, class Member>
auto series(std::vector<Item> SessionHand::*items, Member Item::*member) {
  return
      [=](py::object self) { return column(std::span<const Item>(self.cast<const RecordedHand&>().hand->*items), member, self); };
}

py::array orientations_of(py::object self) {
  const std::vector<SessionTurn>& turns = self.cast<const RecordedHand&>().hand->turns;
  return view(turns.empty() ? nullptr : turns.front().turn.coeffs().data(), {static_cast<py::ssize_t>(turns.size()), 4},
              {sizeof(SessionTurn), sizeof(double)}, self);
}

py::list hands_of(const Held& recording) {
  py::list hands;
  for (const SessionHand& hand : recording->session().hands) hands.append(RecordedHand{recording, &hand});
  return hands;
}

py::object shape_at(Recording& recording, double t_s) {
  const auto shape = recording.reader().shape_at(recording.reader().begin() + from_seconds(t_s));
  if (!shape) return py::none();
  py::array_t<double> positions({static_cast<py::ssize_t>(shape->positions.size()), py::ssize_t{3}});
  std::copy(shape->positions.begin(), shape->positions.end(), reinterpret_cast<Vec3*>(positions.mutable_data()));
  return positions;
}

py::array recorded_triangles(Recording& recording, py::handle owner) {
  const auto& triangles = recording.reader().head().surface.triangles;
  return view(triangles.empty() ? nullptr : triangles.front().data(), {static_cast<py::ssize_t>(triangles.size()), 3},
              {sizeof(Triangle), sizeof(std::uint32_t)}, owner);
}

py::object triangles_at(Recording& recording, double t_s) {
  const auto shape = recording.reader().shape_at(recording.reader().begin() + from_seconds(t_s));
  const BodyMesh* const mesh = shape ? recording.reader().mesh_of(*shape) : nullptr;
  if (!mesh) return py::none();
  py::array_t<std::uint32_t> triangles({static_cast<py::ssize_t>(mesh->triangles.size()), py::ssize_t{3}});
  std::copy(mesh->triangles.begin(), mesh->triangles.end(), reinterpret_cast<Triangle*>(triangles.mutable_data()));
  return triangles;
}

std::vector<Motion> motions(const Recording& recording, const std::string& station) {
  const SessionHand& first = recording.hand(station);
  return motions_of(recording.session(), static_cast<std::size_t>(&first - recording.session().hands.data()), recording.name());
}

py::dict metrics_of(const RecordedHand& hand, double threshold_n) {
  if (!(threshold_n > 0)) throw InputError("threshold_n", "is " + std::to_string(threshold_n), "a force above 0 N");
  const SessionMetrics metrics = session_metrics(*hand.hand, threshold_n);
  py::dict dict;
  dict["duration_s"] = metrics.duration_s;
  dict["contact_s"] = metrics.contact_s;
  dict["contacts"] = metrics.contacts;
  dict["force_peak_n"] = metrics.force_peak_n;
  dict["force_mean_n"] = metrics.force_mean_n;
  dict["over_s"] = metrics.over_s;
  dict["overs"] = metrics.overs;
  dict["path_m"] = metrics.path_m;
  dict["speed_mean_m_s"] = metrics.speed_mean_m_s;
  dict["sparc"] = metrics.sparc;
  return dict;
}

}  // namespace

void add_recording(py::module_& module) {
  py::class_<RecordedHand> hand(
      module, "RecordedHand",
      "Motion and force of one hand; times are seconds since the beginning of the recording. Arrays are views.");
  hand.def_property_readonly(
          "name", [](const RecordedHand& h) { return h.hand->name; }, "Name of the station.")
      .def_property_readonly("t_s", series(&SessionHand::path, &MotionPoint::t_s), "Times of the positions, (n,) [s].")
      .def_property_readonly("positions", series(&SessionHand::path, &MotionPoint::position),
                             "Positions of the tool, (n, 3) [m].")
      .def_property_readonly("force_t_s", series(&SessionHand::forces, &SessionForce::t_s), "Times of the forces, (m,) [s].")
      .def_property_readonly("forces", series(&SessionHand::forces, &SessionForce::force), "Forces on the tool, (m, 3) [N].")
      .def_property_readonly("torques", series(&SessionHand::forces, &SessionForce::torque),
                             "Torques on an instrument at these times, (m, 3) [N m].")
      .def_property_readonly("turn_t_s", series(&SessionHand::turns, &SessionTurn::t_s),
                             "Times of the orientations, (k,) [s]; none where the device had none.")
      .def_property_readonly("orientations", &orientations_of, "Orientations x, y, z, w at these times, (k, 4).")
      .def_property_readonly("openings", series(&SessionHand::turns, &SessionTurn::opening),
                             "Openings of jaws at these times, (k,).")
      .def_property_readonly("contact", series(&SessionHand::forces, &SessionForce::contact), "Contact at these times, (m,).");

  hand.def(
      "metrics", &metrics_of, py::arg("threshold_n") = 3.0,
      "Figures of training assessments (common/assessment/session_metrics.hpp): duration_s, contact_s, contacts, force_peak_n,\n"
      "force_mean_n, over_s and overs (above threshold_n), path_m, speed_mean_m_s, and sparc, the smoothness. Raises "
      "InputError.");

  py::class_<Recording, Held>(
      module, "Recording",
      "A recorded session (docs/reference/recording.md), read as a whole. Damaged blocks are counted, not guessed.\n\n"
      "Recording(file) raises InputError for a file that is no recording.")
      .def(py::init([](const std::filesystem::path& file) {
             const py::gil_scoped_release others_run;
             return std::make_shared<Recording>(file);
           }),
           py::arg("file"))
      .def_property_readonly(
          "kind", [](Recording& r) { return r.reader().head().kind == RecordingKind::room ? "room" : "station"; },
          "\"room\": made by a server; \"station\": made by a client.")
      .def_property_readonly(
          "name", [](Recording& r) { return r.reader().head().name; }, "Name of the room or station.")
      .def_property_readonly(
          "scene_json", [](Recording& r) { return r.reader().head().scene; },
          "The scene as JSON with all defaults; empty in a station's recording.")
      .def_property_readonly(
          "duration_s", [](Recording& r) { return seconds(r.reader().end() - r.reader().begin()); }, "Its length [s].")
      .def_property_readonly(
          "complete", [](Recording& r) { return r.reader().complete(); }, "True when it was completed.")
      .def_property_readonly(
          "damage", [](Recording& r) { return r.reader().damage(); },
          "Why it is incomplete, in words; empty when it is complete.")
      .def_property_readonly(
          "blocks_lost", [](Recording& r) { return r.session().blocks_lost; }, "Damaged blocks, whose content is unknown.")
      .def_property_readonly(
          "notes",
          [](Recording& r) {
            py::list notes;
            for (const SessionNote& note : r.session().notes)
              notes.append(py::dict(py::arg("t_s") = note.t_s, py::arg("author") = note.author, py::arg("text") = note.text));
            return notes;
          },
          "Notes of people, each a dict: t_s, the moment that it is about [s], author, and text, empty for a mark alone.")
      .def_property_readonly(
          "resets_s", [](Recording& r) { return r.session().resets_s; }, "Times of resets of the body [s].")
      .def_property_readonly("hands", &hands_of, "The hands, in the order in which they first moved.")
      .def(
          "hand",
          [](const Held& r, const std::string& name) {
            return RecordedHand{r, &r->hand(name)};
          },
          py::arg("name"), "The hand of this station. Raises InputError with the names that there are.")
      .def("motions", &motions, py::arg("name"),
           "Motions of all hands over one interval, this one first, for replay(). Raises InputError.")
      .def("shape_at", &shape_at, py::arg("t_s"),
           "Positions of the recorded vertices at t_s, (vertices, 3) [m]; None before the first.")
      .def("triangles_at", &triangles_at, py::arg("t_s"),
           "Triangles of the shape at t_s, (triangles, 3): a blade changes them. None before the first shape, or where damage "
           "took them.")
      .def_property_readonly(
          "triangles", [](py::object self) { return recorded_triangles(self.cast<Recording&>(), self); },
          "Triangles at the beginning, (triangles, 3). A view.");
}

}  // namespace palpate::python
