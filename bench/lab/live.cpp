// palpate-lab live: a hand over a bad link in real time, the same hand in virtual time, and the loss of fidelity from each cause.
//
// In virtual time the same motion goes over the same kind of link with the same scheme: first with a server whose frames take
// exactly the times of the live one's; then with their mean; then also without jitter, without loss, without both, and without
// computing time. So the difference of neighbouring rows is the effect of one cause. The difference between the first two rows
// has only real-time causes: omitted rollouts, threads that woke late, and other random draws of the same link.
#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <numeric>
#include <vector>

#include "bench/fidelity/metrics.hpp"
#include "bench/fidelity/replay.hpp"
#include "bench/lab/experiments.hpp"
#include "bench/lab/flags.hpp"
#include "bench/lab/link_flags.hpp"
#include "bench/lab/live_run.hpp"
#include "bench/lab/parallel.hpp"
#include "bench/output/output.hpp"
#include "bench/output/plot.hpp"
#include "common/base/error.hpp"
#include "common/command_line/mesh_folders.hpp"
#include "server/body/unload.hpp"

namespace palpate {
namespace {

struct Flags {
  std::string scene, motion, scheme = "hyper", out;
  MeshFolders mesh_folders;
  double duration_s = 0;
  LinkFlags link;
};

struct LiveRow {
  std::string name;
  double snr_db = 0, age_mean_ms = 0, age_p95_ms = 0;
  double bytes = 0;  ///< per patch, with its copies and terms
};

double share_pct(double part, double all) { return all > 0 ? 100 * part / all : 0; }

void set_ages(LiveRow& row, std::vector<double> ages_ms) {
  std::erase_if(ages_ms, [](double age) { return age < 0; });
  double sum = 0;
  for (const double age : ages_ms) sum += age;
  row.age_mean_ms = ages_ms.empty() ? 0 : sum / static_cast<double>(ages_ms.size());
  row.age_p95_ms = percentile(std::move(ages_ms), 0.95);
}

LiveRow row_of(const LiveRun& run, const ReferenceForce& reference) {
  LiveRow row{.name = "live"};
  row.snr_db = compare(run.report.displays.front().force, reference.force, kSkipTicks).snr_db;
  set_ages(row, run.report.patch_age_ms);
  row.bytes = run.client.at("patch_bytes_mean").get<double>();
  return row;
}

LiveRow row_of(const std::string& name, const ReplayResult& result) {
  LiveRow row{.name = name};
  row.snr_db = result.fidelity.snr_db;
  std::vector<double> ages_ms;
  for (const ReplayTick& tick : result.ticks) ages_ms.push_back(1e3 * seconds(tick.patch_age));
  set_ages(row, std::move(ages_ms));
  row.bytes = result.patch_bytes_mean;
  return row;
}

enum class Computing { frame_by_frame, mean, none };
struct Variant {
  const char* name;
  bool jitter, loss;
  Computing computing;
};
constexpr Variant kVirtual[] = {{"virtual, same link", true, true, Computing::frame_by_frame},
                                {"all frames alike", true, true, Computing::mean},
                                {"without jitter", false, true, Computing::mean},
                                {"without loss", true, false, Computing::mean},
                                {"without both", false, false, Computing::mean},
                                {"and no computing", false, false, Computing::none}};

std::vector<ReplayResult> in_virtual_time(const Flags& flags, const Scene& scene, const Motion& motion,
                                          const ReferenceForce& reference, const std::vector<Micros>& frame_times) {
  const Micros sum = std::accumulate(frame_times.begin(), frame_times.end(), Micros{});
  const Micros mean = frame_times.empty() ? Micros{} : sum / static_cast<std::int64_t>(frame_times.size());
  std::vector<ReplayResult> results(std::size(kVirtual));
  run_all(results.size(), [&](std::size_t k) {
    ReplayOptions options = replay_options(flags.scheme, 0, flags.link);
    options.reference = &reference;
    if (kVirtual[k].computing == Computing::frame_by_frame) options.frame_times = frame_times;
    if (kVirtual[k].computing == Computing::mean) options.compute = mean;
    if (!kVirtual[k].jitter) options.link.jitter = Micros{};
    if (!kVirtual[k].loss) options.link.loss = 0;
    results[k] = replay(scene, motion, options, stopwatch_ns);
  });
  return results;
}

Motion begin_of(const Motion& motion, double duration_s) {
  if (!(duration_s > 0) || duration_s >= motion.duration_s()) return motion;
  std::vector<MotionPoint> points;
  for (const MotionPoint& point : motion.points())
    if (point.t_s < duration_s) points.push_back(point);
  points.push_back({duration_s, motion.position(duration_s)});
  return Motion(std::move(points));
}

void write_forces(const std::filesystem::path& file, const std::vector<Vec3>& live, const ReplayResult& same,
                  const ReferenceForce& reference) {
  std::string csv = "t_s,ref_fx_n,ref_fy_n,ref_fz_n,live_fx_n,live_fy_n,live_fz_n,virtual_fx_n,virtual_fy_n,virtual_fz_n\n";
  const std::size_t ticks = std::min({live.size(), same.ticks.size(), reference.force.size()});
  for (std::size_t i = 0; i < ticks; ++i) {
    fmt::format_to(std::back_inserter(csv), "{:.3f}", static_cast<double>(i) * 1e-3);
    for (const Vec3& f : {reference.force[i], live[i], same.ticks[i].felt})
      fmt::format_to(std::back_inserter(csv), ",{:.6g},{:.6g},{:.6g}", f.x(), f.y(), f.z());
    csv += '\n';
  }
  write_text(file, csv);
}

void print(const std::vector<LiveRow>& rows) {
  fmt::print("\n  {:<20} {:>8} {:>13} {:>14} {:>11}\n", "", "SNR [dB]", "mean age [ms]", "95 % age [ms]", "a patch [B]");
  for (const LiveRow& row : rows)
    fmt::print("  {:<20} {:>8.1f} {:>13.0f} {:>14.0f} {:>11.0f}\n", row.name, row.snr_db, row.age_mean_ms, row.age_p95_ms,
               row.bytes);
}

struct LivePart {
  std::string name;
  double db = 0;
};

/// Rows: live, then kVirtual.
std::vector<LivePart> parts_of(const std::vector<LiveRow>& rows) {
  const double live = rows[0].snr_db, same = rows[1].snr_db, alike = rows[2].snr_db, no_jitter = rows[3].snr_db,
               no_loss = rows[4].snr_db, neither = rows[5].snr_db, all = rows[6].snr_db;
  return {{"real time", same - live},
          {"frames that differ", alike - same},
          {"jitter, with loss there", no_jitter - alike},
          {"loss, with jitter there", no_loss - alike},
          {"jitter alone", neither - no_loss},
          {"loss alone", neither - no_jitter},
          {"jitter and loss", neither - alike},
          {"computing", all - neither}};
}

/// Figures of the live run.
struct LiveFigures {
  double frame_ms_mean = 0, frame_ms_max = 0, skipped_pct = 0;
  double without_rollouts_pct = 0;  ///< share of the frames that stepped the body
  double without_terms_pct = 0;     ///< share of the patches that lacked a piece of their terms
  double late_pct = 0;              ///< share of late ticks
};

LiveFigures figures_of(const LiveRun& run, const std::string& scheme) {
  const ServerCounts& server = run.server;
  const auto client = [&](const char* name) { return run.client.at(name).get<double>(); };
  const auto stepped = static_cast<double>(server.frames - server.frames_asleep);
  LiveFigures figures;
  figures.frame_ms_mean = stepped > 0 ? 1e3 * seconds(server.frame_time_sum) / stepped : 0;
  figures.frame_ms_max = 1e3 * seconds(server.frame_time_max);
  figures.skipped_pct =
      share_pct(static_cast<double>(server.frames_busy), static_cast<double>(server.frames + server.frames_busy));
  figures.without_rollouts_pct = share_pct(static_cast<double>(server.frames_without_rollouts), stepped);
  if (scheme == "hyper") figures.without_terms_pct = 100 - share_pct(client("patches_bent"), client("patches_accepted"));
  figures.late_pct = share_pct(client("late_ticks"), client("ticks"));
  return figures;
}

void print(const LiveFigures& f) {
  fmt::print(
      "\n  live: a frame takes {:.1f} ms in the mean and {:.1f} at most; {:.1f} % of the frames were skipped, {:.1f} % had no "
      "time\n  for rollouts, {:.1f} % of the patches lacked some of their terms, {:.2f} % of the ticks woke late\n\n",
      f.frame_ms_mean, f.frame_ms_max, f.skipped_pct, f.without_rollouts_pct, f.without_terms_pct, f.late_pct);
}

void print(const std::vector<LivePart>& parts) {
  fmt::print("\n  {:<26} {:>6}\n", "what takes how much", "[dB]");
  for (const LivePart& part : parts) fmt::print("  {:<26} {:>6.1f}\n", part.name, part.db);
}

Json to_json(const LiveRow& row) {
  return {{"name", row.name},
          {"snr_db", row.snr_db},
          {"patch_age_mean_ms", row.age_mean_ms},
          {"patch_age_p95_ms", row.age_p95_ms},
          {"patch_bytes", row.bytes}};
}

Json to_json(const LiveFigures& f, const std::vector<LiveRow>& rows, const std::vector<LivePart>& parts) {
  Json json{{"frame_ms_mean", f.frame_ms_mean},
            {"frame_ms_max", f.frame_ms_max},
            {"frames_skipped_pct", f.skipped_pct},
            {"frames_without_rollouts_pct", f.without_rollouts_pct},
            {"patches_without_terms_pct", f.without_terms_pct},
            {"ticks_late_pct", f.late_pct}};
  for (const LiveRow& row : rows) json["rows"].push_back(to_json(row));
  for (const LivePart& part : parts) json["parts_db"][part.name] = part.db;
  return json;
}

void plot(const std::filesystem::path& out, const std::string& scene, const std::vector<LiveRow>& rows, std::size_t ticks) {
  const auto panel = [](const char* axis, int column) {
    const auto use = [](int c) { return fmt::format("1:{}", c); };
    return Panel{fmt::format("force {} [N]", axis),
                 {{use(column), "1 kHz full model", 0}, {use(column + 6), "virtual time", 2}, {use(column + 3), "live", 1}}};
  };
  const auto title = fmt::format("{}: live {:.1f} dB, in virtual time {:.1f} dB", scene, rows[0].snr_db, rows[1].snr_db);
  if (plot_csv(out / "live.csv", out / "live.svg", title, "time [s]", {panel("x", 2), panel("y", 3), panel("z", 4)},
               {.rows = ticks}))
    fmt::print("  plot      {}\n", (out / "live.svg").string());
}

int run_live_experiment(Flags flags) {
  flags.scheme = name_of(available_scheme(flags.scheme));
  const Scene scene = open_scene(flags.scene, flags.mesh_folders);
  const auto out = make_output_folder(flags.out);
  const Motion motion = begin_of(read_motion(flags.motion), flags.duration_s);
  write_motion(out / "motion.csv", motion);
  fmt::print("live: {} over {:g} ms round trip, {:g} ms jitter, {:g} % loss, {:.0f} s\n", scene.name, flags.link.rtt_ms,
             flags.link.jitter_ms, flags.link.loss_pct, motion.duration_s());
  std::fflush(stdout);
  const LiveRun run = run_live({scene, out / "motion.csv", flags.scheme, flags.link.one_way(), flags.link.rate_hz, out});
  const LiveFigures figures = figures_of(run, flags.scheme);
  fmt::print("then the same in virtual time, {} runs\n", std::size(kVirtual));
  std::fflush(stdout);
  const ReferenceForce reference = reference_of(scene, motion);
  const auto results = in_virtual_time(flags, scene, motion, reference, run.frame_times);

  std::vector<LiveRow> rows{row_of(run, reference_force(scene, run.report.positions))};
  for (std::size_t k = 0; k < results.size(); ++k) rows.push_back(row_of(kVirtual[k].name, results[k]));
  const std::vector<LivePart> parts = parts_of(rows);
  print(rows);
  print(parts);
  print(figures);
  write_json(out / "live.json", to_json(figures, rows, parts));
  write_forces(out / "live.csv", run.report.displays.front().force, results.front(), reference);
  plot(out, scene.name, rows, reference.force.size());
  fmt::print("  figures   {}\n", (out / "live.json").string());
  return 0;
}

}  // namespace

void add_live(CLI::App& app, Run& run) {
  auto flags = std::make_shared<Flags>();
  flags->link.rtt_ms = 120;
  flags->link.jitter_ms = 10;
  flags->link.loss_pct = 3;
  CLI::App* c = app.add_subcommand("live", "a hand over a bad link in real time, beside virtual time: what each cause takes");
  c->add_option("--scene", flags->scene, "scene file (JSON)")->type_name("FILE")->required();
  add_mesh_folders(*c, flags->mesh_folders);
  c->add_option("--motion", flags->motion, "motion file (CSV t_s,x_m,y_m,z_m)")->type_name("FILE")->required();
  c->add_option("--scheme", flags->scheme, "how patches are made")->type_name("NAME")->capture_default_str();
  c->add_option("--duration-s", flags->duration_s, "of the motion's beginning; default: all of it")
      ->check(number_from<double>(1.5, 3600));
  flags->link.add_to(*c);
  c->remove_option(c->get_option("--compute-ms"));  // determined by the live run
  c->add_option("--out", flags->out, "folder for live.csv, live.json, live.svg and the client's report")
      ->type_name("DIR")
      ->required();
  c->callback([flags, &run] { run = [flags] { return run_live_experiment(*flags); }; });
}

}  // namespace palpate
