// Somebody on the way of every datagram of a simulated world with keys: sees all, and sends what they like in anybody's name.
//
// Every kEvery one of: a datagram again that came before, cut short, with a bit flipped, sent back to its sender, with a genuine
// head on bytes that nobody sealed; or 30 handshakes from 30 addresses, half of them made with the server's public key, which is
// no secret. What came before comes from other addresses too. With the key of a station for another room also a session of their
// own, and in it whatever may be said: that station leaves, joins under another's name or as the shadow of another, sends
// samples, asks for the body's rest, with station numbers that are easily guessed; part of it seems to come from somebody else,
// at whom the answers are aimed.
//
// While a station is not in, or not any more, its handshakes are attacked too:
//
//     - Manner::careful: only what must not even cost time: Inits, answers and data cut short, sent back, changed where a mac or
//       a tag sees it, and the flood. What is sent again came to its receiver before (kReplayAfter is longer than any way over a
//       link that loses nothing), and only once all are in: a copy that overtakes its original is no attack but a faster network.
//     - Manner::ruthless: everything, at any time, copies of handshakes on their way included, and Inits are answered by a forged
//       Cookie or two, sooner than the server or later, until all is to be well again; and what a station that is not in any more
//       sent before, and the link perhaps lost, is brought to the server. That may cost time, and nothing else.
//
// The stolen key is used only while all are in: the world has one room, so a place that is free is the thief's to take.
//
// All is drawn from a seed of its own.
#pragma once

#include <deque>
#include <map>
#include <memory>

#include "bench/world/world.hpp"
#include "common/base/random.hpp"

namespace palpate {

/// A stray is what the server sends to an address that is no station's; overdrawn: one beyond the bytes that came from there,
/// where nobody ever answered.
struct AttackCounts {
  std::uint64_t injected = 0, stray_bytes = 0, injected_bytes = 0, overdrawn = 0;
  std::uint64_t before = 0;   ///< of the injected, while a station was not in
  std::uint64_t cookies = 0;  ///< of the injected, forged answers to an Init
  std::uint64_t of_gone = 0;  ///< of the injected, what a station sent that is not in any more
};

enum class Manner : std::uint8_t { careful, ruthless };

class Adversary {
 public:
  static constexpr Micros kEvery{4'000}, kReplayAfter{900'000};

  Adversary(std::uint64_t seed, std::optional<ClientKeys> stolen, Manner manner)
      : random_(seed), stolen_(std::move(stolen)), manner_(manner) {}

  /// From now on until `end`, with forged cookies until `healed`; the adversary outlives that.
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
  std::map<ChannelAddress, std::int64_t> left_;  ///< bytes from there less bytes to there
  std::unique_ptr<ClientChannel> thief_;
};

}  // namespace palpate
