#include "server/core/server_rooms.hpp"

#include <algorithm>

namespace palpate {

ServerRooms::ServerRooms(std::vector<RoomSpec> rooms, const SecretSource& draw, double rate_hz, double deadband) {
  const auto shared = [draws = std::make_shared<SecretSource>(draw)] { return (*draws)(); };  // no two rooms draw the same
  std::vector<std::string> names;
  for (const RoomSpec& room : rooms) names.push_back(room.name);
  for (RoomSpec& room : rooms)
    cores_.push_back(
        std::make_unique<ServerCore>(std::move(room.facts), ServerOptions{shared, rate_hz, room.name, names, deadband}));
}

ServerCore& ServerRooms::room_of(WireFault fault, const Message& message, PeerId from, Micros now) {
  if (fault != WireFault::none) return *cores_.front();
  if (const auto* hello = std::get_if<Hello>(&message.body)) {
    for (const auto& core : cores_)
      if (core->options().room == hello->room) return *core;
    return *cores_.front();
  }
  for (const auto& core : cores_)
    if (core->knows(message, from, now)) return *core;
  return *cores_.front();
}

void ServerRooms::take(std::span<const std::byte> bytes, PeerId from, Micros now) {
  Message message;
  const WireFault fault = decode(bytes, message);
  take(fault, message, bytes.size(), from, now);
}

void ServerRooms::take(WireFault fault, const Message& message, std::size_t size, PeerId from, Micros now) {
  room_of(fault, message, from, now).take(fault, message, size, from, now);
}

void ServerRooms::refuse(const Message& question, PeerId to, const Refuse& refusal, std::size_t limit, Micros now) {
  room_of(WireFault::none, question, to, now).refuse(question, to, refusal, limit, now);
}

void ServerRooms::expel(PeerId peer, Micros now) {
  for (const auto& core : cores_) core->expel(peer, now);
}

void ServerRooms::know_keys(const std::function<std::string(PeerId)>& key_of) {
  for (const auto& core : cores_) core->know_keys(key_of);
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

void ServerRooms::drain() {
  for (const auto& core : cores_) core->drain();
}

bool ServerRooms::has_hands() const {
  return std::any_of(cores_.begin(), cores_.end(), [](const auto& core) { return core->has_hands(); });
}

void ServerRooms::shut_down(Micros now) {
  for (const auto& core : cores_) core->shut_down(now);
}

void ServerRooms::repeat_goodbyes(Micros now) {
  for (const auto& core : cores_) core->repeat_goodbyes(now);
}

bool ServerRooms::serves(PeerId peer) const {
  return std::any_of(cores_.begin(), cores_.end(), [peer](const auto& core) { return core->serves(peer); });
}

}  // namespace palpate
