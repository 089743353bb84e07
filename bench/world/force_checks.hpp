// Checks of the felt forces.
//
//   limits     every force is finite, at most the device's peak, and changes by at most its slew limit times the tick
//   fade       without a patch the force is zero; from 50 ms after the validity of the patch in use ended, it is zero; and in the
//              k-th tick after a fresh patch took over from there, it is at most k / 50 of twice the device's peak (the guard may
//              add as much again as is displayed), if the fresh one finds the tool in contact. Once nothing is lost any more,
//              nothing fades, whatever other stations are on the body
//   passivity  E = sum -1/2 (F_before + F_now) . dx over all hands on the body, the energy that they put in and have not got back
//              since none of them felt anything for 50 ms, stays above -kBudgetJ, with kBudgetW per hand forgiven. It is one sum,
//              as one hand may take out what another put into the body. Skipped ticks do not count: the device holds its force
//              in them. Judged only if every hand feels `port`, as the schemes that it replaced promise nothing, and if no hand
//              reacts to another (bench/simulated-worlds.md)
#pragma once

#include <map>
#include <optional>

#include "bench/world/check.hpp"

namespace palpate {

class LimitsCheck final : public Check {
 public:
  explicit LimitsCheck(const std::vector<StationBounds>& bounds) : Check("limits"), bounds_(bounds), last_(bounds.size()) {}
  void tick(const SeenTick& seen) override;
  void new_life(Micros, std::size_t station) override { last_[station].reset(); }

 private:
  const std::vector<StationBounds>& bounds_;
  std::vector<std::optional<SeenTick>> last_;
};

class FadeCheck final : public Check {
 public:
  static constexpr Micros kFade{50'000};
  explicit FadeCheck(const std::vector<StationBounds>& bounds) : Check("fade"), bounds_(bounds), seen_(bounds.size()) {}
  void tick(const SeenTick& seen) override;
  void datagram(Micros now, const DatagramEvent& event, const Message* message) override;
  void new_life(Micros, std::size_t station) override { seen_[station] = {}; }
  std::uint64_t returns() const { return returns_; }  ///< forces that had faded and returned

 private:
  static constexpr int kReturnTicks = 50, kWakeTicks = 3;  ///< kWakeTicks: time for the net side to pass on a patch
  struct Station {
    std::map<Micros, Micros>
        valid_for;  ///< validity of the received patches, by their stamps and by the later ones to which they were renewed
    Micros newest_valid_for{};
    Micros newest_said{};  ///< body time of the newest patch or beat that came
    bool in_reach = true;
    Micros expired_ticks{};           ///< time since the patch in use expired, in ticks
    int needless_ticks = 0;           ///< part of these with the body in reach
    int since_return = kReturnTicks;  ///< ticks since a faded force returned
  };
  void check_return(const SeenTick& seen, Station& s, bool was_faded);

  const std::vector<StationBounds>& bounds_;
  std::vector<Station> seen_;
  std::uint64_t returns_ = 0;
};

class PassivityCheck final : public Check {
 public:
  /// 10 mJ throw a hand of 0.5 kg at 0.2 m/s, or are 1 N over 10 mm. bench/simulated-worlds.md gives the derivation.
  static constexpr double kBudgetJ = 0.01;
  /// Power that the guard gives back to a cut-off hand (Passivity::kReturnW): 1 N that moves at 5 mm/s.
  static constexpr double kBudgetW = 0.005;
  static constexpr int kRestTicks = 50;
  explicit PassivityCheck(const std::vector<StationBounds>& bounds) : Check("passivity"), bounds_(bounds), seen_(bounds.size()) {}
  void tick(const SeenTick& seen) override;
  void new_life(Micros, std::size_t station) override { seen_[station] = {}; }
  double lowest_j() const { return lowest_j_; }

 private:
  struct Station {
    std::optional<SeenTick> last;
    int rest_ticks = kRestTicks;
  };
  const std::vector<StationBounds>& bounds_;
  std::vector<Station> seen_;
  double energy_j_ = 0, lowest_j_ = 0;
};

}  // namespace palpate
