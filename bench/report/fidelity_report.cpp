#include "bench/report/fidelity_report.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <memory>
#include <optional>

#include "bench/fidelity/metrics.hpp"
#include "bench/fidelity/reference.hpp"
#include "bench/output/fidelity_json.hpp"
#include "bench/output/output.hpp"
#include "bench/output/plot.hpp"
#include "bench/output/progress.hpp"
#include "bench/report/clean_link.hpp"
#include "bench/report/client_report.hpp"
#include "common/base/error.hpp"
#include "common/command_line/mesh_folders.hpp"
#include "server/body/unload.hpp"
#include "server/core/room_info.hpp"
#include "server/scene/tools.hpp"

namespace palpate {
namespace {

struct FidelityFlags {
  std::string scene, report, out, felt_name;
  MeshFolders mesh_folders;
  double at_least_db = 0;
  std::optional<double> clean_rtt_ms;
};

/// Comparison of one display with the reference.
struct FidelityRow {
  std::string name;
  Fidelity fidelity;
  OnsetErrors onset;
  std::optional<Fidelity> torque;
};

void write_forces(const std::filesystem::path& file, const ClientReport& report, const ReferenceForce& reference) {
  std::string csv = "t_s,ref_fx_n,ref_fy_n,ref_fz_n";
  for (const ReportedDisplay& d : report.displays) csv += fmt::format(",{0}_fx_n,{0}_fy_n,{0}_fz_n", d.name);
  csv += '\n';
  for (std::size_t i = 0; i < report.positions.size(); ++i) {
    const Vec3& f = reference.force[i];
    fmt::format_to(std::back_inserter(csv), "{:.3f},{:.6g},{:.6g},{:.6g}", static_cast<double>(i) * 1e-3, f.x(), f.y(), f.z());
    for (const ReportedDisplay& d : report.displays)
      fmt::format_to(std::back_inserter(csv), ",{:.6g},{:.6g},{:.6g}", d.force[i].x(), d.force[i].y(), d.force[i].z());
    csv += '\n';
  }
  write_text(file, csv);
}

std::vector<FidelityRow> rows_of(const ClientReport& report, const ReferenceForce& reference) {
  std::vector<FidelityRow> rows;
  for (const ReportedDisplay& display : report.displays) {
    rows.push_back({display.name,
                    compare(display.force, reference.force, kSkipTicks),
                    onset_errors(display.contact, reference.contact),
                    {}});
    const bool has_torque = std::any_of(display.torque.begin(), display.torque.end(), [](const Vec3& t) { return !t.isZero(0); });
    if (has_torque && !reference.torque.empty()) rows.back().torque = compare(display.torque, reference.torque, kSkipTicks);
  }
  return rows;
}

void print(const std::vector<FidelityRow>& rows) {
  std::size_t wide = 10;
  for (const FidelityRow& row : rows)
    wide = std::max(wide, row.name.size() + (row.torque ? std::string_view(", torque").size() : 0));
  fmt::print("  {:<{}} {:>9} {:>14} {:>14} {:>9} {:>17}\n", "display", wide, "SNR [dB]", "rms error [%]", "p95 error [%]",
             "lag [ms]", "worst onset [ms]");
  for (const FidelityRow& row : rows)
    fmt::print("  {:<{}} {:>9.1f} {:>14.1f} {:>14.1f} {:>9} {:>17}\n", row.name, wide, row.fidelity.snr_db,
               100 * row.fidelity.rel_rms, 100 * row.fidelity.p95_rel_error, row.fidelity.lag_ms,
               row.onset.missed > 0 ? "missed" : fmt::format("{:+}", row.onset.worst_ms));
  for (const FidelityRow& row : rows)
    if (row.torque)
      fmt::print("  {:<{}} {:>9.1f} {:>14.1f} {:>14.1f} {:>9}\n", row.name + ", torque", wide, row.torque->snr_db,
                 100 * row.torque->rel_rms, 100 * row.torque->p95_rel_error, row.torque->lag_ms);
  fmt::print(
      "\n  An SNR of 20 dB is an error of a tenth, about what a hand can just notice. The rms error is relative to the rms of "
      "the force. "
      "In\n  95 % of the ticks under load the error is smaller than the p95 error. The onset is the time from the true contact "
      "to the "
      "displayed\n  one.\n\n");
}

void print(const CleanLink& clean, double felt_db) {
  fmt::print(
      "  Over {:g} ms without jitter and loss, from a server that takes no time, the same path has {:.1f} dB ({}, in virtual "
      "time).\n"
      "  Jitter, loss and real time cost {:.1f} dB.\n\n",
      clean.rtt_ms, clean.fidelity.snr_db, clean.scheme, clean.fidelity.snr_db - felt_db);
}

Json to_json(const std::vector<FidelityRow>& rows, const std::optional<CleanLink>& clean) {
  Json json;
  for (const FidelityRow& row : rows) {
    json[row.name] = fidelity_json(row.fidelity);
    json[row.name].update(
        {{"onset_error_ms", row.onset.worst_ms}, {"onsets", row.onset.onsets}, {"onsets_missed", row.onset.missed}});
    if (row.torque) json[row.name]["torque"] = {{"snr_db", row.torque->snr_db}, {"p95_rel_error", row.torque->p95_rel_error}};
  }
  if (!clean) return json;
  json["clean_link"] = {{"scheme", clean->scheme}, {"rtt_ms", clean->rtt_ms}};
  json["clean_link"].update(fidelity_json(clean->fidelity));
  return json;
}

void plot(const std::filesystem::path& out, const Scene& scene, const ClientReport& report) {
  std::vector<Panel> panels{{"normal force z [N]", {{"1:4", "1 kHz full model", 0}}},
                            {"tangential force x [N]", {{"1:2", "1 kHz full model", 0}}}};
  // The display drawn last is on top: the felt one.
  for (std::size_t d = report.displays.size(); d-- > 0;) {
    const auto style = static_cast<int>(d) + 1;
    panels[0].curves.push_back({fmt::format("1:{}", 5 + 3 * d + 2), report.displays[d].name, style});
    panels[1].curves.push_back({fmt::format("1:{}", 5 + 3 * d), report.displays[d].name, style});
  }
  if (plot_csv(out / "fidelity.csv", out / "fidelity.svg", fmt::format("{}: what the hand felt", scene.name), "time [s]", panels,
               {.rows = report.positions.size()}))
    fmt::print("  plot      {}\n", (out / "fidelity.svg").string());
}

/// Returns 1, with a message, if the felt force is not better than hold by the required margin.
int judge(const std::vector<FidelityRow>& rows, double at_least_db) {
  const FidelityRow& felt = rows.front();
  for (const FidelityRow& row : rows) {
    const double better_db = felt.fidelity.snr_db - row.fidelity.snr_db;
    if (row.name != "hold" || better_db >= at_least_db) continue;
    fmt::print(stderr, "{}: {} is {:.1f} dB better than hold; expected at least {:g} dB\n", program_name(), felt.name, better_db,
               at_least_db);
    return 1;
  }
  return 0;
}

/// Refuses a report of another body.
void check_scene(const FidelityFlags& flags, const Scene& scene, const ClientReport& report) {
  const RoomInfo facts = facts_of(scene, home_of(scene));
  const auto differs = [](const std::string& reported, std::uint64_t hash) {
    return !reported.empty() && reported != fmt::format("{:016x}", hash);
  };
  std::string what;
  if (!report.scene.empty() && report.scene != scene.name)
    what = fmt::format("is \"{}\"; the hand of {} felt \"{}\"", scene.name, flags.report, report.scene);
  else if (differs(report.mesh, facts.mesh_hash))
    what = fmt::format("has another surface than the \"{}\" that the hand of {} felt", report.scene, flags.report);
  else if (differs(report.scene_hash, facts.scene_hash))
    what =
        fmt::format("has the surface of the \"{}\" that the hand of {} felt, but other materials, another tool or another step",
                    report.scene, flags.report);
  if (!what.empty()) throw InputError("--scene " + flags.scene, what, "the scene that the server had then");
}

int run_fidelity(const FidelityFlags& flags) {
  if (std::isnan(flags.at_least_db)) throw InputError("--at-least-db", "is nan", "a number of decibels");
  const Scene scene = open_scene(flags.scene, flags.mesh_folders);
  const ClientReport report = read_client_report(flags.report, flags.felt_name);
  check_scene(flags, scene, report);
  const auto out = make_output_folder(flags.out);
  std::optional<CleanLinkRun> clean_run;
  if (flags.clean_rtt_ms) clean_run.emplace(scene, report, *flags.clean_rtt_ms);
  const auto progress = show_progress();
  const auto turns = report.turns.empty() ? std::span<const ToolTurns>() : std::span<const ToolTurns>(&report.turns, 1);
  const auto openings =
      report.openings.empty() ? std::span<const ToolOpenings>() : std::span<const ToolOpenings>(&report.openings, 1);
  const auto shown = [&](double share) { progress("the full model at 1 kHz", share); };
  const std::uint8_t held = tool_number(scene, report.tool, "--report " + flags.report);
  const ReferenceForce reference =
      reference_forces(scene, std::span(&report.positions, 1), {}, shown, turns, openings, std::span(&held, 1)).front();
  write_forces(out / "fidelity.csv", report, reference);
  const std::vector<FidelityRow> rows = rows_of(report, reference);
  if (rows.front().fidelity.contact_ticks == 0) {
    write_json(out / "fidelity.json", {{"contact_ticks", 0}});
    fmt::print(stderr, "{}: {}; see {}\n", program_name(), no_contact(scene, report.positions), (out / "fidelity.csv").string());
    return 1;
  }
  fmt::print("\nForce felt, against the full model at 1 kHz on the same tool path ({:.0f} s, {} nodes):\n\n",
             static_cast<double>(report.positions.size()) * 1e-3, scene.body.nodes.size());
  print(rows);
  std::optional<CleanLink> clean;
  if (clean_run) {
    clean = clean_run->result(reference);
    print(*clean, rows.front().fidelity.snr_db);
  }
  write_json(out / "fidelity.json", to_json(rows, clean));
  plot(out, scene, report);
  fmt::print("  figures   {}\n", (out / "fidelity.json").string());
  return judge(rows, flags.at_least_db);
}

}  // namespace

void add_fidelity_flags(CLI::App& command, Run& run) {
  auto flags = std::make_shared<FidelityFlags>();
  command.add_option("--scene", flags->scene, "scene file of the run")->required()->type_name("FILE");
  add_mesh_folders(command, flags->mesh_folders);
  command.add_option("--report", flags->report, "folder that palpate-client --report wrote")->required()->type_name("DIR");
  command
      .add_option("--name", flags->felt_name, "name of the felt force in the table; default: the scheme that the report names")
      ->type_name("NAME");
  command
      .add_option("--at-least-db", flags->at_least_db,
                  "fail unless the felt force is better than hold by this much; applies where hold was compared")
      ->type_name("N");
  command
      .add_option("--clean-rtt-ms", flags->clean_rtt_ms,
                  "also replay the same path in virtual time over a link of this round trip without jitter and loss")
      ->type_name("N")
      ->check(number_from(0, 10'000));
  command.add_option("--out", flags->out, "folder for fidelity.csv, fidelity.json, fidelity.svg")->required()->type_name("DIR");
  command.callback([flags, &run] { run = [flags] { return run_fidelity(*flags); }; });
}

}  // namespace palpate
