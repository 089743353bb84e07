// Hands that jab at a stiffening body from all sides, deeper and faster than it can follow.
#include <catch2/catch.hpp>

#include "common/base/random.hpp"
#include "server/room/room.hpp"

using namespace palpate;

namespace {

constexpr Micros kWildFrame{50'000}, kSample{1'000};

class WildHands {
 public:
  WildHands(std::size_t count, std::uint64_t seed, const Scene& scene) : home_(home_of(scene)), random_(seed), room_(scene) {
    for (std::size_t k = 0; k < count; ++k)
      at_.push_back(home_ + Vec3(0.012 * static_cast<double>(k) - 0.006 * static_cast<double>(count), 0, 0.002));
    goals_ = at_;
    room_.start(now_);
  }

  /// Runs one frame in which each hand sometimes moves to a new place within `reach_m`, or away from the body.
  FrameResult frame(double reach_m, bool away = false) {
    static constexpr std::array kSchemes{Scheme::port, Scheme::hyper, Scheme::tangent, Scheme::ring, Scheme::hold};
    FrameJob job;
    job.target = now_ + kWildFrame;
    job.frame = kWildFrame;
    job.shapes = true;
    for (std::size_t k = 0; k < at_.size(); ++k) {
      StationJob station;
      station.id = static_cast<StationId>(k + 1);
      station.scheme = kSchemes[k % kSchemes.size()];
      station.horizon = Micros{150'000};
      job.stations.push_back(station);
    }
    for (Micros t = now_; t <= job.target; t += kSample)
      for (std::size_t k = 0; k < at_.size(); ++k) {
        if (away)
          goals_[k] = home_ + Vec3(0, 0, 0.08);
        else if (random_.chance(0.01))
          goals_[k] = home_ + reach_m * Vec3(random_.uniform(-1, 1), random_.uniform(-1, 1), random_.uniform(-1, 0.3));
        at_[k] += 0.05 * (goals_[k] - at_[k]);
        job.stations[k].samples.push_back({t, at_[k]});
      }
    now_ = job.target;
    return room_.run(job);
  }

 private:
  Vec3 home_;
  Random random_;
  Room room_;
  Micros now_{1'000'000};
  std::vector<Vec3> at_, goals_;
};

Scene buckling_organ() { return load_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/organ-buckling.json"); }

}  // namespace

TEST_CASE("A frame that was beyond the body does not stop those that follow") {
  const auto& [hands, seed, reach_m] = GENERATE(std::tuple<std::size_t, std::uint64_t, double>{4, 1, 0.04},
                                                std::tuple<std::size_t, std::uint64_t, double>{8, 2, 0.05});
  WildHands wild(hands, seed, buckling_organ());
  int failed = 0;
  for (int k = 0; k < 26; ++k) {
    const FrameResult result = wild.frame(reach_m);
    failed += result.failed ? 1 : 0;
    for (const StationFrame& frame : result.stations)
      if (frame.patch) CHECK(check(*frame.patch) == PatchFault::none);
  }
  CHECK(failed <= 1);
  FrameResult last;
  for (int k = 0; k < 10; ++k) last = wild.frame(0, true);
  CHECK_FALSE(last.failed);
  const FrameResult rest = wild.frame(0, true);
  REQUIRE(rest.positions.size() == last.positions.size());
  for (std::size_t i = 0; i < rest.positions.size(); ++i) CHECK((rest.positions[i] - last.positions[i]).norm() < 1e-3);
}
