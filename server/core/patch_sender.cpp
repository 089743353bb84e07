#include "server/core/patch_sender.hpp"

#include <algorithm>
#include <utility>

#include "server/room/deadband.hpp"

namespace palpate {
namespace {

constexpr Micros kLongestSaid{60'000'000};  // largest lag that a beat reports

/// Clamps a force to what the wire can carry: an unreadable message would leave hand and viewer with nothing at all.
Vec3 as_carried(const Vec3& force) { return force.cwiseMax(-kMaxForceN).cwiseMin(kMaxForceN); }

}  // namespace

Beat beat_for(const Stations& stations, const Station& station, const BodyNow& body) {
  Beat beat{stations.station_time(station, body.time),
            station.contact_in_reach,
            body.pace.rate_hz,
            std::min(body.pace.behind, kLongestSaid),
            {}};
  beat.resets = body.resets;
  beat.in_use = station.in_use;
  beat.notes = station.notes;
  beat.released = station.released;
  station.loss.fill(beat.link);
  return beat;
}

void PatchSender::take(FrameResult& result, Stations& stations, const BodyNow& body, Micros now) {
  body_ = body;
  for (auto& [id, station] : stations) {
    const auto frame =
        std::find_if(result.stations.begin(), result.stations.end(), [id = id](const auto& f) { return f.id == id; });
    if (frame != result.stations.end())
      give(stations, station, *frame, now);
    else if (!station.views())
      beat(stations, station);
  }
}

void PatchSender::give(const Stations& stations, Station& station, StationFrame& frame, Micros now) {
  station.shown = {
      station.hello.station,  frame.tool, as_carried(frame.force), frame.contact,           station.tool.orientation(),
      station.tool.pressed(), {},         station.tool.opening(),  as_carried(frame.torque)};
  station.has_shown = true;
  const bool was_released = std::exchange(station.released, frame.released);
  if (!station.served) return beat(stations, station);
  station.contact_in_reach = frame.patch.has_value();
  if (!frame.patch || is_lost(stations, station, frame)) return beat(stations, station);
  station.states = static_cast<std::uint16_t>(2 * frame.patch->modes());
  if (frame.renewed_from) return renew(stations, station, *frame.renewed_from);
  send_patch(stations, station, frame);
  const bool slow = body_.pace.rate_hz < kSlowBelow * rate_hz_;
  if (slow == station.slow_known && station.released == was_released && now < station.next_report) return;
  station.slow_known = slow;
  station.next_report = now + kLinkReportEvery;
  station.outbox.beat = beat_for(stations, station, body_);
}

void PatchSender::send_patch(const Stations& stations, Station& station, StationFrame& frame) const {
  const Micros stamp = frame.patch->stamp;
  frame.patch->stamp = stations.station_time(station, stamp);
  frame.patch->seq = ++station.patch_seq;
  frame.patch->force = as_carried(frame.patch->force);
  const auto pieces = frame.terms.variables > 0 ? to_pieces(frame.terms, frame.patch->seq) : std::vector<PatchTerms>{};
  const int copies = frame.terms.elements.count() > 0 ? 1 : station.link.patch_copies;
  station.outbox.terms.clear();
  for (int k = 0; k < copies; ++k) station.outbox.terms.insert(station.outbox.terms.end(), pieces.begin(), pieces.end());
  station.outbox.patch = std::move(frame.patch);
  station.outbox.patch_copies = copies;
  station.outbox.beat.reset();
  if (deadband_ <= 0 || !station.pushes()) return;
  station.patches_sent.push_back({station.patch_seq, stamp});
  if (station.patches_sent.size() > Deadband::kSentMax) station.patches_sent.pop_front();
}

/// Replaces a patch that adds nothing to those from the one stamped `stamp` on by a beat.
void PatchSender::renew(const Stations& stations, Station& station, Micros stamp) {
  const auto& sent = station.patches_sent;
  const auto oldest = std::find_if(sent.begin(), sent.end(), [&](const Station::SentPatch& p) { return p.stamp == stamp; });
  beat(stations, station);
  if (station.outbox.patch || oldest == sent.end()) return;
  count(station, {.renewed = 1});
  station.outbox.beat->renewed_from = oldest->seq;
  station.outbox.beat_copies = station.link.patch_copies;
}

/// Returns true if nothing is known of the tool for longer than the patch is valid: it would be played from a place that the tool
/// has left. The samples of a shadow's tool come over another station's link, and may take as long as that station's prediction
/// horizon.
bool PatchSender::is_lost(const Stations& stations, const Station& station, const StationFrame& frame) const {
  const Station* const owner = stations.tool_of(station);
  if (!owner || owner->tool.timeline().empty()) return false;
  const Micros valid_for = frame.patch->valid_for;
  const Micros allowed = owner == &station ? valid_for : std::max(valid_for, 2 * owner->horizon);
  return frame.patch->stamp - owner->tool.timeline().newest() > allowed;
}

void PatchSender::beat_all(Stations& stations, const BodyNow& body) {
  body_ = body;
  for (auto& [id, station] : stations) beat(stations, station);
}

void PatchSender::beat(const Stations& stations, Station& station) const {
  if (station.outbox.patch) return;  // not sent yet, and contains the same report
  station.outbox.beat = beat_for(stations, station, body_);
  station.outbox.beat_copies = 1;
}

/// Reports of overtaken datagrams are ignored: their content is already known.
void PatchSender::heard_playing(Station& station, std::uint32_t seq) const {
  if (deadband_ <= 0) return;
  auto& sent = station.patches_sent;
  const auto played = std::find_if(sent.begin(), sent.end(), [&](const Station::SentPatch& p) { return p.seq == seq; });
  if (seq == 0) station.playing.reset();
  if (played == sent.end()) return;
  station.playing = played->stamp;
  sent.erase(sent.begin(), played);
}

std::size_t PatchSender::emit(const Stations& stations, Station& station, std::span<std::byte> out, Micros now) {
  auto& box = station.outbox;
  if (box.patch)
    if (const auto size = emit_patch(stations, station, out, now)) return size;
  while (!box.terms.empty()) {
    const PatchTerms piece = std::move(box.terms.front());
    box.terms.pop_front();
    const auto size = encode_for(station, piece, out, now);
    count(station, {.patch_bytes = size});
    if (size > 0) return size;
  }
  if (!box.beat) return 0;
  const auto size = encode_for(station, *box.beat, out, now);
  if (size == 0 || --box.beat_copies <= 0) box.beat.reset();
  return size;
}

void PatchSender::count(Station& station, const PatchCounts& more) {
  for (PatchCounts* counts : {static_cast<PatchCounts*>(&station.counts), &counts_}) {
    counts->patches += more.patches;
    counts->patch_bytes += more.patch_bytes;
    counts->renewed += more.renewed;
    counts->patch_too_big += more.patch_too_big;
  }
}

std::size_t PatchSender::emit_patch(const Stations& stations, Station& station, std::span<std::byte> out, Micros now) {
  auto& box = station.outbox;
  const auto size = encode_for(station, PatchMessage{*box.patch}, out, now);
  if (size == 0 || --box.patch_copies <= 0) box.patch.reset();
  if (size > 0) {
    count(station, {.patches = 1, .patch_bytes = size});
  } else {
    count(station, {.patch_too_big = 1});
    beat(stations, station);
  }
  return size;
}

}  // namespace palpate
