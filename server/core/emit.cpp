// From what waits in the outboxes to datagrams, a station after the other.
#include <algorithm>
#include <utility>

#include "server/core/mesh_pieces.hpp"
#include "server/core/server_core.hpp"

namespace palpate {

std::size_t ServerCore::emit(std::span<std::byte> out, PeerId& to, Micros now) {
  if (const auto size = emit_reply(out, to, now)) return size;
  // On from the station after the last, so that one with much to say does not silence the others.
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    auto next = stations_.upper_bound(emit_after_);
    if (next == stations_.end()) next = stations_.begin();
    emit_after_ = next->first;
    if (const auto size = emit_to(next->second, out, to, now)) return size;
  }
  return 0;
}

std::size_t ServerCore::send(const Message& message, PeerId to, std::span<std::byte> out, PeerId& whom) {
  const auto size = encode(message, out);
  if (size == 0) return 0;
  whom = to;
  ++counts_.sent;
  counts_.bytes_sent += size;
  return size;
}

std::size_t ServerCore::emit_reply(std::span<std::byte> out, PeerId& to, Micros now) {
  while (!replies_.empty()) {
    auto reply = std::move(replies_.front());
    replies_.pop_front();
    reply.message.clock.sent = now;
    const auto room = out.first(std::min(out.size(), reply.limit));
    if (const auto size = send(reply.message, reply.to, room, to)) return size;
    reply.refusal().message.clear();  // the reason alone may fit
    if (const auto size = send(reply.message, reply.to, room, to)) return size;
    ++counts_.answers_withheld;
  }
  return 0;
}

std::size_t ServerCore::say(Station& station, Body body, std::span<std::byte> out, PeerId& to, Micros now) {
  const Message message{options_.instance, station.id, station.seq_out, station.clock.stamp(now), std::move(body)};
  const auto size = send(message, station.peer, out, to);
  if (size > 0) ++station.seq_out;
  return size;
}

std::size_t ServerCore::emit_to(Station& station, std::span<std::byte> out, PeerId& to, Micros now) {
  if (std::exchange(station.outbox.welcome, false))
    if (const auto size = emit_welcome(station, out, to, now)) return size;
  if (!station.proven) return 0;
  if (station.outbox.patch)
    if (const auto size = emit_patch(station, out, to, now)) return size;
  while (!station.outbox.terms.empty())
    if (const auto size = emit_terms(station, out, to, now)) return size;
  if (station.outbox.beat)
    if (const auto size = emit_beat(station, out, to, now)) return size;
  return station.views() ? emit_view(station, out, to, now) : 0;
}

std::size_t ServerCore::emit_welcome(Station& station, std::span<std::byte> out, PeerId& to, Micros now) {
  const Welcome welcome{facts_.scene,
                        facts_.contact,
                        options_.rate_hz,
                        facts_.home,
                        static_cast<std::uint32_t>(facts_.mesh.vertices.size()),
                        static_cast<std::uint32_t>(facts_.mesh.triangles.size()),
                        facts_.mesh_hash,
                        station.pushes() ? options_.deadband : 0,
                        station.hello.station};
  const auto size = say(station, welcome, out.first(std::min(out.size(), station.outbox.welcome_limit)), to, now);
  if (size == 0) ++counts_.answers_withheld;
  return size;
}

std::size_t ServerCore::emit_beat(Station& station, std::span<std::byte> out, PeerId& to, Micros now) {
  auto& box = station.outbox;
  const auto size = say(station, *box.beat, out, to, now);
  if (size == 0 || --box.beat_copies <= 0) box.beat.reset();
  return size;
}

std::size_t ServerCore::emit_patch(Station& station, std::span<std::byte> out, PeerId& to, Micros now) {
  auto& box = station.outbox;
  const auto size = say(station, PatchMessage{*box.patch}, out, to, now);
  if (size == 0 || --box.patch_copies <= 0) box.patch.reset();
  if (size > 0) {
    ++station.counts.patches;
    station.counts.patch_bytes += size;
  } else {
    ++station.counts.patch_too_big;
    beat(station);
  }
  return size;
}

std::size_t ServerCore::emit_terms(Station& station, std::span<std::byte> out, PeerId& to, Micros now) {
  const PatchTerms piece = std::move(station.outbox.terms.front());
  station.outbox.terms.pop_front();
  const auto size = say(station, piece, out, to, now);
  station.counts.patch_bytes += size;
  return size;
}

std::size_t ServerCore::emit_view(Station& station, std::span<std::byte> out, PeerId& to, Micros now) {
  auto& box = station.outbox;
  if (station.shape.due)
    if (const auto size = emit_shape(station, out, to, now)) return size;
  if (std::exchange(box.room, false))
    if (const auto size = say(station, room_view(now), out, to, now)) return size;
  if (box.mesh_pieces.empty()) return 0;
  const auto piece = box.mesh_pieces.front();
  box.mesh_pieces.pop_front();
  return say(station, mesh_piece(facts_, piece), out, to, now);
}

/// The pieces of the newest frame, then the tools, which say how many there were.
std::size_t ServerCore::emit_shape(Station& station, std::span<std::byte> out, PeerId& to, Micros now) {
  ShapePiece piece;
  while (shapes_.next(station.shape, piece)) {
    const auto size = say(station, std::move(piece), out, to, now);
    if (size == 0) continue;
    shapes_.sent(station.shape, station.seq_out - 1, now);
    return size;
  }
  station.shape.due = false;
  return say(station, tools(station), out, to, now);
}

Tools ServerCore::tools(const Station& viewer) const {
  constexpr std::size_t kMostBytes = 900;  // of names and states; a room with more tools shows the first
  Tools list{shapes_.frame(), shapes_.body_time(), viewer.shape.pieces, {}};
  std::size_t bytes = 0;
  for (const auto& [id, station] : stations_) {
    if (!station.pushes() || !station.has_shown) continue;
    bytes += station.hello.station.size() + 92;
    if (bytes > kMostBytes) break;
    list.tools.push_back(station.shown);
  }
  return list;
}

RoomView ServerCore::room_view(Micros now) const {
  constexpr std::size_t kMostBytes = 900;
  const FrameMeter::Figures lately = meter_.at(now);
  RoomView view{facts_.nodes, lately.took_mean, std::min<double>(lately.frames, kMaxRateHz), lately.real_time_factor,
                {},           asleep_};
  std::size_t bytes = 0;
  for (const auto& [id, station] : stations_) {
    if (station.views()) continue;
    bytes += station.hello.station.size() + 64;
    if (bytes > kMostBytes) break;
    LinkReport link;
    station.loss.fill(link);
    const RttStats rtt = station.clock.rtt();
    view.stations.push_back({station.hello.station, rtt.mean, rtt.jitter, station.patch_age, link.judged, link.lost,
                             station.ticks_late, station.states, station.in_use});
  }
  return view;
}

}  // namespace palpate
