// Client: a station at a server, whose hand is the Python program (bindings/core/live_station.hpp).
#include "bindings/core/live_station.hpp"
#include "bindings/python/arrays.hpp"
#include "bindings/python/module.hpp"

namespace palpate::python {
namespace {

/// Ticks of follow().
struct Felt {
  std::vector<TickOutput> ticks;
  std::size_t late = 0;
};

const char* name_of(LinkState link) {
  return link == LinkState::joined ? "joined" : link == LinkState::refused ? "refused" : "joining";
}

py::dict status_of(const LiveStation& station) {
  const ClientStatus status = station.status();
  py::dict dict;
  dict["link"] = name_of(status.link);
  dict["scene"] = status.welcome.scene;
  dict["station"] = status.welcome.station;
  dict["rate_hz"] = status.welcome.rate_hz;
  dict["refusal"] = status.refusal;
  dict["rtt_s"] = seconds(status.rtt.min);
  dict["joins"] = status.joins;
  dict["fault"] = status.fault;
  return dict;
}

Felt follow(LiveStation& station, const Positions& path) {
  const std::vector<ToolSample> poses = poses_of(path, "path");
  const py::gil_scoped_release others_run;
  Felt felt{std::vector<TickOutput>(poses.size()), 0};
  felt.late = station.follow(poses, felt.ticks);
  return felt;
}

template <class Member>
auto of_ticks(Member TickOutput::*member) {
  return [member](py::object self) { return column(std::span<const TickOutput>(self.cast<const Felt&>().ticks), member, self); };
}

}  // namespace

void add_client(py::module_& module) {
  py::class_<TickOutput>(module, "Tick", "What a hand feels at one tick.")
      .def_property_readonly(
          "force", [](py::object self) { return vector(self.cast<const TickOutput&>().force, self); },
          "Force on the tool, (3,) [N].")
      .def_property_readonly(
          "torque", [](py::object self) { return vector(self.cast<const TickOutput&>().torque, self); },
          "Torque on an instrument, about the tool point, (3,) [N m].")
      .def_readonly("grip", &TickOutput::grip, "Moment of jaws, positive where it opens them [N m].")
      .def_readonly("contact", &TickOutput::contact, "True when the tool touches.")
      .def_readonly("has_patch", &TickOutput::has_patch, "False while no patch has arrived: then there is no force.")
      .def_property_readonly(
          "patch_age_s", [](const TickOutput& tick) { return seconds(tick.patch_age); }, "Age of the patch in use [s].");

  py::class_<Felt>(module, "Felt", "What a hand felt along a path, a tick a millisecond. Arrays are read-only views.")
      .def_property_readonly("force", of_ticks(&TickOutput::force), "Forces on the tool, (ticks, 3) [N].")
      .def_property_readonly("torque", of_ticks(&TickOutput::torque), "Torques on an instrument, (ticks, 3) [N m].")
      .def_property_readonly("grip", of_ticks(&TickOutput::grip), "Moments of jaws, positive where they open, (ticks,) [N m].")
      .def_property_readonly("contact", of_ticks(&TickOutput::contact), "Contact, (ticks,).")
      .def_property_readonly("has_patch", of_ticks(&TickOutput::has_patch), "False while no patch had arrived, (ticks,).")
      .def_readonly("late", &Felt::late, "Ticks that came too late and were skipped.");

  const LiveOptions usual;
  py::class_<LiveStation>(
      module, "Client",
      "A station at a server whose hand is this program.\n\n"
      "Client(server, station=\"hand\", room=\"\", scheme=\"auto\", key=\"\", token=\"\", force_max_n=0, slew_max_n_s=0, "
      "tool=\"\"):\n"
      "server "
      "is\n"
      "HOST:PORT; key and token are files. A thread keeps the session; tick() and follow() are the haptic loop, for one\n"
      "thread at a time. tool: name of the tool that it holds, of a scene with several. Raises InputError for an address, scheme "
      "or\n"
      "key that cannot be read.")
      .def(py::init([](const std::string& server, const std::string& station, const std::string& room, const std::string& scheme,
                       const std::string& key, const std::string& token, double force_max_n, double slew_max_n_s,
                       const std::string& tool) {
             const py::gil_scoped_release others_run;
             return std::make_unique<LiveStation>(
                 LiveOptions{server, station, room, scheme, key, token, force_max_n, slew_max_n_s, tool});
           }),
           py::arg("server"), py::arg("station") = usual.station, py::kw_only(), py::arg("room") = usual.room,
           py::arg("scheme") = usual.scheme, py::arg("key") = usual.key_file, py::arg("token") = usual.token_file,
           py::arg("force_max_n") = usual.force_max_n, py::arg("slew_max_n_s") = usual.slew_max_n_s, py::arg("tool") = usual.tool)
      .def(
          "wait",
          [](const LiveStation& station, double most_s) {
            const py::gil_scoped_release others_run;
            station.wait(from_seconds(most_s));
          },
          py::arg("most_s") = 5.0,
          "Waits until the station has joined and the clocks agree. Raises RuntimeError with the reason when the server refuses "
          "it,\n"
          "or after most_s seconds.")
      .def_property_readonly(
          "status", &status_of,
          "State of the session: link (joining, joined, refused), scene, station, rate_hz, refusal, rtt_s, joins, fault.")
      .def_property_readonly(
          "home", [](const LiveStation& station) { return py::array_t<double>(3, station.status().welcome.home.data()); },
          "Start of a tool in this room, (3,) [m]; valid after wait().")
      .def(
          "tick", [](LiveStation& station, const Positions& pose) { return station.tick(pose_of(pose, "pose")); },
          py::arg("pose"),
          "Runs the tick of the present millisecond with the tool at pose, (3,) [m], and returns the Tick; at most one tick a\n"
          "millisecond runs. For an instrument (7,) or (8,), as in Room.step. A position that is not finite or beyond 10 m "
          "counts\n"
          "as a tool that stands still.")
      .def("follow", &follow, py::arg("path"),
           "Moves the tool along path, (n, 3) [m], a millisecond each, in real time and without the interpreter's lock; returns "
           "Felt.\n"
           "For an instrument (n, 7) or (n, 8), as in Room.step.")
      .def("leave", &LiveStation::leave, py::call_guard<py::gil_scoped_release>(),
           "Says goodbye to the server. So does the end of a `with` block.")
      .def("__enter__", [](py::object self) { return self; })
      .def("__exit__", [](LiveStation& station, const py::args&) {
        const py::gil_scoped_release others_run;
        station.leave();
      });
}

}  // namespace palpate::python
