// Guidance: pairs of stations, one of which guides the other's tool (client/core/guidance.hpp), and the relay of their samples.
//
// A station whose Hello names another one is a guide. It forms a pair with that station while both are in the room with a tool
// each, and the other neither guides, has another guide, nor refuses. The server computes no force: each of the two gets the
// newest sample of the other, at most every kRelayEvery, when samples of the other have come. A guide without a partner gets the
// reason every kReasonEvery. A pair is held while both report that they render the force.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "server/core/station.hpp"

namespace palpate {

/// A hold that begins, or one that ended after `lasted` with these means of the forces that the two reported.
struct GuidanceNews {
  std::string guide, guided;
  bool begins = false;
  Micros lasted{};
  double guide_force_n = 0, guided_force_n = 0;
};

class GuidanceRelay {
 public:
  static constexpr Micros kRelayEvery{7'000}, kReasonEvery{250'000};

  /// Forms and ends pairs. Call often.
  void tick(Stations& stations, Micros now);
  /// Notes that samples of `from` came.
  void heard_samples(Stations& stations, const Station& from, Micros now) const;
  /// Notes what a station reports.
  void heard_report(Stations& stations, Station& from, const GuidanceReport& report, Micros now);
  /// Writes the next message for a station; returns its bytes, 0 if there is none.
  std::size_t emit(const Stations& stations, Station& to, std::span<std::byte> out, Micros now) const;

  /// Called when a hold begins or ends.
  std::function<void(const GuidanceNews&)> on_guidance;

 private:
  struct Hold {
    StationId guide = 0;
    std::string guide_name, guided_name;
    Micros since{};
    int reports = 0;
    double guide_sum_n = 0, guided_sum_n = 0;
  };

  static GuidanceHand obstacle(const Station& guide, const Station* partner);
  void look(Station& guide, const Station* guided, Micros now);
  void end(const Hold& hold, Micros now) const;

  std::vector<Hold> holds_;
};

}  // namespace palpate
