// Checks of the whole run.
//
//   counters    every counter that only counts up does so, in every station's process and in the server's
//   recovery    `recovered` after everything was healed, a station is joined and has a patch (or a beat says that no contact is
//               in reach). From the moment at which its hand stands still, the force is true again: for kShare of the patches,
//               the force felt within kNearTicks of the stamp, in a tick or on average, equals the force of the full model there,
//               to kForceN + kForceShare and the force of the port's dampers for one step of a reading. Not for all patches, as
//               friction depends on the path by which a trembling hand came. A device that nobody holds is at rest while it stays
//               within kRestM for kRestTicks
#pragma once

#include <array>
#include <deque>
#include <optional>

#include "bench/world/check.hpp"

namespace palpate {

class CountersCheck final : public Check {
 public:
  CountersCheck(const std::vector<StationBounds>& bounds, const World& world)
      : Check("counters"), bounds_(bounds), world_(world), last_(bounds.size()) {}
  void tick(const SeenTick& seen) override;
  void new_life(Micros, std::size_t station) override { last_[station].clear(); }
  void new_server(Micros) override { server_.clear(); }
  /// Compares a counter with its earlier values.
  void compare(Micros at, const std::string& name, std::vector<std::uint64_t>& before, std::vector<std::uint64_t> now);

 private:
  static constexpr int kEvery = 16;  // ticks
  const std::vector<StationBounds>& bounds_;
  const World& world_;
  std::vector<std::vector<std::uint64_t>> last_;
  std::vector<std::uint64_t> server_;
  int ticks_ = 0;
};

class RecoveryCheck final : public Check {
 public:
  static constexpr double kForceN = 0.05, kForceShare = 0.05;
  static constexpr double kFlickerMS = 0.006;  ///< velocity from a reading step of 0.03 mm within a stage of the body
  static constexpr double kShare = 0.5;
  static constexpr int kNearTicks = 5;
  static constexpr double kRestM = 0.002;
  static constexpr int kRestTicks = 300;
  RecoveryCheck(const std::vector<StationBounds>& bounds, const World& world)
      : Check("recovery"), bounds_(bounds), world_(world), seen_(bounds.size()) {}
  void tick(const SeenTick& seen) override;
  void datagram(Micros now, const DatagramEvent& event, const Message* message) override;
  void new_life(Micros, std::size_t station) override { seen_[station] = {}; }
  void end(Micros now) override;
  double worst_n() const { return worst_n_; }  ///< largest difference of felt and true force

 private:
  struct Felt {
    Micros now{}, own{};
    Vec3 force = Vec3::Zero(), position = Vec3::Zero();
  };
  static bool rests(const std::deque<Felt>& felt);
  struct Station {
    std::deque<Felt> felt;
    bool asked = false, in_reach = true, answered = false;
    int compared = 0, apart = 0;
    std::string worst;  ///< description
    double worst_n = 0;
  };
  static std::deque<Felt>::const_iterator felt_at_rest(const Station& s, const StationBounds& bounds, Micros stamp);

  const std::vector<StationBounds>& bounds_;
  const World& world_;
  std::vector<Station> seen_;
  double worst_n_ = 0;
};

}  // namespace palpate
