// From what waits in the outboxes to datagrams, a station after the other.
#include <algorithm>
#include <utility>

#include "server/core/server_core.hpp"

namespace palpate {
namespace {

constexpr std::uint32_t kTrianglesPerPiece = 112, kVerticesPerPiece = 168;  // about 1 kB each

}  // namespace

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
    if (const auto size = say(station, *std::exchange(station.outbox.beat, std::nullopt), out, to, now)) return size;
  return station.views() ? emit_view(station, out, to, now) : 0;
}

std::size_t ServerCore::emit_welcome(Station& station, std::span<std::byte> out, PeerId& to, Micros now) {
  const Welcome welcome{facts_.scene,    facts_.contact,  options_.rate_hz,
                        facts_.home,     facts_.vertices, static_cast<std::uint32_t>(facts_.triangles.size()),
                        facts_.mesh_hash};
  const auto size = say(station, welcome, out.first(std::min(out.size(), station.outbox.welcome_limit)), to, now);
  if (size == 0) ++counts_.answers_withheld;
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
  if (std::exchange(box.tools, false))
    if (const auto size = say(station, tools(station), out, to, now)) return size;
  if (box.shape) {
    const auto first = box.shape_next;
    box.shape_next += kVerticesPerPiece;
    box.shape = box.shape_next < shape_.size();
    if (const auto size = say(station, shape_piece(station, first), out, to, now)) return size;
  }
  if (box.mesh_pieces.empty()) return 0;
  const auto piece = box.mesh_pieces.front();
  box.mesh_pieces.pop_front();
  return say(station, mesh_piece(piece), out, to, now);
}

std::uint32_t ServerCore::mesh_pieces() const {
  return (static_cast<std::uint32_t>(facts_.triangles.size()) + kTrianglesPerPiece - 1) / kTrianglesPerPiece;
}

MeshPiece ServerCore::mesh_piece(std::uint32_t piece) const {
  const auto first = piece * kTrianglesPerPiece;
  const auto end = std::min<std::size_t>(first + kTrianglesPerPiece, facts_.triangles.size());
  return {facts_.mesh_hash,
          piece,
          mesh_pieces(),
          first,
          {facts_.triangles.begin() + first, facts_.triangles.begin() + static_cast<std::ptrdiff_t>(end)}};
}

ShapePiece ServerCore::shape_piece(const Station& viewer, std::size_t first) const {
  ShapePiece piece;
  piece.body_time = station_time(viewer, shape_time_);
  piece.first = static_cast<std::uint32_t>(first);
  const auto end = std::min(first + kVerticesPerPiece, shape_.size());
  piece.positions.assign(shape_.begin() + static_cast<std::ptrdiff_t>(first), shape_.begin() + static_cast<std::ptrdiff_t>(end));
  piece.low = piece.high = piece.positions.front();
  for (const auto& x : piece.positions) {
    piece.low = piece.low.cwiseMin(x);
    piece.high = piece.high.cwiseMax(x);
  }
  return piece;
}

Tools ServerCore::tools(const Station& viewer) const {
  constexpr std::size_t kMostBytes = 900;  // of names and states; a room with more tools shows the first
  Tools list{station_time(viewer, body_time_), {}};
  std::size_t bytes = 0;
  for (const auto& [id, station] : stations_) {
    if (!station.pushes() || !station.has_shown) continue;
    bytes += station.hello.station.size() + 64;
    if (bytes > kMostBytes) break;
    list.tools.push_back(station.shown);
  }
  return list;
}

}  // namespace palpate
