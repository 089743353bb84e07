#include "server/core/server_core.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace palpate {
namespace {

constexpr Micros kNotesAbout{600'000'000};  // a note may be about a moment this long ago
constexpr Micros kTimelineKept{4'000'000};  // part of a tool's timeline that is kept behind body time

std::optional<double> lost_to(const Station& station) {
  return station.link.loss_known ? std::optional(station.link.lost) : std::nullopt;
}

std::optional<double> lost_from(const Station& station) {
  LinkReport report;
  station.loss.fill(report);
  if (report.judged < kLossJudged) return std::nullopt;
  return static_cast<double>(report.lost) / report.judged;
}

}  // namespace

std::uint64_t DatagramCounts::dropped_all() const { return std::accumulate(dropped.begin(), dropped.end(), std::uint64_t{0}); }

ServerCore::ServerCore(RoomInfo facts, const ServerOptions& options)
    : options_(options),
      sessions_(facts, options),
      frames_(facts.contact, options),
      patches_(options),
      views_(std::move(facts), options) {}

void ServerCore::take(std::span<const std::byte> bytes, PeerId from, Micros now) {
  Message message;
  const auto fault = decode(bytes, message);
  take(fault, message, bytes.size(), from, now);
}

void ServerCore::take(WireFault fault, const Message& message, std::size_t size, PeerId from, Micros now) {
  ++counts_.received;
  counts_.bytes_received += size;
  if (fault != WireFault::none) ++counts_.dropped[static_cast<std::size_t>(fault)];
  const bool nobody = sessions_.stations().empty();
  Station* const station = sessions_.take(fault, message, size, from, now);
  if (!station) counts_.bytes_from_strangers += size;
  if (nobody && !sessions_.stations().empty()) frames_.wake(now);
  if (station && !take_from(*station, message, now)) ++counts_.unexpected;
}

bool ServerCore::take_from(Station& station, const Message& message, Micros now) {
  const Payload& body = message.body;
  if (const auto* samples = std::get_if<Samples>(&body))
    take_samples(station, *samples, now);
  else if (const auto* beat = std::get_if<Beat>(&body))
    take_beat(station, *beat, now);
  else if (const auto* reset = std::get_if<Reset>(&body))
    take_reset(station, *reset, now);
  else if (const auto* note = std::get_if<Note>(&body); note && station.views())
    take_note(station, *note, message, now);
  else if (const auto* state = std::get_if<ViewState>(&body); state && station.views())
    views_.heard(station, *state);
  else if (const auto* request = std::get_if<MeshRequest>(&body))
    return views_.asked(station, *request);
  else
    return false;
  return true;
}

void ServerCore::take_beat(Station& station, const Beat& beat, Micros now) {
  station.link.take(beat);
  if (station.pushes()) guidance_.heard_report(sessions_.stations(), station, beat.guidance, now);
}

void ServerCore::take_samples(Station& station, const Samples& samples, Micros now) {
  if (!station.pushes()) return;
  patches_.heard_playing(station, samples.playing);
  station.tool.take(samples, station.clock, frames_.body_time(), now, [&](const ButtonChange& change) {
    if (on_buttons_) on_buttons_(station.id, change);
  });
  guidance_.heard_samples(sessions_.stations(), station, now);
}

void ServerCore::take_reset(Station& station, const Reset& reset, Micros now) {
  station.next_report = now;  // it waits for the new count
  if (!frames_.is_new_reset(reset.resets)) return;
  std::erase_if(resets_of_keys_, [now](const auto& entry) { return entry.second.is_full(now); });
  const std::string key = sessions_.key_of ? sessions_.key_of(station.peer) : std::string();
  RateLimit& own = key.empty() ? station.resets : resets_of_keys_.try_emplace(key, kResetsOfOne).first->second;
  if (!own.allows(now) || !resets_.allows(now)) {
    ++counts_.resets_withheld;
    return;
  }
  own.take(now);
  resets_.take(now);
  frames_.reset();
  sessions_.tell(RecordedEventKind::reset, station, "", now);
}

