#include "client/app/report.hpp"

#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "common/base/counted.hpp"
#include "common/base/error.hpp"
#include "common/io/provenance.hpp"

namespace palpate {

namespace {

using Json = nlohmann::ordered_json;

/// Writes the file completely or not at all.
void write(const std::filesystem::path& file, const std::string& text) {
  std::filesystem::path part = file;
  part += ".part";
  std::ofstream out(part, std::ios::binary);
  out << text;
  out.close();
  std::error_code fault;
  if (out) std::filesystem::rename(part, file, fault);
  if (!out || fault) throw InputError(file.string(), "cannot be written", "room on the disk and the right to write");
}

Json list(const Vec3& v) { return Json::array({v.x(), v.y(), v.z()}); }

double milliseconds(Micros t) { return static_cast<double>(t.count()) * 1e-3; }

std::string times(std::uint64_t n) { return n == 1 ? "once" : fmt::format("{} times", n); }

double loss_percent(const SeqCounts& counts) {
  const auto sent = counts.received + counts.lost;
  return sent == 0 ? 0.0 : 100.0 * static_cast<double>(counts.lost) / static_cast<double>(sent);
}

Json link_json(const ClientCore& core) {
  const RttStats& rtt = core.clock().rtt();
  const ClientCounts& counts = core.counts();
  std::uint64_t dropped = 0;
  for (const auto count : counts.dropped) dropped += count;
  return {{"rtt_ms", milliseconds(rtt.mean)},
          {"rtt_min_ms", milliseconds(rtt.min)},
          {"jitter_ms", milliseconds(rtt.jitter)},
          {"loss_pct", loss_percent(core.loss())},
          {"joins", counts.joins},
          {"datagrams_sent", counts.sent},
          {"datagrams_received", counts.received},
          {"bytes_sent", counts.bytes_sent},
          {"bytes_received", counts.bytes_received},
          {"datagrams_dropped", dropped},
          {"datagrams_unproven", counts.unproven},
          {"patches_received", counts.patches},
          {"patches_refused", core.patches_refused()},
          {"patches_accepted", core.intake_counts().accepted},
          {"patches_jumped", core.intake_counts().jumped},
          {"patches_with_terms", core.intake_counts().with_terms},
          {"patches_held_back", core.intake_counts().held_back},
          {"patch_bytes_mean", core.patch_bytes_mean()},
          {"patch_states", core.last_patch().states()},
          {"server_rate_hz", core.server_pace().rate_hz},
          {"server_rate_min_hz", core.server_pace().rate_min_hz},
          {"server_behind_ms_max", milliseconds(core.server_pace().behind_max)}};
}

/// Returns the shares of the patches by the name of their scheme, without zeros.
std::vector<std::pair<std::string_view, double>> scheme_shares(const ClientCore& core) {
  std::vector<std::pair<std::string_view, double>> shares;
  const auto& patches = core.schemes_felt().patches;
  for (std::size_t k = 0; k < patches.size(); ++k)
    if (patches[k] > 0)
      shares.emplace_back(kSchemeNames[k], static_cast<double>(patches[k]) / static_cast<double>(core.counts().patches_accepted));
  return shares;
}

/// Adds the requested scheme and those felt.
void add_schemes(const DisplayReport& felt, Json& json) {
  json["scheme_asked"] = name_of(felt.asked);
  json["scheme_reason"] = describe(felt.core->in_use());
  json["scheme_changes"] = felt.core->schemes_felt().changes;
  json["scheme_shares"] = Json::object();
  for (const auto& [name, share] : scheme_shares(*felt.core)) json["scheme_shares"][std::string(name)] = share;
}

/// Returns one line.
std::string schemes_line(const ClientCore& core) {
  std::string text;
  for (const auto& [name, share] : scheme_shares(core))
    text += fmt::format("{}{} in {:.0f} % of the patches", text.empty() ? "" : ", ", name, 100 * share);
  const auto changes = core.schemes_felt().changes;
  return text.empty() ? "none felt"
                      : fmt::format("{}; {}; at the end {}", text, counted(changes, "change"), describe(core.in_use()));
}

Json run_json(const RunReport& run) {
  Json json{{"program", "palpate-client"}, {"version", PALPATE_VERSION}, {"scheme", run.displays.front().scheme}};
  add_schemes(run.displays.front(), json);
  json["order"] = run.options.order;
  json["rate_hz"] = run.displays.front().core->welcome().rate_hz;
  const Welcome& welcome = run.displays.front().core->welcome();
  json["scene"] = {{"name", welcome.scene},
                   {"mesh", fmt::format("{:016x}", welcome.mesh_hash)},
                   {"hash", fmt::format("{:016x}", welcome.scene_hash)}};
  if (!run.options.motion_file.empty())
    json["motion"] = {{"file", run.options.motion_file.string()}, {"hash", file_hash(run.options.motion_file)}};
  json["device"] = run.options.device_name;
  if (const auto& workspace = run.options.workspace)
    json["workspace"] = {{"scale", workspace->scale},
                         {"force_scale", workspace->force_scale},
                         {"rotation_deg", list(workspace->rotation_deg)},
                         {"offset_m", list(workspace->offset_m)},
                         {"tool_weight_n", list(workspace->tool_weight_n)}};
  json["server"] = run.options.server;
  json["station"] = run.options.station;
  if (!run.options.tool.empty()) json["tool"] = run.options.tool;
  json["seed"] = run.options.seed;
  const MachineName machine = this_machine();
  json["machine"] = {{"processor", machine.processor}, {"cores", machine.cores}, {"system", machine.system}};
  return json;
}

Json display_json(const DisplayReport& display) {
  const GuardCounts& guard = display.guard;
  return {{"patches_used", display.haptic.patches_used},
          {"faded_ticks", display.haptic.faded_ticks},
          {"softened_patches", display.haptic.softened},
          {"samples_dropped", display.haptic.samples_dropped},
          {"hand_over_step_max_n", display.haptic.hand_over_step_max_n},
          {"guard",
           {{"not_finite", guard.not_finite},
            {"clamped", guard.clamped},
            {"slew_limited", guard.slew_limited},
            {"heat_limited", guard.heat_limited},
            {"too_fast", guard.too_fast},
            {"restarts", guard.restarts},
            {"damped", guard.damped},
            {"energy_min_j", guard.energy_min_j},
            {"dissipated_j", guard.dissipated_j},
            {"damper_max_n", guard.damper_max_n},
            {"damper_rms_n", guard.damper_rms_n()},
            {"damper_max_nm", guard.damper_max_nm},
            {"torques_left_out", guard.torques_left_out}}}};
}

/// Forces of guidance on this hand.
Json guidance_json(const RunReport& run) {
  const HapticCounts& haptic = run.displays.front().haptic;
  return {{"partner", run.guidance_partner},
          {"guides", !run.options.guides.empty()},
          {"holds", haptic.holds},
          {"held_s", static_cast<double>(haptic.guided_ticks) / kHapticRateHz},
          {"force_mean_n", haptic.guidance_mean_n()},
          {"force_max_n", haptic.guidance_max_n}};
}

Json loop_json(HapticLoop& loop, const TickLog* ticks, const RealtimeStatus& realtime) {
  const HapticLoopStats& stats = loop.stats();
  return {{"realtime", realtime.granted()},
          {"ticks", stats.ticks},
          {"late_ticks", stats.late},
          {"very_late_ticks", stats.very_late},
          {"skipped_ticks", stats.skipped},
          {"lateness_us_p50", stats.late_us.percentile(0.5)},
          {"lateness_us_p99", stats.late_us.percentile(0.99)},
          {"lateness_us_p999", stats.late_us.percentile(0.999)},
          {"lateness_us_max", stats.late_us.max()},
          {"tick_ns_p50", stats.tick_ns.percentile(0.5)},
          {"tick_ns_p99", stats.tick_ns.percentile(0.99)},
          {"work_ns_p50", stats.work_ns.percentile(0.5)},
          {"work_ns_p99", stats.work_ns.percentile(0.99)},
          {"force_max_n", stats.force_max_n},
          {"torque_max_nm", stats.torque_max_nm},
          {"grip_max_nm", stats.grip_max_nm},
          {"device_away_ticks", stats.away},
          {"device_not_believed_ticks", stats.not_believed},
          {"watchdog_halts", stats.halts},
          {"recorded_ticks", ticks ? ticks->size() : 0},
          {"unrecorded_ticks", (ticks ? ticks->missed() : 0) + loop.recorder().missed()}};
}

}  // namespace

void write_forces(const std::filesystem::path& file, const RunReport& run) {
  const std::size_t rows = run.ticks ? run.ticks->size() : 0;
  bool turned = false, opened = false;
  for (std::size_t row = 0; row < rows; ++row) {
    turned |= !run.ticks->tick(row).model.torque.isZero(0);
    opened |= run.ticks->tick(row).opening != 0;
  }
  opened &= turned;
  std::string text = "t_s,x_m,y_m,z_m,fx_n,fy_n,fz_n,patch_age_ms,contact";
  const auto out = std::back_inserter(text);
  for (std::size_t i = 1; i < run.displays.size(); ++i)
    fmt::format_to(out, ",{0}_fx_n,{0}_fy_n,{0}_fz_n,{0}_contact", run.displays[i].scheme);
  if (turned) text += ",qx,qy,qz,qw";
  for (std::size_t i = 0; i < run.displays.size() && turned; ++i)
    fmt::format_to(out, ",{0}tx_nm,{0}ty_nm,{0}tz_nm", i == 0 ? std::string() : run.displays[i].scheme + "_");
  if (opened) text += ",opening,grip_nm";
  text += '\n';
  for (std::size_t row = 0; row < rows; ++row) {
    const TickRecord& tick = run.ticks->tick(row);
    const auto displays = run.ticks->row(row);
    const Vec3 &p = tick.position, &f = displays[0].wrench.force;
    fmt::format_to(out, "{:.6f},{:.9f},{:.9f},{:.9f},{:.9g},{:.9g},{:.9g},{:.3f},{:d}", seconds(tick.t), p.x(), p.y(), p.z(),
                   f.x(), f.y(), f.z(), tick.has_patch ? milliseconds(tick.patch_age) : -1.0, displays[0].contact);
    for (const DisplayRecord& display : displays.subspan(1))
      fmt::format_to(out, ",{:.9g},{:.9g},{:.9g},{:d}", display.wrench.force.x(), display.wrench.force.y(),
                     display.wrench.force.z(), display.contact);
    if (turned) {
      const Rotation q = tick.orientation.value_or(Rotation::Identity());
      fmt::format_to(out, ",{:.6f},{:.6f},{:.6f},{:.6f}", q.x(), q.y(), q.z(), q.w());
    }
    for (std::size_t i = 0; i < displays.size() && turned; ++i) {
      const Vec3& t = displays[i].wrench.torque;
      fmt::format_to(out, ",{:.9g},{:.9g},{:.9g}", t.x(), t.y(), t.z());
    }
    if (opened) fmt::format_to(out, ",{:.6f},{:.9g}", tick.opening, tick.grip);
    text += '\n';
  }
  write(file, text);
}

void write_summary(const std::filesystem::path& file, const RunReport& run) {
  Json summary;
  if (run.loop) summary.update(loop_json(*run.loop, run.ticks, run.realtime));
  summary.update(link_json(*run.displays.front().core));
  summary.update(display_json(run.displays.front()));
  if (!run.options.guides.empty() || run.displays.front().haptic.holds > 0) summary["guidance"] = guidance_json(run);
  for (std::size_t i = 1; i < run.displays.size(); ++i) {
    Json& compared = summary["compared"][run.displays[i].scheme];
    compared = display_json(run.displays[i]);
    compared["patches_received"] = run.displays[i].core->counts().patches;
    compared["patch_bytes_mean"] = run.displays[i].core->patch_bytes_mean();
    compared["patch_states"] = run.displays[i].core->last_patch().states();
  }
  summary["run"] = run_json(run);
  write(file, summary.dump(2) + '\n');
}

void write_joint_summary(const std::vector<AppOptions>& hands) {
  Json all = Json::object();
  for (const AppOptions& hand : hands) {
    std::ifstream in(hand.report / "summary.json");
    const Json summary = Json::parse(in, nullptr, false);
    all[hand.station] = summary.is_discarded() ? Json() : summary;
  }
  write(hands.front().report.parent_path() / "summary.json", Json{{"hands", all}}.dump(2) + "\n");
}

std::string describe(const RunReport& run) {
  const DisplayReport& felt = run.displays.front();
  const ClientCore& core = *felt.core;
  const RttStats& rtt = core.clock().rtt();
  std::string text;
  const auto out = std::back_inserter(text);
  if (run.loop) {
    const HapticLoopStats& stats = run.loop->stats();
    fmt::format_to(out, "loop      {}, {} late by more than 0.2 ms, {} skipped; woken {} us late (median), {} us (99 %)\n",
                   counted(stats.ticks, "tick"), stats.late, stats.skipped, stats.late_us.percentile(0.5),
                   stats.late_us.percentile(0.99));
    fmt::format_to(out, "tick      {} ns (median), {} ns (99 %); largest force {:.3f} N\n", stats.tick_ns.percentile(0.5),
                   stats.tick_ns.percentile(0.99), stats.force_max_n);
    if (stats.torque_max_nm > 0) fmt::format_to(out, "torque    largest {:.4f} N m\n", stats.torque_max_nm);
    if (stats.grip_max_nm > 0)
      fmt::format_to(out, "grip      largest {:.4f} N m of the jaws' opening, not rendered\n", stats.grip_max_nm);
    if (felt.guard.torques_left_out > 0)
      fmt::format_to(out, "torque    left out for {:.1f} s, as {} renders none\n",
                     static_cast<double>(felt.guard.torques_left_out) / kHapticRateHz, run.options.device_name);
    if (stats.away + stats.not_believed + stats.halts > 0)
      fmt::format_to(out, "device    {} ms away, {} ms not believed; force taken away {} by the watchdog\n", stats.away,
                     stats.not_believed, times(stats.halts));
  }
  fmt::format_to(out,
                 "link      round trip {:.1f} ms, jitter {:.1f} ms (change from one to the next), {:.1f} % lost, joined {}\n",
                 milliseconds(rtt.mean), milliseconds(rtt.jitter), loss_percent(core.loss()), times(core.counts().joins));
  if (core.server_pace().rate_min_hz > 0 && core.server_pace().rate_min_hz < 0.95 * core.welcome().rate_hz)
    fmt::format_to(out, "server    had time for only {:.1f} of {:g} frames a second at its slowest, up to {:.0f} ms behind\n",
                   core.server_pace().rate_min_hz, core.welcome().rate_hz, milliseconds(core.server_pace().behind_max));
  if (!felt.asked) fmt::format_to(out, "scheme    {}\n", schemes_line(core));
  fmt::format_to(out, "patches   {} used of {} received, {:.0f} bytes each; largest hand-over step {:.4f} N\n",
                 felt.haptic.patches_used, core.counts().patches_accepted, core.patch_bytes_mean(),
                 felt.haptic.hand_over_step_max_n);
  fmt::format_to(
      out, "guard     {} not finite, {} clamped, {} slew-limited, {} warm, {} too fast, begun again {}; least energy {:.2f} mJ\n",
      felt.guard.not_finite, felt.guard.clamped, felt.guard.slew_limited, felt.guard.heat_limited, felt.guard.too_fast,
      times(felt.guard.restarts), felt.guard.energy_min_j * 1e3);
  if (felt.haptic.holds > 0)
    fmt::format_to(out, "guidance  {} {} for {:.1f} s; mean force {:.2f} N, largest {:.2f} N on this hand\n",
                   run.options.guides.empty() ? "by" : "of", run.guidance_partner,
                   static_cast<double>(felt.haptic.guided_ticks) / kHapticRateHz, felt.haptic.guidance_mean_n(),
                   felt.haptic.guidance_max_n);
  if (felt.haptic.softened > 0)
    fmt::format_to(
        out, "stiffness {} patches were stiffer than the device can render, and shown with {:.2f} of their force at the least\n",
        felt.haptic.softened, felt.haptic.softened_most);
  if (const std::uint64_t refused = core.patches_refused(); refused > 0)
    fmt::format_to(out, "refused   {} patches of the server whose numbers are out of their ranges\n", refused);
  if (core.counts().unproven + core.intake_counts().jumped > 0)
    fmt::format_to(out, "refused   {} datagrams in the server's name without an echo of ours, {} patches that jumped ahead\n",
                   core.counts().unproven, core.intake_counts().jumped);
  fmt::format_to(out, "passivity {} ticks damped, by {:.3f} N (rms), {:.3f} N (largest): {:.2f} mJ taken out", felt.guard.damped,
                 felt.guard.damper_rms_n(), felt.guard.damper_max_n, felt.guard.dissipated_j * 1e3);
  return text;
}

}  // namespace palpate
