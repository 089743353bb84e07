// palpate-lab replay: any motion through any scheme over any link.
#include "bench/measure/replay.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <map>

#include "bench/lab/experiments.hpp"
#include "bench/lab/output.hpp"
#include "bench/lab/plot.hpp"
#include "bench/measure/reference.hpp"
#include "bench/measure/routes.hpp"
#include "common/base/error.hpp"

namespace palpate {
namespace {

struct Flags {
  std::string scene, motion, scheme, device = "none", route, out;
  PassivityMode passivity = PassivityMode::off;
  int order = 0;
  double rate_hz = 20, rtt_ms = 0, jitter_ms = 0, loss_pct = 0, burst = 0, compute_ms = 0;
  std::uint64_t seed = 1;
};

/// The command line takes "-1" for 2^64 - 1.
std::string refuse_sign(const std::string& number) {
  return number.starts_with('-') ? "is negative; expected a number from 0 on" : "";
}

/// "nan" is a number to the command line, and lies in every range.
void refuse_nan(const Flags& f) {
  for (const auto& [flag, value] : {std::pair{"--rate-hz", f.rate_hz},
                                    {"--rtt-ms", f.rtt_ms},
                                    {"--jitter-ms", f.jitter_ms},
                                    {"--loss-pct", f.loss_pct},
                                    {"--burst", f.burst},
                                    {"--compute-ms", f.compute_ms}})
    if (std::isnan(value)) throw InputError(flag, "is nan", "a number");
}

ReplayOptions options_of(const Flags& flags) {
  refuse_nan(flags);
  ReplayOptions o;
  const auto scheme = scheme_from_name(flags.scheme);
  if (!scheme || !is_available(*scheme)) {
    std::string names;
    for (std::size_t k = 0; k < kSchemeNames.size(); ++k)
      if (is_available(static_cast<Scheme>(k))) names += fmt::format("{}{}", names.empty() ? "" : ", ", kSchemeNames[k]);
    throw InputError("--scheme " + flags.scheme, scheme ? "is not in this build" : "is no scheme", "one of " + names);
  }
  o.scheme = *scheme;
  o.order = flags.order;
  o.rate_hz = flags.rate_hz;
  const double rtt_ms = flags.route.empty() ? flags.rtt_ms : route_from_name(flags.route).rtt_ms;
  o.link = {.latency = from_seconds(rtt_ms * 0.5e-3),
            .jitter = from_seconds(flags.jitter_ms * 1e-3),
            .loss = flags.loss_pct / 100,
            .burst_mean = flags.burst,
            .seed = flags.seed};
  validate(o.link, "link");
  o.seed = flags.seed;
  o.compute = from_seconds(flags.compute_ms * 1e-3);
  o.simulated_device = flags.device == "sim";
  o.passivity = flags.passivity;
  return o;
}

void write_forces(const std::filesystem::path& file, const ReplayResult& result) {
  std::string csv = "t_s,fx_n,fy_n,fz_n,fx_ref_n,fy_ref_n,fz_ref_n,patch_age_ms,contact\n";
  for (std::size_t i = 0; i < result.ticks.size(); ++i) {
    const ReplayTick& t = result.ticks[i];
    fmt::format_to(std::back_inserter(csv), "{:.3f},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.3f},{}\n",
                   static_cast<double>(i) * 1e-3, t.felt.x(), t.felt.y(), t.felt.z(), t.reference.x(), t.reference.y(),
                   t.reference.z(), seconds(t.patch_age) * 1e3, t.contact ? 1 : 0);
  }
  write_text(file, csv);
}

Json summary(const ReplayResult& r) {
  return {{"snr_db", r.fidelity.snr_db},
          {"rel_rms", r.fidelity.rel_rms},
          {"p95_rel_error", r.fidelity.p95_rel_error},
          {"lag_ms", r.fidelity.lag_ms},
          {"force_step_max_n", r.fidelity.force_step_max_n},
          {"patches_used", r.patches_used},
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
          {"energy_min_j", r.guard.energy_min_j},
          {"damped_ticks", r.guard.damped},
          {"dissipated_j", r.guard.dissipated_j},
          {"damper_max_n", r.guard.damper_max_n},
          {"damper_rms_n", r.guard.damper_rms_n()}};
}

int run_replay(const Flags& flags) {
  const ReplayOptions options = options_of(flags);
  const Scene scene = load_scene(flags.scene);
  const Motion motion = read_motion(flags.motion);
  const auto out = make_output_folder(flags.out);
  if (scene.tool.contact == ContactKind::attach && needs_settling(scene, motion.position(0.0)))
    fmt::print(
        stderr,
        "the body is given {:g} s to settle before the motion: it hangs in gravity, or the motion starts beside the node\n",
        seconds(kSettle));
  const ReplayResult result = replay(scene, motion, options, stopwatch_ns);
  const double rtt_ms = 2e3 * seconds(options.link.latency);
  write_forces(out / "forces.csv", result);
  write_json(out / "summary.json", summary(result));
  plot_csv(out / "forces.csv", out / "forces.svg",
           fmt::format("{}, {} at {:g} Hz, RTT {:g} ms: {:.1f} dB", scene.name, flags.scheme, flags.rate_hz, rtt_ms,
                       result.fidelity.snr_db),
           "time [s]",
           {{"force x [N]", {{"1:5", "1 kHz full model", 0}, {"1:2", flags.scheme, 1}}},
            {"force y [N]", {{"1:6", "1 kHz full model", 0}, {"1:3", flags.scheme, 1}}},
            {"force z [N]", {{"1:7", "1 kHz full model", 0}, {"1:4", flags.scheme, 1}}}});
  fmt::print("{} over {:g} ms RTT: {:.1f} dB, p95 error {:.1f} %, lag {} ms, {} patches of {:.0f} B with {} states\n{}\n",
             flags.scheme, rtt_ms, result.fidelity.snr_db, 100 * result.fidelity.p95_rel_error, result.fidelity.lag_ms,
             result.patches_used, result.patch_bytes_mean, result.patch_states, (out / "summary.json").string());
  return 0;
}

}  // namespace

void add_replay(CLI::App& app, Run& run) {
  auto flags = std::make_shared<Flags>();
  CLI::App* c =
      app.add_subcommand("replay", "any motion through any scheme over any link, in virtual time, beside the 1 kHz full model");
  c->add_option("--scene", flags->scene, "scene file (JSON)")->required();
  c->add_option("--motion", flags->motion, "motion file (CSV t_s,x_m,y_m,z_m)")->required();
  c->add_option("--scheme", flags->scheme, "how patches are made")->required();
  c->add_option("--order", flags->order, "states of a patch (twice its modes), 0: the scheme's default")
      ->check(CLI::Range(0, 2 * kMaxModes));
  c->add_option("--rate-hz", flags->rate_hz, "frames of the server a second")->check(CLI::Range(kMinRateHz, kMaxRateHz));
  auto* rtt = c->add_option("--rtt-ms", flags->rtt_ms, "round trip; each way takes half")->check(CLI::Range(0.0, 10'000.0));
  c->add_option("--route", flags->route, "round trip of a measured route: san-francisco, bangalore, buenos-aires, shanghai")
      ->excludes(rtt);
  c->add_option("--jitter-ms", flags->jitter_ms, "each way's latency varies by up to this, either side")
      ->check(CLI::Range(0.0, 1'000.0));
  c->add_option("--loss-pct", flags->loss_pct, "datagrams lost, each way")->check(CLI::Range(0.0, 100.0));
  c->add_option("--burst", flags->burst, "mean run of lost datagrams, 0: independent losses")->check(CLI::Range(0.0, 1'000.0));
  c->add_option("--seed", flags->seed, "of everything that is drawn")->check(refuse_sign, "");
  c->add_option("--compute-ms", flags->compute_ms, "the server's time from frame to patch")->check(CLI::Range(0.0, 10'000.0));
  c->add_option("--device", flags->device, "none: the motion as given; sim: a Phantom in a hand that follows it")
      ->check(CLI::IsMember({"none", "sim"}));
  c->add_option("--passivity", flags->passivity, "passivity limiter of the guard; observe: energies alone")
      ->transform(CLI::CheckedTransformer(std::map<std::string, PassivityMode>{
          {"off", PassivityMode::off}, {"observe", PassivityMode::observe}, {"on", PassivityMode::on}}));
  c->add_option("--out", flags->out, "folder for forces.csv, summary.json, forces.svg")->required();
  c->callback([flags, &run] { run = [flags] { return run_replay(*flags); }; });
}

}  // namespace palpate
