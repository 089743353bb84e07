#include "server/core/server_rooms.hpp"

#include <algorithm>

namespace palpate {

ServerRooms::ServerRooms(std::vector<RoomSpec> rooms, std::uint64_t instance, double rate_hz, double deadband)
    : first_instance_(instance) {
  std::string names;
  for (const RoomSpec& room : rooms) names += (names.empty() ? "" : ", ") + room.name;
  for (RoomSpec& room : rooms)
    cores_.push_back(std::make_unique<ServerCore>(std::move(room.facts),
                                                  ServerOptions{instance + cores_.size(), rate_hz, room.name, names, deadband}));
}

ServerCore& ServerRooms::room_of(WireFault fault, const Message& message) {
  if (fault != WireFault::none) return *cores_.front();
  if (const auto* hello = std::get_if<Hello>(&message.body)) {
    for (const auto& core : cores_)
      if (core->options().room == hello->room) return *core;
    return *cores_.front();
  }
  const std::uint64_t k = message.instance - first_instance_;
  return k < cores_.size() ? *cores_[k] : *cores_.front();
}

void ServerRooms::take(std::span<const std::byte> bytes, PeerId from, Micros now) {
  Message message;
  const WireFault fault = decode(bytes, message);
  take(fault, message, bytes.size(), from, now);
}

void ServerRooms::take(WireFault fault, const Message& message, std::size_t size, PeerId from, Micros now) {
  room_of(fault, message).take(fault, message, size, from, now);
}

void ServerRooms::refuse(const Message& question, PeerId to, const Refuse& refusal, std::size_t limit) {
  room_of(WireFault::none, question).refuse(question, to, refusal, limit);
}

void ServerRooms::expel(PeerId peer, Micros now) {
  for (const auto& core : cores_) core->expel(peer, now);
}

void ServerRooms::tick(Micros now) {
  for (const auto& core : cores_) core->tick(now);
}

std::size_t ServerRooms::emit(std::span<std::byte> out, PeerId& to, Micros now) {
  for (const auto& core : cores_)
    if (const auto size = core->emit(out, to, now)) return size;
  return 0;
}

Micros ServerRooms::deadline() const {
  Micros earliest = Micros::max();
  for (const auto& core : cores_) earliest = std::min(earliest, core->deadline());
  return earliest;
}

void ServerRooms::shut_down() {
  for (const auto& core : cores_) core->shut_down();
}

}  // namespace palpate