void ServerCore::take_note(Station& station, const Note& note, const Message& question, Micros now) {
  station.next_report = now;                     // it waits for the new count
  if (note.number != station.notes + 1) return;  // repeated
  if (!station.note_limit.allows(now) || !notes_.allows(now)) {
    ++counts_.notes_withheld;
    return;
  }
  station.note_limit.take(now);
  notes_.take(now);
  const std::string& author = note.author.empty() ? station.hello.station : note.author;
  if (!on_note_ || !on_note_({now, station.id, std::clamp(note.at, now - kNotesAbout, now), author, note.text}))
    return sessions_.refuse(question, station.peer, {RefuseReason::bad_request, "the room is not being recorded (--record)"},
                            kMaxDatagramBytes, now);
  ++station.notes;
  ++counts_.notes;
}

void ServerCore::tick(Micros now) {
  sessions_.drop_silent(now);
  guidance_.tick(sessions_.stations(), now);
  if (!frames_.tick(sessions_.stations(), now)) patches_.beat_all(sessions_.stations(), frames_.body(now));
}

Micros ServerCore::deadline() const { return std::min(frames_.deadline(sessions_.stations()), sessions_.deadline()); }

void ServerCore::finish(FrameResult result, Micros now) {
  Stations& stations = sessions_.stations();
  frames_.finish(result, stations, now);
  for (const StationId id : result.released)
    if (const auto dear = stations.find(id); dear != stations.end() && on_tool_released_) on_tool_released_(dear->second);
  if (result.sutures.any() && on_sutures_) on_sutures_(result.sutures);
  if (result.loose > 0 && on_piece_removed_) on_piece_removed_(result.loose);
  const BodyNow body = frames_.body(now);
  if (result.failed) return patches_.beat_all(stations, body);
  patches_.take(result, stations, body, now);
  views_.take(result, stations, body, now);
  for (auto& [id, station] : stations) station.tool.forget_before(body.time - kTimelineKept);
}

std::size_t ServerCore::emit(std::span<std::byte> out, PeerId& to, Micros now) {
  std::size_t size = sessions_.emit(out, to, now);
  counts_.bytes_to_strangers += size;
  if (size == 0) size = emit_to_next(out, to, now);
  counts_.sent += size > 0;
  counts_.bytes_sent += size;
  return size;
}

/// Continues with the station after the last, so that one with many datagrams does not silence the others.
std::size_t ServerCore::emit_to_next(std::span<std::byte> out, PeerId& to, Micros now) {
  Stations& stations = sessions_.stations();
  for (std::size_t i = 0; i < stations.size(); ++i) {
    auto next = stations.upper_bound(emit_after_);
    if (next == stations.end()) next = stations.begin();
    Station& station = next->second;
    emit_after_ = station.id;
    to = station.peer;
    if (const auto size = patches_.emit(stations, station, out, now)) return size;
    if (const auto size = guidance_.emit(stations, station, out, now)) return size;
    if (const auto size = views_.emit(stations, station, out, now)) return size;
  }
  return 0;
}

void ServerCore::close(const std::string& why, bool ended, Micros now) {
  sessions_.shut_down(why, ended, now);
  frames_.drop_job(ended);
}

bool ServerCore::has_hands() const {
  const Stations& stations = sessions_.stations();
  return std::any_of(stations.begin(), stations.end(), [](const auto& entry) { return !entry.second.views(); });
}

Orientation ServerCore::orientation(StationId id) const {
  const auto station = sessions_.stations().find(id);
  return station != sessions_.stations().end() ? station->second.tool.orientation() : Orientation();
}

std::vector<StationReport> ServerCore::stations() const {
  std::vector<StationReport> reports;
  for (const auto& [id, s] : sessions_.stations())
    reports.push_back({id,
                       s.hello.station,
                       s.hello.role,
                       s.in_use.scheme,
                       s.hello.shadow_of,
                       s.clock.rtt(),
                       s.clock.offset(),
                       s.clock.drift_ppm(),
                       s.seq.counts(),
                       frames_.horizon(s),
                       s.link.patch_age,
                       lost_from(s),
                       lost_to(s),
                       s.link.ticks_late,
                       {s.tool.counts(), s.counts},
                       s.guidance.held ? s.guidance.partner : 0,
                       s.guidance.report.force_n,
                       s.tool_held});
  return reports;
}

}  // namespace palpate
