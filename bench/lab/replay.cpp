// palpate-lab replay: any motion through any scheme over any link.
#include "bench/fidelity/replay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "bench/fidelity/reference.hpp"
#include "bench/lab/experiments.hpp"
#include "bench/lab/flags.hpp"
#include "bench/lab/link_flags.hpp"
#include "bench/lab/tools_held.hpp"
#include "bench/measure/surface_gesture.hpp"
#include "bench/output/fidelity_json.hpp"
#include "bench/output/output.hpp"
#include "bench/output/plot.hpp"
#include "bench/output/progress.hpp"
#include "bench/paper/compared_scheme.hpp"
#include "common/assessment/session.hpp"
#include "common/base/error.hpp"
#include "common/base/limits.hpp"
#include "common/command_line/mesh_folders.hpp"
#include "common/io/mapped_file.hpp"
#include "server/body/unload.hpp"
#include "server/scene/tools.hpp"

namespace palpate {
namespace {

constexpr double kMostSeconds = 86'400;

struct ReplayFlags {
  std::string scene, gesture, recording, station, scheme, device = "none", out;
  std::vector<std::string> motions, tools;  // of each hand; the first is reported
  MeshFolders mesh_folders;
  PassivityMode passivity = PassivityMode::off;
  int order = 0;
  double deadband = 0;
  double from_s = 0, to_s = kMostSeconds;
  std::vector<double> rtt_ms{0};
  LinkFlags link;
};

ReplayOptions options_of(const ReplayFlags& flags, const Scene& scene, double rtt_ms) {
  LinkFlags link = flags.link;
  link.rtt_ms = rtt_ms;
  ReplayOptions o = replay_options(std::string(name_of(kWithoutChoice)), flags.order, link);
  if (flags.scheme == kAutoName) {
    o.scheme.reset();
  } else {
    const ComparedScheme scheme = compared_scheme(flags.scheme, "--scheme", kAutoName);
    if (!suits(scheme, scene.body))
      throw InputError("--scheme " + flags.scheme, "does not suit the body of " + scene.name, "springs without relaxation");
    select(scheme, scene, o);
  }
  o.simulated_device = flags.device == "sim";
  o.passivity = flags.passivity;
  o.deadband = flags.deadband;
  return o;
}

void write_forces(const std::filesystem::path& file, const ReplayResult& result) {
  const bool turned = result.torque.contact_ticks > 0;
  std::string csv = "t_s,fx_n,fy_n,fz_n,fx_ref_n,fy_ref_n,fz_ref_n,patch_age_ms,contact";
  csv += turned ? ",tx_nm,ty_nm,tz_nm,tx_ref_nm,ty_ref_nm,tz_ref_nm\n" : "\n";
  for (std::size_t i = 0; i < result.ticks.size(); ++i) {
    const ReplayTick& t = result.ticks[i];
    fmt::format_to(std::back_inserter(csv), "{:.3f},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.3f},{}",
                   static_cast<double>(i) * 1e-3, t.felt.x(), t.felt.y(), t.felt.z(), t.reference.x(), t.reference.y(),
                   t.reference.z(), seconds(t.patch_age) * 1e3, t.contact ? 1 : 0);
    for (const Vec3* torque : {&t.felt_torque, &t.reference_torque})
      if (turned) fmt::format_to(std::back_inserter(csv), ",{:.9g},{:.9g},{:.9g}", torque->x(), torque->y(), torque->z());
    csv += '\n';
  }
  write_text(file, csv);
}

Json summary(const ReplayResult& r, const std::vector<std::uint8_t>& present) {
  Json json = fidelity_json(r.fidelity);
  json["hand_s"] = 1e-3 * static_cast<double>(present.empty() ? std::ssize(r.ticks)
                                                              : std::count(present.begin(), present.end(), std::uint8_t{1}));
  json.update({{"patches_used", r.patches_used},
               {"patch_bytes_mean", r.patch_bytes_mean},
               {"patch_states", r.patch_states},
               {"tick_ns_p50", r.tick_ns_p50},
               {"tick_ns_p99", r.tick_ns_p99},
               {"patch_build_ms_mean", r.patch_build_ms_mean},
               {"frame_ms_mean", r.frame_ms_mean},
               {"hand_over_step_max_n", r.hand_over.max_n},
               {"hand_over_step_p999_n", r.hand_over.p999_n},
               {"hand_over_share_within", r.hand_over.share_within},
               {"felt_step_p999_n", r.felt_step.p999_n},
               {"felt_step_share_within", r.felt_step.share_within},
               {"contact_onsets", r.onset.onsets},
               {"contact_onsets_missed", r.onset.missed},
               {"contact_onset_worst_ms", r.onset.worst_ms},
               {"contact_onset_median_ms", r.onset.median_ms},
               {"patch_age_p95_ms", 1e3 * seconds(r.age_p95)},
               {"uplink_bytes_s", r.uplink_bytes_s},
               {"downlink_bytes_s", r.downlink_bytes_s},
               {"energy_min_j", r.guard.energy_min_j},
               {"damped_ticks", r.guard.damped},
               {"dissipated_j", r.guard.dissipated_j},
               {"damper_max_n", r.guard.damper_max_n},
               {"damper_rms_n", r.guard.damper_rms_n()}});
  if (r.torque.contact_ticks > 0) json["torque"] = {{"snr_db", r.torque.snr_db}, {"p95_rel_error", r.torque.p95_rel_error}};
  return json;
}

/// The body and the motions of the hands on it; the first hand is reported.
struct Given {
  Scene scene;
  std::vector<Motion> motions;
  std::vector<std::uint8_t> present = {};  ///< by tick: 1 while the hand was present; empty: always
  std::vector<Micros> resets = {};         ///< resets of the body
  std::vector<std::uint8_t> held = {};     ///< number of each hand's tool in the scene
};

std::size_t hand_named(const Session& session, const std::string& name, const std::string& where) {
  std::string names;
  for (std::size_t k = 0; k < session.hands.size(); ++k) {
    if (name.empty() || session.hands[k].name == name) return k;
    names += (names.empty() ? "" : ", ") + session.hands[k].name;
  }
  if (names.empty())
    throw InputError(where, "holds no hand's motion between --from-s and --to-s", "a time in which somebody moved");
  throw InputError("--station " + name, "is no hand in " + where, "one of " + names);
}

Given given_by_recording(const ReplayFlags& flags) {
  const std::string where = "--recording " + flags.recording;
  const MappedFile file(flags.recording);
  const RecordingReader recording(file.bytes(), where);
  if (!recording.complete()) fmt::print(stderr, "{}: {}; what can be read is replayed\n", where, recording.damage());
  const RecordingHead& head = recording.head();
  if (flags.scene.empty() && head.scene.empty())
    throw InputError(where, "was made by a client, which does not know the scene", "--scene FILE beside it");
  const Session session = cut(read_session(recording), flags.from_s, flags.to_s);
  const std::size_t which = hand_named(session, flags.station, where);
  if (session.blocks_lost > 0)
    fmt::print(stderr, "{}: {} blocks are damaged; hands move straight through\n", where, session.blocks_lost);
  if (session.hands.size() > 1)
    fmt::print("station \"{}\", with the {} other{} on the body\n", session.hands[which].name, session.hands.size() - 1,
               session.hands.size() > 2 ? "s" : "");
  Given given{flags.scene.empty() ? opened(read_scene(head.scene, head.scene_file, flags.mesh_folders), head.scene_file)
                                  : open_scene(flags.scene, flags.mesh_folders),
              motions_of(session, which, where), presence_of(session, which), resets_of(session)};
  for (std::size_t k = 0; k < session.hands.size(); ++k)
    given.held.push_back(tool_number(given.scene, session.hands[(which + k) % session.hands.size()].tool, where));
  return given;
}

Given given_by(const ReplayFlags& flags) {
  if (!flags.recording.empty()) {
    if (!flags.motions.empty() || !flags.gesture.empty())
      throw InputError(flags.motions.empty() ? "--gesture" : "--motion", "beside --recording", "one of the two");
    return given_by_recording(flags);
  }
  if (!flags.station.empty()) throw InputError("--station", "without a recording", "--recording FILE");
  if (!flags.tools.empty() && flags.motions.empty())
    throw InputError("--tools", "without --motion", "it with the motions of hands; a recording has their tools");
  if (flags.from_s > 0 || flags.to_s < kMostSeconds)
    throw InputError(flags.from_s > 0 ? "--from-s" : "--to-s", "without a recording", "--recording FILE");
  if (!flags.motions.empty() && !flags.gesture.empty()) throw InputError("--gesture", "beside --motion", "one of the two");
  if (flags.scene.empty() || (flags.motions.empty() && flags.gesture.empty()))
    throw InputError(flags.scene.empty() ? "--scene" : "--motion", "is missing",
                     "--scene with --motion or --gesture, or --recording");
  if (!flags.gesture.empty()) {
    Scene scene = open_scene(flags.scene, flags.mesh_folders);
    Motion motion = surface_gesture(scene, *surface_gesture_from_name(flags.gesture));
    return {std::move(scene), {std::move(motion)}, {}};
  }
  Given given{open_scene(flags.scene, flags.mesh_folders), {}, {}};
  given.held = tools_held(given.scene, flags.tools, flags.motions.size(), "--motion");
  for (const std::string& file : flags.motions) {
    given.motions.push_back(read_motion(file));
    if (!given.scene.tool.holds.empty() && given.motions.back().button_count() > 0)
      throw InputError("--motion " + file, "presses buttons, which tie threads of " + given.scene.name,
                       "a motion without them: the full model that it is compared with ties none");
  }
  return given;
}

bool is_scored(const ReplayResult& result) { return result.fidelity.contact_ticks > 0; }

/// Prints the share of time with a hand, unless it was present throughout.
void say_presence(const std::vector<std::uint8_t>& present) {
  const auto there = std::count(present.begin(), present.end(), std::uint8_t{1});
  if (there + 1 < std::ssize(present))
    fmt::print("a hand was there for {:.1f} of {:.1f} s; the rest is not scored\n", 1e-3 * static_cast<double>(there),
               1e-3 * static_cast<double>(present.size()));
}

/// Writes CSV and picture of the forces over a round trip. `name` is that of the files without what follows the point.
void write_run(const std::filesystem::path& name, const ReplayFlags& flags, const Scene& scene, double rtt_ms,
               const ReplayResult& result) {
  const std::filesystem::path csv = name.string() + ".csv";
  write_forces(csv, result);
  plot_csv(csv, name.string() + ".svg",
           fmt::format("{}, {} at {:g} Hz, RTT {:g} ms: {}", scene.name, flags.scheme, flags.link.rate_hz, rtt_ms,
                       is_scored(result) ? fmt::format("{:.1f} dB", result.fidelity.snr_db) : "no contact"),
           "time [s]",
           {{"force x [N]", {{"1:5", "1 kHz full model", 0}, {"1:2", flags.scheme, 1}}},
            {"force y [N]", {{"1:6", "1 kHz full model", 0}, {"1:3", flags.scheme, 1}}},
            {"force z [N]", {{"1:7", "1 kHz full model", 0}, {"1:4", flags.scheme, 1}}}});
}

void print_no_contact(const Scene& scene, const ReplayResult& result, const std::filesystem::path& forces) {
  std::vector<Vec3> path;
  for (const ReplayTick& tick : result.ticks) path.push_back(tick.position);
  fmt::print(stderr, "palpate-lab: {}; see {}\n", no_contact(scene, path), forces.string());
}

int run_replay(const ReplayFlags& flags) {
  check_once_each("--rtt-ms", flags.rtt_ms);
  if (flags.from_s >= flags.to_s) throw InputError("--from-s", "is not before --to-s", "a time before it");
  const auto [scene, motions, present, resets, held] = given_by(flags);
  options_of(flags, scene, 0);  // refuses a scheme before anything is computed
  const auto out = make_output_folder(flags.out);
  if (scene.tool.contact == ContactKind::attach && needs_settling(scene, motions.front().position(0.0)))
    fmt::print(
        stderr,
        "the body is given {:g} s to settle before the motion: it hangs in gravity, or the motion starts beside the node\n",
        seconds(kSettle));
  say_presence(present);
  const bool many = flags.rtt_ms.size() > 1;
  Json figures;
  std::vector<ReferenceForce> references;
  for (const double rtt_ms : flags.rtt_ms) {
    ReplayOptions options = options_of(flags, scene, rtt_ms);
    options.scored = present;
    options.resets = resets;
    options.held = held;
    options.references = references;
    options.progress = show_progress();
    const std::vector<ReplayResult> results = replay_together(scene, motions, options, stopwatch_ns);
    options.progress = {};
    const bool first = std::exchange(references, references_of(results)).empty();
    const ReplayResult& result = results.front();
    const std::filesystem::path name = out / (many ? fmt::format("forces-{:g}ms", rtt_ms) : "forces");
    write_run(name, flags, scene, rtt_ms, result);
    Json row = summary(result, present);
    if (many) row["rtt_ms"] = rtt_ms;
    many ? figures["round_trips"].push_back(row) : figures.update(row);
    write_json(out / "summary.json", figures);
    if (!is_scored(result)) {
      print_no_contact(scene, result, name.string() + ".csv");
      return 1;
    }
    const bool turned = result.torque.contact_ticks > 0;
    if (first)
      fmt::print("{:>8} {:<9} {:>8} {:>14}{} {:>8} {:>8} {:>9} {:>7}\n", "RTT [ms]", "served", "SNR [dB]", "p95 error [%]",
                 turned ? "  of torque" : "", "lag [ms]", "patches", "patch [B]", "states");
    const std::string served(options.make_patch ? flags.scheme : name_of(result.last_patch.scheme));
    const std::string torque =
        turned ? fmt::format(" {:>4.1f} {:>5.1f}", result.torque.snr_db, 100 * result.torque.p95_rel_error) : "";
    fmt::print("{:>8g} {:<9} {:>8.1f} {:>14.1f}{} {:>8} {:>8} {:>9.0f} {:>7}\n", rtt_ms, served, result.fidelity.snr_db,
               100 * result.fidelity.p95_rel_error, torque, result.fidelity.lag_ms, result.patches_used, result.patch_bytes_mean,
               result.patch_states);
    std::fflush(stdout);
  }
  fmt::print("{}\n", (out / "summary.json").string());
  return 0;
}

}  // namespace

void add_replay(CLI::App& app, Run& run) {
  auto flags = std::make_shared<ReplayFlags>();
  CLI::App* c = app.add_subcommand(
      "replay",
      "replay a motion or recording through a scheme over a link in virtual time, and compare with the 1 kHz full model");
  c->add_option("--scene", flags->scene, "scene file (JSON); with --recording it replaces the recorded one")->type_name("FILE");
  add_mesh_folders(*c, flags->mesh_folders);
  c->add_option("--motion", flags->motions,
                "motion file (CSV t_s,x_m,y_m,z_m); give it again for each further hand on the body: the first is reported")
      ->type_name("FILE");
  add_tools_held(*c, flags->tools, "with --motion: ");
  c->add_option("--gesture", flags->gesture, "use a motion made from the body's own surface")
      ->check(one_of(std::vector<std::string>(kSurfaceGestureNames.begin(), kSurfaceGestureNames.end())));
  c->add_option("--recording", flags->recording, "use the hands and the scene of a recorded session")->type_name("FILE");
  c->add_option("--station", flags->station, "station of the recording whose force is reported; default: the first that moved")
      ->type_name("NAME");
  c->add_option("--from-s,--from", flags->from_s, "begin of the part of the recording")
      ->check(number_from<double>(0, kMostSeconds));
  c->add_option("--to-s,--to", flags->to_s, "end of the part of the recording; default: its end")
      ->check(number_from<double>(0, kMostSeconds))
      ->default_str("");
  c->add_option("--scheme", flags->scheme, "scheme of the patches; auto: the server chooses as if it had the time")
      ->type_name("NAME")
      ->required();
  c->add_option("--order", flags->order, "number of states of a patch (twice its modes), 0: the scheme's default")
      ->check(number_from(0, 2 * kMaxModes));
  flags->link.add_to_sweep(*c);
  c->add_option("--rtt-ms", flags->rtt_ms, "round trips, separated by commas; each way takes half")
      ->type_name("MS")
      ->delimiter(',')
      ->check(number_from<double>(0, 10'000))
      ->default_str("0");
  c->add_option("--device", flags->device, "none: the motion as given; sim: a Phantom in a hand that follows it")
      ->check(one_of({"none", "sim"}));
  c->add_option("--deadband", flags->deadband, "share of the force below which a change is not sent, 0: every patch is sent")
      ->check(number_from<double>(0, kMaxDeadband));
  c->add_option("--passivity", flags->passivity, "passivity limiter of the guard; observe: it only computes energies")
      ->transform(one_of_names<PassivityMode>(
          {{"off", PassivityMode::off}, {"observe", PassivityMode::observe}, {"on", PassivityMode::on}}))
      ->default_str("off");
  c->add_option("--out", flags->out,
                "folder for forces.csv, summary.json and forces.svg; with several round trips forces-50ms.csv and so on")
      ->type_name("DIR")
      ->required();
  c->callback([flags, &run] { run = [flags] { return run_replay(*flags); }; });
}

}  // namespace palpate
