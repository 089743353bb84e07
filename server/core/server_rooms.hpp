// The rooms of one server process: which of them a datagram is for.
//
// A Hello names its room (the first when it names none, and an unknown name is refused with the list of those there are); every
// other datagram carries the number and the secret that its room's Welcome gave. So rooms share nothing but the socket: a station
// in one is a stranger to the others. What nobody knows is answered by the first room.
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
    RoomFacts facts;
  };
  /// At least one room; names differ.
  ServerRooms(std::vector<RoomSpec> rooms, const SecretSource& draw, double rate_hz, double deadband = 0);

  std::size_t size() const { return cores_.size(); }
  ServerCore& operator[](std::size_t k) { return *cores_[k]; }
  const ServerCore& operator[](std::size_t k) const { return *cores_[k]; }
  const std::string& name(std::size_t k) const { return cores_[k]->options().room; }

  void take(std::span<const std::byte> bytes, PeerId from, Micros now);
  /// What decode() made of `size` bytes.
  void take(WireFault fault, const Message& message, std::size_t size, PeerId from, Micros now);
  /// In place of an answer to this message.
  void refuse(const Message& question, PeerId to, const Refuse& refusal, std::size_t limit, Micros now);
  void expel(PeerId peer, Micros now);
  /// ServerCore::know_successors of all rooms.
  void know_successors(const std::function<bool(PeerId, PeerId)>& succeeds);
  /// Of all rooms.
  void tick(Micros now);
  std::size_t emit(std::span<std::byte> out, PeerId& to, Micros now);
  Micros deadline() const;
  /// Nobody is let in any more; who is there stays.
  void drain();
  /// Whether anybody feels a body: viewers aside.
  bool has_hands() const;
  void shut_down(Micros now);
  void repeat_goodbyes(Micros now);
  /// Whether a station of any room is there.
  bool serves(PeerId peer) const;

 private:
  ServerCore& room_of(WireFault fault, const Message& message, PeerId from, Micros now);

  std::vector<std::unique_ptr<ServerCore>> cores_;
};

}  // namespace palpate
