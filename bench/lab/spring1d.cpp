// palpate-lab spring1d: section 2 of the paper, a hand on one nonlinear spring.
#include "bench/paper/spring1d.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>

#include "bench/lab/experiments.hpp"
#include "bench/lab/flags.hpp"
#include "bench/output/output.hpp"
#include "bench/output/plot.hpp"
#include "common/base/error.hpp"

namespace palpate {
namespace {

constexpr double kPrintedStepMm = 0.3;
constexpr double kPaperSnrDb[] = {89, 43, 53, 72};
constexpr int kPaperLagMs[] = {1, 49, 65, 1};
constexpr std::size_t kIdeal = 0, kFiltered = 2, kTangent = 3, kSurface = 4;

/// The same stroke with the device's and with the printed resolution, and a stroke with repeated contact.
struct Spring1dRuns {
  Spring1d device, printed, contact;
};

Spring1dRuns run_all(const Spring1dOptions& options, double contact_hz) {
  Spring1dOptions printed = options, contact = tapping(options);
  printed.position_step_mm = kPrintedStepMm;
  contact.frequency_hz = contact_hz;
  return {run_spring1d(options), run_spring1d(printed), run_spring1d(contact)};
}

void write_curves(const std::filesystem::path& file, const Spring1d& run) {
  std::string csv = "t_s,x_mm,reference_n";
  for (const char* name : kSpringSchemeNames) csv += fmt::format(",{}_n", name);
  csv += '\n';
  for (std::size_t n = 0; n < run.reference_n.size(); ++n) {
    fmt::format_to(std::back_inserter(csv), "{:.3f},{:.6f},{:.6f}", static_cast<double>(n) * 1e-3, run.position_mm[n],
                   run.reference_n[n]);
    for (const auto& shown : run.shown_n) fmt::format_to(std::back_inserter(csv), ",{:.6f}", shown[n]);
    csv += '\n';
  }
  write_text(file, csv);
}

/// Writes the SNR of the ideal scheme over the resolution of the position: simulated, and in closed form.
void write_position_steps(const std::filesystem::path& file, const Spring1dOptions& options, int points) {
  std::string csv = "position_step_mm,snr_paper_db,closed_form_paper_db\n";
  for (int k = 0; k < points; ++k) {
    Spring1dOptions o = options;
    o.position_step_mm = 0.003 * std::pow(1000.0 / 3, k / (points - 1.0));  // up to 1 mm
    const Spring1d run = run_spring1d(o);
    fmt::format_to(std::back_inserter(csv), "{:.6g},{:.3f},{:.3f}\n", o.position_step_mm, run.figures[kIdeal].snr_paper_db,
                   2 * ideal_snr_db(run, o.position_step_mm, o.force_step_n));
  }
  write_text(file, csv);
}

Json schemes_json(const Spring1d& run, std::size_t count) {
  Json schemes;
  for (std::size_t s = 0; s < count; ++s) {
    const SpringFigures& f = run.figures[s];
    schemes[kSpringSchemeNames[s]] = {
        {"snr_db", f.snr_db}, {"snr_paper_db", f.snr_paper_db}, {"lag_ms", f.lag_ms}, {"snr_unshifted_db", f.snr_unshifted_db}};
    if (run.touches > 0)
      schemes[kSpringSchemeNames[s]].update({{"onset_ms_mean", f.onset_ms_mean},
                                             {"onset_ms_max", f.onset_ms_max},
                                             {"ghost_ms_max", f.ghost_ms_max},
                                             {"ghost_force_n", f.ghost_force_n},
                                             {"onset_error_n", f.onset_error_n},
                                             {"fast_kept", f.fast_kept}});
  }
  return schemes;
}

/// Curves in drawing order: coarse schemes first, as the last is drawn on top. `minus`: gnuplot expression that is subtracted.
std::vector<Curve> scheme_curves(std::size_t count, const std::string& minus) {
  struct DrawnCurve {
    SpringScheme scheme;
    int style;
    const char* with;
  };
  constexpr DrawnCurve kOrder[] = {{SpringScheme::filtered, 3, "lines"},
                                   {SpringScheme::hold, 2, "lines"},
                                   {SpringScheme::tangent, 1, "lines"},
                                   {SpringScheme::surface, 4, "lines dt 2"}};
  std::vector<Curve> curves;
  for (const DrawnCurve& d : kOrder) {
    const auto s = static_cast<std::size_t>(d.scheme);
    if (s < count) curves.push_back({fmt::format("1:(${}{})", 4 + s, minus), kSpringSchemeNames[s], d.style, {}, d.with});
  }
  return curves;
}

std::vector<Curve> force_curves(std::size_t count) {
  std::vector<Curve> curves = scheme_curves(count, "");
  curves.insert(curves.begin(), {"1:3", "the spring", 0});
  return curves;
}

std::vector<Curve> error_curves(std::size_t count) {
  std::vector<Curve> curves = scheme_curves(count, "-$3");
  curves.insert(curves.begin(), {"1:($4-$3)", "ideal (1 kHz)", 6});
  return curves;
}

std::vector<Figure> write_pictures(const std::filesystem::path& out, const Spring1dOptions& options) {
  const double shown_s = std::min(options.duration_s, 2 / std::max(options.frequency_hz, 0.1));
  plot_csv(out / "spring1d.csv", out / "spring1d.svg",
           fmt::format("A nonlinear spring, model at {:g} Hz, shown at 1 kHz", options.rate_hz), "time [s]",
           {{"force [N]", force_curves(kPaperSpringSchemes)}, {"error of the force [N]", error_curves(kPaperSpringSchemes)}},
           {.setup = fmt::format("set xrange [0:{:g}]", shown_s)});
  plot_csv(out / "contact.csv", out / "contact.svg",
           fmt::format("The same spring, touched and left, model at {:g} Hz", options.rate_hz), "time [s]",
           {{"position [mm], surface at 0", {{"1:2", "hand", 0}, {"1:(0)", "surface", 5, {}, "lines dt 2"}}},
            {"force [N]", force_curves(kSpringSchemeNames.size())},
            {"error of the force [N]", error_curves(kSpringSchemeNames.size())}},
           {.setup = fmt::format("set xrange [0:{:g}]", std::min(options.duration_s, 3.0))});
  plot_csv(out / "position_step.csv", out / "position_step.svg", "The ideal scheme over the resolution of the position",
           "position step [mm]",
           {{"SNR, 20 log10 [dB]",
             {{"1:3", "closed form, rounding errors uniform", 8}, {"1:2", "simulated", 1, {}, "points"}},
             false,
             "set arrow 1 from 0.03, graph 0 to 0.03, graph 1 nohead lc rgb '#009e73' dt 2\n"
             "set arrow 2 from 0.3, graph 0 to 0.3, graph 1 nohead lc rgb '#d55e00' dt 2\n"
             "set label 1 'the device, 0.03 mm' at 0.028, graph 0.12 right textcolor rgb '#009e73'\n"
             "set label 2 'printed, 0.3 mm' at 0.28, graph 0.12 right textcolor rgb '#d55e00'"}},
           {.log_x = true, .setup = "set format x '%g'"});
  return {{out / "spring1d.svg", "Fig. 2: the force that each scheme shows (above) and what it is off by (below)."},
          {out / "contact.svg",
           "A stroke in and out of contact: the held forces come late, stay after the tool has left, and a "
           "tangent taken in free air shows nothing until the next frame; with the surface known it does."},
          {out / "position_step.svg", "Which resolution of the position the paper's 89 dB needs."}};
}

void print_table(const std::string& title, const Spring1d& run, std::size_t count) {
  const bool contact = run.touches > 0;
  fmt::print("\n{}\n  {:<10} {:>9} {:>13} {:>15} {:>9}", title, "scheme", "SNR [dB]", "paper's [dB]", "unshifted [dB]",
             "lag [ms]");
  if (contact)
    fmt::print(" {:>16} {:>12} {:>10} {:>16} {:>10}", "onset late [ms]", "ghost [ms]", "ghost [N]", "onset error [N]",
               "fast part");
  fmt::print("\n");
  for (std::size_t s = 0; s < count; ++s) {
    const SpringFigures& f = run.figures[s];
    fmt::print("  {:<10} {:>9.1f} {:>13.1f} {:>15.1f} {:>9}", kSpringSchemeNames[s], f.snr_db, f.snr_paper_db, f.snr_unshifted_db,
               f.lag_ms);
    if (contact)
      fmt::print(" {:>9.0f} ({:>4.0f}) {:>12.0f} {:>10.2f} {:>16.2f} {:>8.0f} %", f.onset_ms_mean, f.onset_ms_max, f.ghost_ms_max,
                 f.ghost_force_n, f.onset_error_n, 100 * f.fast_kept);
    fmt::print("\n");
  }
}

/// Writes all files of the command.
std::vector<Figure> write_results(const std::filesystem::path& out, const Spring1dRuns& runs, const Spring1dOptions& options,
                                  bool quick) {
  write_curves(out / "spring1d.csv", runs.device);
  write_curves(out / "spring1d_printed_step.csv", runs.printed);
  write_curves(out / "contact.csv", runs.contact);
  write_position_steps(out / "position_step.csv", options, quick ? 8 : 24);
  write_json(
      out / "summary.json",
      {{"position_step_mm", options.position_step_mm},
       {"force_step_n", options.force_step_n},
       {"schemes", schemes_json(runs.device, kPaperSpringSchemes)},
       {"printed_step", {{"position_step_mm", kPrintedStepMm}, {"schemes", schemes_json(runs.printed, kPaperSpringSchemes)}}},
       {"contact", {{"touches", runs.contact.touches}, {"schemes", schemes_json(runs.contact, kSpringSchemeNames.size())}}}});
  return write_pictures(out, options);
}

std::vector<Finding> table_findings(const Spring1dRuns& runs) {
  std::vector<Finding> findings;
  for (std::size_t s = 0; s < kPaperSpringSchemes; ++s) {
    const SpringFigures& f = runs.device.figures[s];
    const bool agrees = std::abs(f.snr_paper_db - kPaperSnrDb[s]) <= 3;
    findings.push_back({fmt::format("SNR of `{}` [dB]", kSpringSchemeNames[s]), fmt::format("{:g}", kPaperSnrDb[s]),
                        fmt::format("{:.1f}", f.snr_paper_db), agrees ? Verdict::agrees : Verdict::differs,
                        fmt::format("{:.1f} dB by the usual definition (10 log10)", f.snr_db)});
  }
  for (std::size_t s = 0; s < kPaperSpringSchemes; ++s) {
    const int lag = runs.device.figures[s].lag_ms;
    const bool below = kPaperLagMs[s] == 1, agrees = below ? std::abs(lag) < 1 : std::abs(lag - kPaperLagMs[s]) <= 2;
    findings.push_back({fmt::format("Lag of `{}` [ms]", kSpringSchemeNames[s]), below ? "< 1" : fmt::format("{}", kPaperLagMs[s]),
                        fmt::format("{}", lag), agrees ? Verdict::agrees : Verdict::differs, ""});
  }
  const SpringFigures& printed = runs.printed.figures[kIdeal];
  findings.push_back(
      {"SNR of `ideal` with the printed position step of 0.3 mm [dB]", "89", fmt::format("{:.1f}", printed.snr_paper_db),
       std::abs(printed.snr_paper_db - kPaperSnrDb[kIdeal]) <= 3 ? Verdict::agrees : Verdict::differs,
       fmt::format(
           "rounding to 0.3 mm alone leaves {:.1f} dB (closed form, any phase); the device resolves 0.03 mm, with which all four "
           "numbers come out: a slip in print",
           2 * ideal_snr_db(runs.printed, kPrintedStepMm, 0.07))});
  return findings;
}

std::vector<Finding> contact_findings(const Spring1d& contact) {
  const auto figure = [&](std::size_t s) { return contact.figures[s]; };
  std::vector<Finding> findings;
  bool worst = true;
  for (std::size_t s = 0; s < kSpringSchemeNames.size(); ++s)
    worst = worst && figure(kFiltered).onset_ms_mean >= figure(s).onset_ms_mean &&
            figure(kFiltered).snr_unshifted_db <= figure(s).snr_unshifted_db;
  std::string all, fast;
  for (std::size_t s = 0; s < kSpringSchemeNames.size(); ++s) {
    all += fmt::format("{}{} {:.0f} ({:.0f})", s > 0 ? ", " : "", kSpringSchemeNames[s], figure(s).onset_ms_mean,
                       figure(s).onset_ms_max);
    fast += fmt::format("{}{} {:.0f}", s > 0 ? ", " : "", kSpringSchemeNames[s], 100 * figure(s).fast_kept);
  }
  findings.push_back({"Contact on and off: which scheme is worst", "low-pass filtering",
                      fmt::format("filtered, {:.1f} dB unshifted", figure(kFiltered).snr_unshifted_db),
                      worst ? Verdict::agrees : Verdict::differs,
                      worst ? "latest onset and largest error as felt" : "another scheme is later or further off"});
  findings.push_back(
      {"Onset of contact shown late by, mean (most) [ms]", "", all, Verdict::beyond,
       "the tangent of a spring that is not yet touched is zero: onset waits for the next frame, as with a held force"});
  findings.push_back({"Share of the fast part of the force that is shown [%]", "low-pass loses it", fast,
                      figure(kFiltered).fast_kept <= figure(1).fast_kept ? Verdict::agrees : Verdict::differs,
                      "what is faster than half the frame rate, lag taken out; above 1 would be too much of it"});
  findings.push_back({"`tangent` to `surface` in contact, SNR [dB]", "",
                      fmt::format("{:.1f} to {:.1f}", figure(kTangent).snr_db, figure(kSurface).snr_db), Verdict::beyond,
                      "the local model has to know where the surface is: what Palpate's anticipating patches send"});
  return findings;
}

struct Spring1dFlags {
  Spring1dOptions options;
  double contact_hz = 0.95;
  std::string out;
};

void check(const Spring1dOptions& o) {
  constexpr double kDeepestMm = 34.5;  // 90 % of the pole of eq. 5
  if (o.middle_mm + o.amplitude_mm > kDeepestMm)
    throw InputError(fmt::format("--middle-mm {:g} --amplitude-mm {:g}", o.middle_mm, o.amplitude_mm),
                     "goes where the spring of eq. 5 has its pole", fmt::format("a sum of at most {:g} mm", kDeepestMm));
  if (o.middle_mm + o.amplitude_mm <= 0)
    throw InputError("--middle-mm", "keeps the hand out of contact", "a stroke that reaches above 0 mm");
  if (o.amplitude_mm * o.frequency_hz == 0)
    throw InputError("--amplitude-mm, --frequency-hz", "are zero: nothing moves", "numbers above 0");
}

int run_command(const Spring1dFlags& flags) {
  check(flags.options);
  const auto out = make_output_folder(flags.out);
  const Spring1dRuns runs = run_all(flags.options, flags.contact_hz);
  print_table(
      fmt::format(
          "In contact, position step {:g} mm, force step {:g} N (the paper: 89 / 43 / 53 / 72 dB, lag <1 / 49 / 65 / <1 ms)",
          flags.options.position_step_mm, flags.options.force_step_n)
          .c_str(),
      runs.device, kPaperSpringSchemes);
  print_table(fmt::format("In contact, position step {:g} mm as printed", kPrintedStepMm), runs.printed, kPaperSpringSchemes);
  print_table(fmt::format("Contact on and off, {} touches", runs.contact.touches), runs.contact, kSpringSchemeNames.size());
  write_results(out, runs, flags.options, false);
  fmt::print(
      "\n  SNR: 10 log10 of signal over error power, lag taken out; the paper's is 20 log10 of the same. unshifted: as felt.\n"
      "  onset late: mean (most) until 0.1 N is shown. ghost: force shown without contact. onset error: rms, first 100 ms.\n"
      "  fast part: how much is shown of what is faster than half the frame rate.\n\n{}\n",
      (out / "summary.json").string());
  return 0;
}

}  // namespace

PaperSection paper_spring1d(const std::filesystem::path& folder, bool quick) {
  const auto out = make_output_folder(folder.string());
  const Spring1dOptions options;
  const Spring1dRuns runs = run_all(options, tapping(options).frequency_hz);
  PaperSection section{
      "Section 2, equations 1 to 5, figure 2: a nonlinear spring", "palpate-lab spring1d --out DIR",
      "A hand moves sinusoidally on the spring of eq. 5 while its model runs at 10 Hz; four schemes show a force "
      "at 1 kHz in between. The same for a stroke that touches the spring and leaves it, where the paper argues "
      "without numbers. The paper's SNR is 20 log10 of a ratio of powers, after the lag is taken out.",
      table_findings(runs), write_results(out, runs, options, quick)};
  for (Finding& finding : contact_findings(runs.contact)) section.findings.push_back(std::move(finding));
  return section;
}

void add_spring1d(CLI::App& app, Run& run) {
  auto flags = std::make_shared<Spring1dFlags>();
  Spring1dOptions& o = flags->options;
  CLI::App* c =
      app.add_subcommand("spring1d", "section 2 of the paper: four schemes on one nonlinear spring, in contact and in and out");
  c->add_option("--rate-hz", o.rate_hz, "frames of the model a second")
      ->check(number_from<double>(1, 1000))
      ->capture_default_str();
  c->add_option("--low-pass-hz", o.low_pass_hz, "cut-off of `filtered`")
      ->check(number_from<double>(0.1, 500))
      ->capture_default_str();
  c->add_option("--middle-mm", o.middle_mm, "where the stroke is centred, surface at 0")
      ->check(number_from<double>(-30, 34))
      ->capture_default_str();
  c->add_option("--amplitude-mm", o.amplitude_mm, "of the stroke")->check(number_from<double>(0, 60))->capture_default_str();
  c->add_option("--frequency-hz", o.frequency_hz, "of the stroke")->check(number_from<double>(0, 50))->capture_default_str();
  c->add_option("--phase-rad", o.phase_rad, "of the stroke")->check(number_from<double>(-10, 10))->capture_default_str();
  c->add_option("--contact-frequency-hz", flags->contact_hz, "of the stroke in and out of contact")
      ->check(number_from<double>(0.1, 50))
      ->capture_default_str();
  c->add_option("--duration-s", o.duration_s, "of each stroke")->check(number_from<double>(3, 120))->capture_default_str();
  c->add_option("--position-step-mm", o.position_step_mm, "resolution of the position; the paper prints 0.3")
      ->check(number_from<double>(0, 5))
      ->capture_default_str();
  c->add_option("--force-step-n", o.force_step_n, "resolution of the force")
      ->check(number_from<double>(0, 5))
      ->capture_default_str();
  c->add_option("--out", flags->out, "folder for summary.json, CSV files and plots")->type_name("DIR")->required();
  c->callback([flags, &run] { run = [flags] { return run_command(*flags); }; });
}

}  // namespace palpate
