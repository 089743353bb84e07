#include "server/metrics/metrics.hpp"

#include <array>
#include <limits>
#include <utility>

namespace palpate {
namespace {

using prometheus::ClientMetric;
using prometheus::MetricFamily;
using prometheus::MetricType;
using Labels = std::vector<ClientMetric::Label>;

constexpr std::array<const char*, kWireFaults> kFaultLabels{"none",      "too_short",    "too_long",   "not_palpate",  "version",
                                                            "malformed", "out_of_range", "not_finite", "patch_refused"};
constexpr std::array<const char*, kRefuseReasons> kRefusalLabels{"version",    "name_taken",      "room_full",    "bad_request",
                                                                 "node_taken", "unknown_station", "shutting_down"};
constexpr std::array<const char*, kChannelFaults> kChannelLabels{
    "malformed",  "mac",   "limit", "handshake", "unknown_key", "token", "token_expired",
    "token_used", "stale", "full",  "index",     "replayed",    "forged"};

/// Metric families in the order in which they are first named; each has the metrics of all rooms.
class Families {
 public:
  void count(const std::string& name, const std::string& help, Labels labels, double value) {
    ClientMetric metric;
    metric.label = std::move(labels);
    metric.counter.value = value;
    family(name, help, MetricType::Counter).metric.push_back(std::move(metric));
  }
  void gauge(const std::string& name, const std::string& help, Labels labels, double value) {
    ClientMetric metric;
    metric.label = std::move(labels);
    metric.gauge.value = value;
    family(name, help, MetricType::Gauge).metric.push_back(std::move(metric));
  }
  void histogram(const std::string& name, const std::string& help, Labels labels, const BinCounts& bins) {
    ClientMetric metric;
    metric.label = std::move(labels);
    std::uint64_t cumulative = 0;
    for (std::size_t k = 0; k < bins.bins().size(); ++k) {
      cumulative += bins.bins()[k];
      const bool last = k == bins.edges().size();
      metric.histogram.bucket.push_back({cumulative, last ? std::numeric_limits<double>::infinity() : bins.edges()[k]});
    }
    metric.histogram.sample_count = cumulative;
    metric.histogram.sample_sum = bins.sum();
    family(name, help, MetricType::Histogram).metric.push_back(std::move(metric));
  }
  std::vector<MetricFamily> take() { return std::move(families_); }

 private:
  MetricFamily& family(const std::string& name, const std::string& help, MetricType type) {
    for (MetricFamily& known : families_)
      if (known.name == name) return known;
    families_.push_back({name, help, type, {}});
    return families_.back();
  }

