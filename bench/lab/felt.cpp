// palpate-lab felt: what a real run displayed, beside the 1 kHz full model driven with the same recorded tool path.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>

#include "bench/lab/client_report.hpp"
#include "bench/lab/experiments.hpp"
#include "bench/lab/fidelity_json.hpp"
#include "bench/lab/output.hpp"
#include "bench/lab/plot.hpp"
#include "bench/lab/progress.hpp"
#include "bench/measure/metrics.hpp"
#include "bench/measure/reference.hpp"
#include "common/base/error.hpp"

namespace palpate {
namespace {

constexpr std::size_t kFeltSkip = 250;  // the start, in ticks

struct FeltFlags {
  std::string scene, report, out, felt_name;
  double at_least_db = 0;
};

int run_felt(const FeltFlags& flags) {
  if (std::isnan(flags.at_least_db)) throw InputError("--at-least-db", "is nan", "a number of decibels");
  const Scene scene = load_scene(flags.scene);
  const ClientReport recording = read_client_report(flags.report, flags.felt_name);
  const auto out = make_output_folder(flags.out);
  const auto progress = show_progress();
  const ReferenceForce reference = reference_forces(scene, std::span(&recording.positions, 1), {}, [&](double share) {
                                     progress("the full model at 1 kHz", share);
                                   }).front();

  std::string csv = "t_s,ref_fx_n,ref_fy_n,ref_fz_n";
  for (const ReportedDisplay& d : recording.displays) csv += fmt::format(",{0}_fx_n,{0}_fy_n,{0}_fz_n", d.name);
  csv += '\n';
  for (std::size_t i = 0; i < recording.positions.size(); ++i) {
    const Vec3& f = reference.force[i];
    fmt::format_to(std::back_inserter(csv), "{:.3f},{:.6g},{:.6g},{:.6g}", static_cast<double>(i) * 1e-3, f.x(), f.y(), f.z());
    for (const ReportedDisplay& d : recording.displays)
      fmt::format_to(std::back_inserter(csv), ",{:.6g},{:.6g},{:.6g}", d.force[i].x(), d.force[i].y(), d.force[i].z());
    csv += '\n';
  }
  write_text(out / "felt.csv", csv);
  if (compare(recording.displays[0].force, reference.force, kFeltSkip).contact_ticks == 0) {
    write_json(out / "felt.json", {{"contact_ticks", 0}});
    fmt::print(stderr, "palpate-lab: {}; see {}\n", no_contact(scene, recording.positions), (out / "felt.csv").string());
    return 1;
  }

  fmt::print("\nForce felt, against the full model at 1 kHz on the same tool path ({:.0f} s, {} nodes):\n\n",
             static_cast<double>(recording.positions.size()) * 1e-3, scene.body.nodes.size());
  fmt::print("  {:<10} {:>9} {:>11} {:>11} {:>9} {:>12}\n", "scheme", "SNR [dB]", "error [%]", "p95 [%]", "lag [ms]",
             "onset [ms]");
  Json summary;
  std::vector<Panel> panels{{"normal force z [N]", {{"1:4", "1 kHz full model", 0}}},
                            {"tangential force x [N]", {{"1:2", "1 kHz full model", 0}}}};
  double felt_db = 0;
  std::optional<double> hold_db;
  for (std::size_t d = 0; d < recording.displays.size(); ++d) {
    const ReportedDisplay& display = recording.displays[d];
    const Fidelity f = compare(display.force, reference.force, kFeltSkip);
    const OnsetErrors onset = onset_errors(display.contact, reference.contact);
    fmt::print("  {:<10} {:>9.1f} {:>11.1f} {:>11.1f} {:>9} {:>12}\n", display.name, f.snr_db, 100 * f.rel_rms,
               100 * f.p95_rel_error, f.lag_ms, onset.missed > 0 ? "missed" : fmt::format("{:+}", onset.worst_ms));
    summary[display.name] = fidelity_json(f);
    summary[display.name].update({{"onset_error_ms", onset.worst_ms}, {"onsets", onset.onsets}, {"onsets_missed", onset.missed}});
    if (d == 0) felt_db = f.snr_db;
    if (display.name == "hold") hold_db = f.snr_db;
  }
  // Drawn last is drawn on top: the felt one.
  for (std::size_t d = recording.displays.size(); d-- > 0;) {
    const auto style = static_cast<int>(d) + 1;
    panels[0].curves.push_back({fmt::format("1:{}", 5 + 3 * d + 2), recording.displays[d].name, style});
    panels[1].curves.push_back({fmt::format("1:{}", 5 + 3 * d), recording.displays[d].name, style});
  }
  fmt::print(
      "\n  SNR: 20 dB is an error of a tenth, about what a hand can just notice. error: rms of the difference over rms of the "
      "force.\n"
      "  p95: in 95 % of the ticks under load the error is smaller. onset: worst time between the true contact and the displayed "
      "one.\n\n");
  write_json(out / "felt.json", summary);
  if (plot_csv(out / "felt.csv", out / "felt.svg", fmt::format("{}: what the hand felt", scene.name), "time [s]", panels,
               {.rows = recording.positions.size()}))
    fmt::print("  plot      {}\n", (out / "felt.svg").string());
  fmt::print("  figures   {}\n", (out / "felt.json").string());
  if (!hold_db || felt_db - *hold_db >= flags.at_least_db) return 0;
  fmt::print(stderr, "palpate-lab: {} is {:.1f} dB better than hold; expected at least {:g} dB\n", recording.displays[0].name,
             felt_db - *hold_db, flags.at_least_db);
  return 1;
}

}  // namespace

void add_felt(CLI::App& app, Run& run) {
  auto flags = std::make_shared<FeltFlags>();
  CLI::App* c = app.add_subcommand(
      "felt", "what a real run displayed (palpate-client --report), beside the 1 kHz full model on the same path");
  c->add_option("--scene", flags->scene, "scene file of the run")->required();
  c->add_option("--report", flags->report, "folder that palpate-client --report wrote")->required();
  c->add_option("--name", flags->felt_name, "of what was felt, in the table; default: the scheme that the report names");
  c->add_option("--at-least-db", flags->at_least_db,
                "fail unless what was felt is this much better than hold, where hold was compared");
  c->add_option("--out", flags->out, "folder for felt.csv, felt.json, felt.svg")->required();
  c->callback([flags, &run] { run = [flags] { return run_felt(*flags); }; });
}

}  // namespace palpate
