// An attacker on the path of every datagram of a simulated world with keys: it sees all, and sends anything in anybody's name.
//
// Every kEvery it sends one of: an earlier datagram again, unchanged, cut short, with a bit flipped, or sent back to its sender;
// a genuine header on bytes that nobody sealed; or 30 handshakes from 30 addresses, half of them made with the server's public
// key, which is no secret. Earlier datagrams also come from other addresses. With the key of a station for another room it also
// opens a session of its own and sends anything in it: that station leaves, joins under another's name or as the shadow of
// another, sends samples, asks for a reset of the body, with station numbers that are easily guessed; a part seems to come from
// somebody else, at whom the answers are aimed.
//
// Until a station has joined, and after it left, its handshakes are attacked as well:
//
//     - Manner::careful: only attacks that must not even cost time: Inits, answers and data cut short, sent back, or changed
//       where a mac or a tag detects it, and the flood. Replayed datagrams reached their receiver before (kReplayAfter is longer
//       than any delay on a link without losses), and are replayed only once all have joined: a copy that overtakes its original
//       is no attack but a faster network.
//     - Manner::ruthless: everything, at any time, including copies of handshakes in flight. Inits are answered by a forged
//       Cookie or two, before the server or after it, until the time by which all must be well again. Datagrams of a station that
//       has left, perhaps lost by the link, are brought to the server. This may cost time, and nothing else.
//
// The stolen key is used only while all have joined: the world has one room, and the thief may take any free seat.
//
// Everything is drawn from a seed of its own.
#pragma once

#include <deque>
#include <map>
#include <memory>

#include "bench/world/world.hpp"
#include "common/base/random.hpp"

namespace palpate {

/// A stray is a datagram from the server to an address that belongs to no station. `overdrawn` counts strays beyond the bytes
/// that came from an address from which nobody ever answered.
struct AttackCounts {
  std::uint64_t injected = 0, stray_bytes = 0, injected_bytes = 0, overdrawn = 0;
  std::uint64_t before = 0;   ///< injected while a station had not joined
  std::uint64_t cookies = 0;  ///< injected forged answers to an Init
  std::uint64_t of_gone = 0;  ///< injected datagrams of a station that has left
};

enum class Manner : std::uint8_t { careful, ruthless };

class Adversary {
 public:
  static constexpr Micros kEvery{4'000}, kReplayAfter{900'000};

  Adversary(std::uint64_t seed, std::optional<ClientKeys> stolen, Manner manner)
      : random_(seed), stolen_(std::move(stolen)), manner_(manner) {}

  /// Attacks from now until `end`, with forged cookies until `healed`; the adversary must outlive that.
  void attack(World& world, Micros healed, Micros end);
  const AttackCounts& counts() const { return counts_; }

 private:
  using Packet = std::vector<std::byte>;
  struct Seen {
    Micros at{};
    ChannelAddress client;
    std::size_t station = 0;
    bool to_server = false;
    Packet bytes;
  };

  ChannelAddress random_address();
  ChannelAddress home_or_not(const ChannelAddress& home);
  void to_server(const ChannelAddress& from, const Packet& packet);
  void to_station(std::size_t station, const Packet& packet);
  void send(const Seen& like, const Packet& packet);
  const Seen* old_one();
  const Seen* any();
  bool is_in(std::size_t station) const;
  bool all_are_in() const;
  void act(Micros now);
  void act_at_random();
  void act_before();
  void act_ruthlessly(bool in);
  void speak_for_gone();
  void answer_init(Micros now, std::size_t station, std::span<const std::byte> init);
  Packet cut(const Packet& packet);
  Packet flipped(Packet packet);
  Packet forged(Packet packet);
  void reflect(const Seen& seen);
  void flood();
  void steal(Micros now);
  void take(std::span<const std::byte> bytes);
  void say(Micros now);
  Message something_to_say(Micros now);
  DrawBytes draw();

  Random random_;
  std::optional<ClientKeys> stolen_;
  Manner manner_;
  AttackCounts counts_;
  Micros cookies_until_{};
  World* world_ = nullptr;
  std::deque<Seen> seen_;
  std::map<ChannelAddress, std::int64_t> left_;  ///< bytes received from an address minus bytes sent to it
  std::unique_ptr<ClientChannel> thief_;
};

}  // namespace palpate