  std::vector<MetricFamily> families_;
};

double number(std::uint64_t count) { return static_cast<double>(count); }

void add_frames(Families& to, const RoomState& room, const Labels& of) {
  const ServerCounts& c = room.counts;
  const auto with = [&](const char* reason) {
    Labels labels = of;
    labels.push_back({"reason", reason});
    return labels;
  };
  to.histogram("palpate_frame_seconds", "Computing time of frames, patches included.", of, c.frame_seconds);
  to.histogram("palpate_patch_build_seconds", "Computing time of a frame's patches, of all its stations together.", of,
               c.patches_seconds);
  to.count("palpate_frames_skipped_total", "Frames left out: one before was still being computed, or no sample was new.",
           with("busy"), number(c.frames_busy));
  to.count("palpate_frames_skipped_total", "", with("no_samples"), number(c.frames_waiting));
  to.count("palpate_frames_asleep_total", "Frames in which the body slept.", of, number(c.frames_asleep));
  to.count("palpate_frames_failed_total", "Frames whose step failed.", of, number(c.frames_failed));
  to.count("palpate_frames_without_rollouts_total", "Frames that had no time for rollouts.", of,
           number(c.frames_without_rollouts));
  to.count("palpate_steps_cut_total", "Steps of the body that were cut.", of, number(c.cut_steps));
  to.count("palpate_body_resets_total", "Times that a body was put back to rest.", of, number(c.resets));
  to.count("palpate_notes_total", "Notes of viewers that were recorded.", of, number(c.notes));
  to.count("palpate_notes_withheld_total", "Notes which came too soon after others.", of, number(c.notes_withheld));
  to.count("palpate_resets_withheld_total", "Requests for that which came too soon after others.", of, number(c.resets_withheld));
  to.count("palpate_tools_released_total", "Times that a tool was let go of, as it cost more than a hand does.", of,
           number(c.tools_released));
  to.count("palpate_bites_torn_out_total", "Bites of threads that were torn out of the tissue.", of, number(c.bites_torn_out));
  to.count("palpate_left_out_seconds_total", "Body time that was left out, as the room was too far behind.", of,
           seconds(c.left_out));
  to.gauge("palpate_frame_rate_hertz", "Frames a second that were asked for.", of, room.rate_hz);
  to.gauge("palpate_frame_rate_kept_hertz", "Frames a second that there is time for.", of, room.pace.rate_hz);
  to.gauge("palpate_frame_behind_seconds", "Age of the body's newest state when it was computed.", of, seconds(room.pace.behind));
  to.gauge("palpate_frame_out_seconds", "How long the frame that is being computed has been so, 0: none is.", of,
           seconds(room.computing_for));
  to.gauge("palpate_frame_core_share", "Part of a core that the frames got lately; below 0.8 the machine is starved.", of,
           room.core_share);
  to.gauge("palpate_room_up", "0: the room's body failed.", of, room.ended ? 0 : 1);
}

void add_stations(Families& to, const RoomState& room, const Labels& of) {
  const ServerCounts& c = room.counts;
  const auto with = [&](const char* name, const char* value) {
    Labels labels = of;
    labels.push_back({name, value});
    return labels;
  };
  const std::string stations = "palpate_stations", leaves = "palpate_leaves_total";
  to.gauge(stations, "Stations in the room.", with("role", "hand"), room.hands);
  to.gauge(stations, "", with("role", "shadow"), room.shadows);
  to.gauge(stations, "", with("role", "viewer"), room.viewers);
  to.count("palpate_joins_total", "Stations that came.", of, number(c.joins));
  to.count(leaves, "Stations that went.", with("reason", "said"), number(c.leaves));
  to.count(leaves, "", with("reason", "silent"), number(c.timeouts));
  to.count(leaves, "", with("reason", "replaced"), number(c.replaced));
  to.count(leaves, "", with("reason", "key"), number(c.expelled));
  to.count(leaves, "", with("reason", "goodbye"), number(c.goodbyes_sent));
  for (std::size_t k = 0; k < kRefuseReasons; ++k)
    to.count("palpate_refusals_total", "Refusals that were sent.", with("reason", kRefusalLabels[k]), number(c.refused[k]));
  to.count("palpate_patches_total", "Datagrams with patches that were sent, copies counted.", of, number(c.patches));
  to.count("palpate_patch_bytes_total", "Bytes of patches and their terms that were sent.", of, number(c.patch_bytes));
  to.count("palpate_patches_renewed_total", "Patches that were not needed, within the deadband.", of, number(c.renewed));
  to.count("palpate_patches_too_big_total", "Patches that did not fit a datagram.", of, number(c.patch_too_big));
}

void add_links(Families& to, const RoomState& room, const Labels& of) {
  const auto way = [&](const char* direction) {
    Labels labels = of;
    labels.push_back({"direction", direction});
    return labels;
  };
  const StationLinks& links = room.links;
  to.histogram("palpate_round_trip_seconds", "Mean round trips of stations, each observed twice a second.", of,
               links.rtt_seconds);
  to.histogram("palpate_patch_age_seconds", "Age that patches reach at their stations, each observed twice a second.", of,
               links.patch_age_seconds);
  to.histogram("palpate_loss_ratio", "Share of the newest datagrams that got lost, each station observed twice a second.",
               way("up"), links.lost_up);
  to.histogram("palpate_loss_ratio", "", way("down"), links.lost_down);
  to.count("palpate_late_ticks_total", "Late ticks of the stations' haptic loops.", of, number(links.ticks_late));
}

void add_datagrams(Families& to, const RoomState& room, const Labels& of) {
  const ServerCounts& c = room.counts;
  const auto drop = [&](const char* reason, std::uint64_t count) {
    Labels labels = of;
    labels.push_back({"reason", reason});
    to.count("palpate_datagrams_dropped_total", "Datagrams that came and changed nothing. What names no room is the first's.",
             std::move(labels), number(count));
  };
  for (std::size_t k = 1; k < kWireFaults; ++k) drop(kFaultLabels[k], c.dropped[k]);
  drop("unexpected", c.unexpected);
  drop("unknown_station", c.unknown_station);
  to.count("palpate_answers_withheld_total", "Answers larger than their questions, or too many at once.", of,
           number(c.answers_withheld));
}

void add_recording(Families& to, const RoomState& room, const Labels& of) {
  to.gauge("palpate_recording", "1: the room is being recorded.", of, room.recording == RecordingState::on);
  to.gauge("palpate_recording_failed", "1: its recording could not be written on.", of, room.recording == RecordingState::failed);
  to.count("palpate_recorded_bytes_total", "Bytes written to the room's recording.", of, number(room.recorded_bytes));
}

void add_traffic(Families& to, const TrafficCounts& traffic) {
  const auto both = [&](const char* name, const char* help, std::uint64_t in, std::uint64_t out) {
    to.count(name, help, {{"direction", "in"}}, number(in));
    to.count(name, "", {{"direction", "out"}}, number(out));
  };
  both("palpate_datagrams_total", "Datagrams over the network.", traffic.datagrams_in, traffic.datagrams_out);
  both("palpate_bytes_total", "Bytes of datagrams over the network.", traffic.bytes_in, traffic.bytes_out);
  both("palpate_stranger_bytes_total",
       "Bytes from and to addresses that have not shown that they receive: out / in is what an attacker gains.",
       traffic.bytes_from_strangers, traffic.bytes_to_strangers);
  to.count("palpate_send_failures_total", "Datagrams that the system did not take.", {}, number(traffic.send_failed));
}

void add_channel(Families& to, const ServerState& state) {
  if (!state.channel) return;
  const ServerChannelCounts& c = *state.channel;
  for (std::size_t k = 0; k < kChannelFaults; ++k)
    to.count("palpate_auth_failures_total", "Handshakes not answered, datagrams not opened.", {{"kind", kChannelLabels[k]}},
             number(c.faults[k]));
  to.count("palpate_auth_moves_total", "Times that a session's address changed.", {}, number(c.moves));
  to.gauge("palpate_auth_sessions", "Sessions of the trust channel.", {}, number(state.sessions));
  to.count("palpate_auth_sessions_total", "Sessions that were opened.", {}, number(c.sessions));
  to.count("palpate_auth_cookies_total", "Cookies that were sent.", {}, number(c.cookies));
}

}  // namespace

std::vector<MetricFamily> metrics_of(const ServerState& state, const std::string& version) {
  Families families;
  families.gauge("palpate_build_info", "Always 1; the label says what runs.", {{"version", version}}, 1);
  families.gauge("palpate_draining", "1: nobody is let in any more.", {}, state.draining);
  for (const RoomState& room : state.rooms) {
    const Labels of{{"room", room.name}};
    add_frames(families, room, of);
    add_stations(families, room, of);
    add_links(families, room, of);
    add_datagrams(families, room, of);
    add_recording(families, room, of);
  }
  add_traffic(families, state.traffic);
  add_channel(families, state);
  return families.take();
}

std::optional<std::string> not_well(const std::optional<ServerState>& state, Micros now) {
  if (!state) return std::nullopt;
  if (now - state->at > kLoopMost)
    return "the network loop has not turned for " + std::to_string((now - state->at).count() / 1000) + " ms";
  for (const RoomState& room : state->rooms)
    if (room.computing_for > kFrameMost)
      return "room \"" + room.name + "\" has computed one frame for " + std::to_string(room.computing_for.count() / 1000) + " ms";
  return std::nullopt;
}

std::optional<std::string> not_ready(const std::optional<ServerState>& state, Micros now) {
  if (!state) return "loading";
  if (state->draining) return "draining";
  return not_well(state, now);
}

}  // namespace palpate
