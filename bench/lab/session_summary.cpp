// palpate-lab summary: metrics of each hand in a recorded session, as figures and as a page.
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <iterator>

#include "bench/lab/experiments.hpp"
#include "bench/lab/flags.hpp"
#include "bench/lab/page.hpp"
#include "bench/lab/session_csv.hpp"
#include "bench/output/output.hpp"
#include "bench/output/plot.hpp"
#include "common/assessment/session_metrics.hpp"
#include "common/assessment/task_attempts.hpp"
#include "common/base/counted.hpp"
#include "common/io/mapped_file.hpp"
#include "session_page.hpp"

namespace palpate {
namespace {

struct SessionSummaryFlags {
  std::string recording, out;
  double over_n = kOverN;
};

Json figures_of(const SessionMetrics& m) {
  Json figures;
  each_figure(m, [&](const char* name, const auto& value) { figures[name] = value; });
  return figures;
}

void write_path(const std::filesystem::path& file, const SessionHand& hand) {
  std::string csv = "t_s,x_m,y_m,z_m\n";
  double t = hand.path.front().t_s;
  for (const Vec3& x : resampled(hand.path)) {
    fmt::format_to(std::back_inserter(csv), "{:.3f},{:.9f},{:.9f},{:.9f}\n", t, x.x(), x.y(), x.z());
    t += 1 / kResampleHz;
  }
  write_text(file, csv);
}

/// Draws both views of the path in squares of one scale.
std::string square(const std::vector<Vec3>& path, int across, int up) {
  Vec3 low = path.front(), high = low;
  for (const Vec3& x : path) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  constexpr double kMargin = 0.55, kLeastM = 1e-3;
  const double half = std::max(kMargin * (high - low).maxCoeff(), kLeastM);
  const Vec3 middle = 0.5 * (low + high);
  return fmt::format("set size square\nset xrange [{}:{}]\nset yrange [{}:{}]", 1e3 * (middle[across] - half),
                     1e3 * (middle[across] + half), 1e3 * (middle[up] - half), 1e3 * (middle[up] + half));
}

void plot(const std::filesystem::path& folder, const SessionHand& hand, double over_n) {
  PlotOptions options;
  options.rows = hand.forces.size();
  plot_csv(
      folder / "forces.csv", folder / "force.svg", hand.name, "time [s]",
      {{"force [N]", {{"1:(sqrt($2**2+$3**2+$4**2))", "size of the force", 1}, {fmt::format("1:({})", over_n), "threshold", 5}}}},
      options);
  const std::vector<Vec3> path = resampled(hand.path);
  const auto csv = folder / "path.csv";
  plot_grid(folder / "path.svg", hand.name, 2,
            {{"from above", "x [mm]", "y [mm]", {{"(1e3*$2):(1e3*$3)", "", 1, csv}}, square(path, 0, 1)},
             {"from the side", "x [mm]", "z [mm]", {{"(1e3*$2):(1e3*$4)", "", 1, csv}}, square(path, 0, 2)}});
}

Json row_of(const SessionHand& hand, const SessionMetrics& m, const std::filesystem::path& folder) {
  const auto number = [](double value, int digits) { return fmt::format("{:.{}f}", value, digits); };
  return {{"name", hand.name},
          {"folder", folder.filename().string()},
          {"contact", number(m.contact_s, 1)},
          {"contacts", m.contacts},
          {"peak", number(m.force_peak_n, 2)},
          {"mean", number(m.force_mean_n, 2)},
          {"over", number(m.over_s, 1)},
          {"overs", m.overs},
          {"path", number(m.path_m, 2)},
          {"speed", number(1e3 * m.speed_mean_m_s, 1)},
          {"sparc", number(m.sparc, 2)},
          {"force_uri", picture_uri(folder / "force.svg")},
          {"path_uri", picture_uri(folder / "path.svg")}};
}

/// Describes lost parts; empty if there are none.
std::string missing_text(const RecordingLoss& loss) {
  if (loss.places == 0) return "";
  return fmt::format("damaged in {}: {:.2f} s are missing", counted(loss.places, "place"), seconds(loss.time));
}

Json page_of(const RecordingReader& recording, const RecordingLoss& loss, double over_n) {
  const RecordingHead& head = recording.head();
  const bool room = head.kind == RecordingKind::room;
  return {{"title", fmt::format("Session of {} \"{}\"", room ? "room" : "station", head.name)},
          {"what", room ? "A room, as its server saw it" : "A station, as its client felt it"},
          {"program", head.program},
          {"begun", fmt::format("{:%Y-%m-%d %H:%M}", fmt::gmtime(static_cast<std::time_t>(seconds(head.unix_time))))},
          {"duration", fmt::format("{:.1f}", seconds(recording.end() - recording.begin()))},
          {"scene", head.scene_file},
          {"damage", recording.damage()},
          {"lost", missing_text(loss)},
          {"threshold", fmt::format("{:g}", over_n)},
          {"force_source",
           room ? fmt::format("Of the server's body at its frames, {:g} a second: not what the hand felt, whose peaks are "
                              "between them; a recording of the client has that, every millisecond.",
                              head.rate_hz)
                : "As it was rendered, every millisecond."}};
}

/// Reports a time in which one hand guided another.
void report_guidance(const SessionGuidance& hold, Json& summary, Json& page) {
  const double lasted_s = hold.to_s - hold.from_s;
  summary["guidance"].push_back({{"guide", hold.guide},
                                 {"guided", hold.guided},
                                 {"from_s", hold.from_s},
                                 {"duration_s", lasted_s},
                                 {"guide_force_mean_n", hold.guide_force_n},
                                 {"guided_force_mean_n", hold.guided_force_n}});
  page["guidance"].push_back({{"guide", hold.guide},
                              {"guided", hold.guided},
                              {"from", fmt::format("{:.1f}", hold.from_s)},
                              {"lasted", fmt::format("{:.1f}", lasted_s)},
                              {"guide_force", fmt::format("{:.2f}", hold.guide_force_n)},
                              {"guided_force", fmt::format("{:.2f}", hold.guided_force_n)}});
  fmt::print("{} guided {} from {:.1f} s on for {:.1f} s, mean force {:.2f} N on the guide and {:.2f} N on the guided hand\n",
             hold.guide, hold.guided, hold.from_s, lasted_s, hold.guide_force_n, hold.guided_force_n);
}

void report_note(const SessionNote& note, Json& summary, Json& page) {
  summary["notes"].push_back({{"t_s", note.t_s}, {"written_s", note.written_s}, {"author", note.author}, {"text", note.text}});
  page["notes"].push_back({{"t", fmt::format("{:.1f}", note.t_s)},
                           {"author", note.author},
                           {"text", note.text.empty() ? "a mark without words" : note.text}});
  fmt::print("{:.1f} s, {}: {}\n", note.t_s, note.author, note.text.empty() ? "(a mark)" : note.text);
}

Json figures_of(const TaskAttempt& a) {
  const TaskProgress& p = a.progress;
  return {{"attempt", a.number}, {"begin_s", a.begin_s},         {"score", p.score},        {"done", p.done},
          {"time_s", p.time_s},  {"force_max_n", p.force_max_n}, {"held_s", p.held_s},      {"traced_m", p.traced_m},
          {"within", p.within},  {"miss_m", p.miss_m},           {"marked", p.mark ? 1 : 0}};
}

/// Reports the training task: the attempts of every hand.
void add_task(const RecordingReader& recording, Json& summary, Json& page) {
  if (!recording.head().task) return;
  const Task& task = *recording.head().task;
  summary["task"] = {{"kind", kind_of(task)}, {"text", task.text}};
  page["task"] = task.text;
  page["attempts"] = Json::array();
  for (const TaskAttempt& a : task_attempts(recording)) {
    summary["stations"][a.station]["attempts"].push_back(figures_of(a));
    page["attempts"].push_back({{"name", a.station},
                                {"number", a.number},
                                {"score", fmt::format("{:.0f}", a.progress.score)},
                                {"words", in_words(task, a.progress)},
                                {"time", fmt::format("{:.1f}", a.progress.time_s)}});
    fmt::print("{}: attempt {} scores {:.0f} of 100 ({}: {}), {:.1f} s\n", a.station, a.number, a.progress.score, kind_of(task),
               in_words(task, a.progress), a.progress.time_s);
  }
}

int run_summary(const SessionSummaryFlags& flags) {
  const std::string where = "--recording " + flags.recording;
  const MappedFile file(flags.recording);
  const RecordingReader recording(file.bytes(), where);
  const auto out = make_output_folder(flags.out);
  StationFolders folders = export_csv(recording, out).folders;
  const Session session = read_session(recording);
  const RecordingLoss loss = loss_of(recording);
  if (!recording.complete()) fmt::print(stderr, "{}: {}\n", where, recording.damage());
  if (loss.places > 0) fmt::print(stderr, "{}: {}\n", where, missing_text(loss));
  Json page = page_of(recording, loss, flags.over_n), summary = {{"threshold_n", flags.over_n}};
  const RecordingHead& head = recording.head();
  const bool sampled = head.kind == RecordingKind::room;
  summary["force_rate_hz"] = sampled ? head.rate_hz : kHapticRateHz;
  summary["force_is_felt"] = sampled ? 0 : 1;
  summary["complete"] = recording.complete() && loss.places == 0 ? 1 : 0;
  summary["damaged_places"] = loss.places;
  summary["missing_s"] = seconds(loss.time);
  summary["stations"] = Json::object();
  for (const SessionGuidance& hold : session.guidances) report_guidance(hold, summary, page);
  if (!session.notes.empty()) page["noted"] = 1;
  for (const SessionNote& note : session.notes) report_note(note, summary, page);
  for (const SessionHand& hand : session.hands) {
    const auto folder = out / folders.of(hand.name);
    const SessionMetrics m = session_metrics(hand, flags.over_n);
    write_path(folder / "path.csv", hand);
    plot(folder, hand, flags.over_n);
    summary["stations"][hand.name] = figures_of(m);
    if (!hand.tool.empty()) summary["stations"][hand.name]["tool"] = hand.tool;
    page["hands"].push_back(row_of(hand, m, folder));
    fmt::print("{}: {:.1f} s in contact, {:.2f} N {}, {:.2f} N mean, {:.1f} s over {:g} N, path {:.2f} m, smoothness {:.2f}\n",
               hand.name, m.contact_s, m.force_peak_n, sampled ? "peak of the server's frames" : "peak felt", m.force_mean_n,
               m.over_s, flags.over_n, m.path_m, m.sparc);
    if (m.torque_peak_nm > 0) fmt::print("{}: {:.3f} N m peak torque felt\n", hand.name, m.torque_peak_nm);
  }
  add_task(recording, summary, page);
  if (sampled)
    fmt::print(
        "forces are those of the server's body, {:g} a second: a hand felt more in between. What it felt is in a recording of "
        "its "
        "client (palpate-client --record), or computed again by palpate-lab replay --recording\n",
        head.rate_hz);
  write_json(out / "summary.json", summary);
  write_text(out / "report.html", render_page(kSessionPage, page));
  fmt::print("{}\n", (out / "report.html").string());
  return 0;
}

}  // namespace

void add_summary(CLI::App& app, Run& run) {
  auto flags = std::make_shared<SessionSummaryFlags>();
  CLI::App* c =
      app.add_subcommand("summary", "summarise what each hand did in a recorded session: contact, force, path, smoothness");
  c->add_option("--recording", flags->recording, "file written by palpate-server or palpate-client with --record")
      ->type_name("FILE")
      ->required();
  c->add_option("--over-n", flags->over_n, "threshold of the force above which time and events are counted")
      ->check(number_from<double>(0, 1e4));
  c->add_option("--out", flags->out, "folder for summary.json, report.html and the CSV files")->type_name("DIR")->required();
  c->callback([flags, &run] { run = [flags] { return run_summary(*flags); }; });
}

}  // namespace palpate
