// replay(): a motion through a scheme over a link in virtual time, beside the full model (bench/fidelity/replay.hpp).
#include "bench/fidelity/replay.hpp"

#include <pybind11/stl.h>

#include <optional>

#include "bindings/core/local_room.hpp"
#include "bindings/python/arrays.hpp"
#include "bindings/python/module.hpp"
#include "common/base/limits.hpp"
#include "common/io/processor_time.hpp"

namespace palpate::python {
namespace {

/// The reference for one scene and motion, which replays of them share.
struct Reference {
  ReferenceForce forces;
};

double in_range(double value, const std::string& where, double least, double most) {
  if (value >= least && value <= most) return value;
  throw InputError(where, "is " + std::to_string(value), std::to_string(least) + " to " + std::to_string(most));
}

struct LinkNumbers {
  double rtt_ms = 0, jitter_ms = 0, loss = 0, burst = 0;
};

LinkSpec one_way(const LinkNumbers& numbers, std::uint64_t seed) {
  LinkSpec link;
  link.latency = from_seconds(in_range(numbers.rtt_ms, "rtt_ms", 0, 10'000) * 0.5e-3);
  link.jitter = from_seconds(in_range(numbers.jitter_ms, "jitter_ms", 0, 1'000) * 1e-3);
  link.loss = numbers.loss;
  link.burst_mean = numbers.burst;
  link.seed = seed;
  validate(link, "link");
  return link;
}

std::vector<ReplayResult> replay_all(const Scene& scene, std::span<const Motion> motions, const ReplayOptions& options) {
  const py::gil_scoped_release others_run;
  return replay_together(scene, motions, options, [] { return 1'000 * processor_now().count(); });
}

py::object replayed(const Scene& scene, const py::object& motion, const std::string& scheme, int order, double rate_hz,
                    double rtt_ms, double jitter_ms, double loss, double burst, double compute_ms, std::uint64_t seed,
                    bool simulated_device, const Reference* reference) {
  ReplayOptions options;
  options.scheme = scheme_asked(scheme);
  options.order = static_cast<int>(in_range(order, "order", 0, 2 * kMaxModes));
  options.rate_hz = in_range(rate_hz, "rate_hz", kMinRateHz, kMaxRateHz);
  options.link = one_way({rtt_ms, jitter_ms, loss, burst}, seed);
  options.seed = seed;
  options.compute = from_seconds(in_range(compute_ms, "compute_ms", 0, 10'000) * 1e-3);
  options.simulated_device = simulated_device;
  if (reference) options.references = {&reference->forces, 1};
  if (py::isinstance<Motion>(motion)) {
    const Motion& one = motion.cast<const Motion&>();
    return py::cast(std::move(replay_all(scene, std::span(&one, 1), options).front()));
  }
  const auto several = motion.cast<std::vector<Motion>>();
  if (several.empty()) throw InputError("motion", "is an empty list", "at least one motion");
  return py::cast(replay_all(scene, several, options));
}

/// Without `skip` every figure is over the ticks over which ReplayResult has it: relative errors over all, the others from
/// kSkipTicks on.
py::dict compared(const Positions& felt, const Positions& reference, std::optional<std::size_t> skip) {
  const std::span<const Vec3> f = positions_of(felt, "felt"), r = positions_of(reference, "reference");
  if (f.size() != r.size() || f.size() <= skip.value_or(kSkipTicks))
    throw InputError("felt", "has " + std::to_string(f.size()) + " forces",
                     "as many as reference, which has " + std::to_string(r.size()) + ", and more than skip");
  const Fidelity fidelity = compare(f, r, skip.value_or(kSkipTicks));
  const std::vector<double> errors = relative_errors(f.subspan(skip.value_or(0)), r.subspan(skip.value_or(0)));
  py::dict dict;
  dict["snr_db"] = fidelity.snr_db;
  dict["rel_rms"] = fidelity.rel_rms;
  dict["median_error"] = percentile(errors, 0.5);
  dict["p95_error"] = percentile(errors, 0.95);
  dict["force_step_max_n"] = fidelity.force_step_max_n;
  dict["lag_ms"] = fidelity.lag_ms;
  dict["contact_ticks"] = fidelity.contact_ticks;
  return dict;
}

template <class Number>
auto of_ticks(Number ReplayTick::*member) {
  return [member](py::object self) {
    return column(std::span<const ReplayTick>(self.cast<const ReplayResult&>().ticks), member, self);
  };
}

py::array ages_of(py::object self) {
  static_assert(sizeof(Micros) == sizeof(std::int64_t));
  const auto& ticks = self.cast<const ReplayResult&>().ticks;
  return view(ticks.empty() ? nullptr : reinterpret_cast<const std::int64_t*>(&ticks.front().patch_age),
              {static_cast<py::ssize_t>(ticks.size())}, {sizeof(ReplayTick)}, self);
}

}  // namespace

void add_replay(py::module_& module) {
  py::class_<Reference>(module, "Reference",
                        "Forces of the full model at 1 kHz along a motion, for replays of the same scene and motion to share.")
      .def(py::init([](const Scene& scene, const Motion& motion) {
             const py::gil_scoped_release others_run;
             return Reference{reference_of(scene, motion)};
           }),
           py::arg("scene"), py::arg("motion"))
      .def_property_readonly(
          "force", [](py::object self) { return rows(std::span<const Vec3>(self.cast<const Reference&>().forces.force), self); },
          "Force on the tool at 0, 1, 2, ... ms, (ticks, 3) [N]. A view.");

  py::class_<ReplayResult>(module, "Replay",
                           "What a hand felt in a replay, a tick a millisecond, and how well. Arrays are read-only views.")
      .def_property_readonly("position", of_ticks(&ReplayTick::position), "Position of the tool, (ticks, 3) [m].")
      .def_property_readonly("felt", of_ticks(&ReplayTick::felt), "Force that the hand felt, (ticks, 3) [N].")
      .def_property_readonly("reference", of_ticks(&ReplayTick::reference),
                             "Force of the full model on the same path, (ticks, 3) [N].")
      .def_property_readonly("felt_torque", of_ticks(&ReplayTick::felt_torque),
                             "Torque that the hand felt of an instrument, about the tool point, (ticks, 3) [N m].")
      .def_property_readonly("reference_torque", of_ticks(&ReplayTick::reference_torque),
                             "Torque of the full model on the same path, (ticks, 3) [N m].")
      .def_property_readonly("contact", of_ticks(&ReplayTick::contact), "Contact as felt, (ticks,).")
      .def_property_readonly("reference_contact", of_ticks(&ReplayTick::true_contact), "Contact of the full model, (ticks,).")
      .def_property_readonly("patch_age_us", &ages_of, "Age of the patch in use, (ticks,) [us]; -1: none yet.")
      .def_property_readonly(
          "snr_db", [](const ReplayResult& r) { return r.fidelity.snr_db; },
          "Accuracy of the felt force [dB]: 20 dB is an error of a tenth (bench/fidelity/metrics.hpp).")
      .def_property_readonly(
          "torque_snr_db", [](const ReplayResult& r) { return r.torque.snr_db; },
          "Accuracy of the felt torque of an instrument [dB]; 0 where there was none.")
      .def_property_readonly(
          "rel_rms", [](const ReplayResult& r) { return r.fidelity.rel_rms; },
          "Root of the mean squared error over that of the reference.")
      .def_property_readonly(
          "median_error", [](const ReplayResult& r) { return percentile(relative_errors(r), 0.5); },
          "Median relative error, where the force is at least a tenth of its peak.")
      .def_property_readonly(
          "p95_error", [](const ReplayResult& r) { return percentile(relative_errors(r), 0.95); }, "95th percentile of the same.")
      .def_property_readonly(
          "lag_ms", [](const ReplayResult& r) { return r.fidelity.lag_ms; },
          "Delay that brings the reference closest to the felt force [ms].")
      .def_property_readonly(
          "contact_ticks", [](const ReplayResult& r) { return r.fidelity.contact_ticks; },
          "Ticks with a force of the full model; with 0 nothing was scored.")
      .def_property_readonly(
          "hand_over_max_n", [](const ReplayResult& r) { return r.hand_over.max_n; },
          "Largest step of the force between two patches [N].")
      .def_property_readonly(
          "scheme", [](const ReplayResult& r) { return std::string(name_of(r.last_patch.scheme)); }, "Scheme of the last patch.")
      .def_readonly("patches", &ReplayResult::patches_used, "Number of patches played.")
      .def_readonly("patch_bytes", &ReplayResult::patch_bytes_mean, "Mean size of a patch with its terms [bytes].")
      .def_readonly("patch_states", &ReplayResult::patch_states, "States of the last patch.")
      .def_readonly("patch_ms", &ReplayResult::patch_build_ms_mean,
                    "Processor time for a patch on this machine [ms]; the one figure that differs between runs.");

  module.def(
      "compare", &compared, py::arg("felt"), py::arg("reference"), py::kw_only(), py::arg("skip") = py::none(),
      "Measures a force against a reference, both (n, 3) [N] with a row a millisecond.\n\n"
      "Returns snr_db, rel_rms, median_error, p95_error, force_step_max_n [N], lag_ms and contact_ticks, as\n"
      "bench/fidelity/metrics.hpp defines them. The first skip rows are left out; with None the figures are those of Replay,\n"
      "which counts all rows in median_error and p95_error, and those from 0.25 s on in the others.\n"
      "Raises InputError unless the two are of one length.");

  const ReplayOptions usual;
  module.def(
      "replay", &replayed, py::arg("scene"), py::arg("motion"), py::kw_only(), py::arg("scheme") = std::string("hyper"),
      py::arg("order") = usual.order, py::arg("rate_hz") = usual.rate_hz, py::arg("rtt_ms") = 0.0, py::arg("jitter_ms") = 0.0,
      py::arg("loss") = 0.0, py::arg("burst") = 0.0, py::arg("compute_ms") = 0.0, py::arg("seed") = usual.seed,
      py::arg("simulated_device") = false, py::arg("reference") = nullptr,
      "Plays motion through scheme over a link in virtual time, with the server's and the client's own code, and compares with\n"
      "the full model, as `palpate-lab replay` does. The same arguments give the same bits.\n\n"
      "motion: a Motion; or a list of them, one hand each on one body: then a list of Replays. scheme: hold, tangent, ring,\n"
      "port, hyper, or auto (the server chooses). rtt_ms, jitter_ms [ms]; loss: share of datagrams, 0 to 1; burst: mean run of\n"
      "losses. reference: that of this scene and motion, if known. Raises InputError for a number out of range, RuntimeError\n"
      "when the model cannot be stepped. Runs without the interpreter's lock.");
}

}  // namespace palpate::python
