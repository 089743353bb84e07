// The rooms of one server process; routes each datagram to its room.
//
// A Hello names its room (without a name it gets the first; an unknown name is refused with a list of the rooms). Every other
// datagram carries the number and the secret from its room's Welcome. So rooms share nothing but the socket, and a station of one
// room is a stranger to the others. A datagram that belongs to no room is answered by the first.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "server/core/server_core.hpp"

namespace palpate {

class ServerRooms {
 public:
  struct RoomSpec {
    std::string name;
    RoomInfo facts;
  };
  /// Requires at least one room, and distinct names.
  ServerRooms(std::vector<RoomSpec> rooms, const SecretSource& draw, double rate_hz, double deadband = 0);

  std::size_t size() const { return cores_.size(); }
  ServerCore& operator[](std::size_t k) { return *cores_[k]; }
  const ServerCore& operator[](std::size_t k) const { return *cores_[k]; }
  const std::string& name(std::size_t k) const { return cores_[k]->options().room; }

  void take(std::span<const std::byte> bytes, PeerId from, Micros now);
  /// Accepts the result of decode() on `size` bytes.
  void take(WireFault fault, const Message& message, std::size_t size, PeerId from, Micros now);
  /// Queues a refusal in place of an answer to this message.
  void refuse(const Message& question, PeerId to, const Refuse& refusal, std::size_t limit, Micros now);
  void expel(PeerId peer, Micros now);
  /// Calls ServerCore::know_keys of all rooms.
  void know_keys(const std::function<std::string(PeerId)>& key_of);
  /// Ticks all rooms.
  void tick(Micros now);
  std::size_t emit(std::span<std::byte> out, PeerId& to, Micros now);
  Micros deadline() const;
  /// Refuses new sessions; existing ones stay.
  void drain();
  /// Returns true if a station other than a viewer is in any room.
  bool has_hands() const;
  void shut_down(Micros now);
  void repeat_goodbyes(Micros now);
  /// Returns true if a station of any room is at this peer.
  bool serves(PeerId peer) const;

 private:
  ServerCore& room_of(WireFault fault, const Message& message, PeerId from, Micros now);

  std::vector<std::unique_ptr<ServerCore>> cores_;
};

}  // namespace palpate
