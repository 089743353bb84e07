// The model observer of `palpate-lab lump` against closed forms.
#include "bench/measure/lump_trial.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

using namespace palpate;

namespace {

constexpr double kOmega = 2 * std::numbers::pi, kSwingM = 0.0025, kStiffness = 80;

/// A spring that is felt late by some time, pressed as the observer does, without tremor.
FeltStiffness felt_late(double late_s) {
  std::vector<Vec3> position, force;
  const auto depth = [](double t_s) { return 0.005 + kSwingM * std::sin(kOmega * (t_s - 0.5)); };
  for (int i = 0; i < 3500; ++i) {
    position.push_back(Vec3(0, 0, -depth(1e-3 * i)));
    force.push_back(Vec3(0, 0, kStiffness * depth(1e-3 * i - late_s)));
  }
  return felt_stiffness(position, force);
}

}  // namespace

TEST_CASE("a spring is felt as stiff as it is, and a late one by the part in phase", "[lump]") {
  CHECK(felt_late(0).stiffness_n_m == Approx(kStiffness));
  CHECK(felt_late(0).spread_n_m == Approx(0).margin(1e-6));
  for (const double late_s : {0.05, 0.15, 0.3}) {
    CHECK(felt_late(late_s).stiffness_n_m == Approx(kStiffness * std::cos(kOmega * late_s)).margin(0.2));
    CHECK(felt_late(late_s).spread_n_m ==
          Approx(kStiffness * std::abs(std::sin(kOmega * late_s)) / std::sqrt(kLooks - 2)).margin(0.2));
  }
}

TEST_CASE("the index is one where the stiffness differs by the Weber fraction, and spread lowers it", "[lump]") {
  CHECK(detection_index({115, 0}, {100, 0}, 0.15) == Approx(1));
  CHECK(detection_index({115, 8}, {100, 0}, 0.15) == Approx(15 / 17.0));
  CHECK(detection_index({100, 3}, {100, 3}, 0.15) == 0);
}

TEST_CASE("the detectable diameter lies where the index passes one for good", "[lump]") {
  CHECK(detectable_diameter_m(std::vector<IndexAt>{{0.01, 0.5}, {0.02, 1.5}}) == Approx(0.015));
  CHECK(detectable_diameter_m(std::vector<IndexAt>{{0.01, 2}, {0.02, 3}}) == 0.01);
  CHECK(detectable_diameter_m(std::vector<IndexAt>{{0.01, 2}, {0.02, 0.5}, {0.03, 1.5}}) == Approx(0.025));
  CHECK(detectable_diameter_m(std::vector<IndexAt>{{0.01, 0.2}, {0.02, 0.5}}) < 0);
}

TEST_CASE("a larger and a stiffer lump is felt as stiffer", "[lump]") {
  const auto at = [](double diameter_m, double ratio) {
    const Scene scene = lump_scene(diameter_m, ratio);
    const Motion motion = lump_press(scene);
    const ReferenceForce reference = reference_of(scene, motion);
    std::vector<Vec3> path;
    for (std::size_t i = 0; i < reference.force.size(); ++i) path.push_back(motion.position(1e-3 * static_cast<double>(i)));
    return felt_stiffness(path, reference.force);
  };
  const FeltStiffness none = at(0, 1), small = at(0.012, 4), large = at(0.024, 4), hard = at(0.024, 30);
  CHECK(none.stiffness_n_m > 20);
  CHECK(none.spread_n_m < 0.1 * none.stiffness_n_m);
  CHECK(small.stiffness_n_m > none.stiffness_n_m);
  CHECK(large.stiffness_n_m > small.stiffness_n_m);
  CHECK(hard.stiffness_n_m > large.stiffness_n_m);
  CHECK(at(0.024, 1).stiffness_n_m == Approx(none.stiffness_n_m).epsilon(1e-9));
}
