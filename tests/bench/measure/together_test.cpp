// Two hands on one body: the effect of each on the other, against the full model with both tools.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "bench/fidelity/ceiling.hpp"
#include "bench/fidelity/reference.hpp"
#include "bench/fidelity/replay.hpp"
#include "bench/measure/tools_apart.hpp"

using namespace palpate;

namespace {

Scene touch_cube() { return load_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/touch-cube.json"); }

}  // namespace

TEST_CASE("Two hands 20 mm apart feel each other through the tissue: the error is small beside what they feel") {
  const Scene scene = touch_cube();
  const std::vector<Motion> motions = tools_apart(scene, 2, 0.020, 1.5);
  ReplayOptions options;
  const auto results = replay_together(scene, motions, options, [] { return std::int64_t{0}; });
  REQUIRE(results.size() == 2);
  for (const ReplayResult& r : results) {
    CHECK(r.ticks.size() == 1501);
    CHECK(r.fidelity.snr_db > 25);                           // about 0 dB if the other tool let go at the stamp
    CHECK(r.patch_bytes_mean <= 2 * 2 * kMaxDatagramBytes);  // with its surface, twice while the link is unknown
  }
}

TEST_CASE(
    "Two hands with different tools feel what the full model feels with these, and not what it feels with one of them for both") {
  Scene scene = touch_cube();
  scene.tools = {{.friction = 0.6, .contact_stiffness_n_m = 300, .radius_m = 0.03, .name = "ball"}};
  scene.tools[0].shape = {{Vec3(0, 0, 0.008), 0.008}};
  const std::vector<Motion> motions = tools_apart(scene, 2, 0.030, 1.5);
  ReplayOptions options;
  options.held = {0, 1};
  const auto results = replay_together(scene, motions, options, [] { return std::int64_t{0}; });
  std::vector<ToolPath> paths(2);
  for (std::size_t k = 0; k < 2; ++k)
    for (const ReplayTick& tick : results[k].ticks) paths[k].push_back(tick.position);
  const std::vector<std::uint8_t> first{0, 0}, second{1, 1};
  const auto wrong = {reference_forces(scene, paths, {}, {}, {}, {}, second)[0].force,
                      reference_forces(scene, paths, {}, {}, {}, {}, first)[1].force};
  for (std::size_t k = 0; k < 2; ++k) {
    std::vector<Vec3> felt;
    for (const ReplayTick& tick : results[k].ticks) felt.push_back(tick.felt);
    const double by_wrong_tool_db = compare(felt, wrong.begin()[k], kSkipTicks).snr_db;
    CAPTURE(k, results[k].fidelity.snr_db, by_wrong_tool_db);
    CHECK(results[k].fidelity.snr_db > 20);
    CHECK(results[k].fidelity.snr_db > by_wrong_tool_db + 6);
  }
}

TEST_CASE("The reference with a second tool far above the body is that of the first alone, and a press beside it is felt") {
  const Scene scene = touch_cube();
  const std::vector<Motion> motions = tools_apart(scene, 2, 0.020, 0.6);
  std::vector<ToolPath> paths(2);
  for (int ms = 0; ms <= 600; ++ms)
    for (std::size_t k = 0; k < 2; ++k) paths[k].push_back(motions[k].position(ms * 1e-3));
  const ReferenceForce alone = reference_force(scene, paths[0]);
  std::vector<ToolPath> apart{paths[0], ToolPath(601, Vec3(0.05, 0.05, 0.3))};
  const auto with_idle = reference_forces(scene, apart);
  double most = 0, felt = 0;
  const auto both = reference_forces(scene, paths);
  for (std::size_t i = 0; i < alone.force.size(); ++i) {
    most = std::max(most, (alone.force[i] - with_idle[0].force[i]).norm());
    felt = std::max(felt, (alone.force[i] - both[0].force[i]).norm());
  }
  CHECK(most < 1e-6);
  CHECK(with_idle[1].contact == std::vector<std::uint8_t>(601, 0));
  CHECK(felt > 0.1);
}

TEST_CASE("What a hand could feel at most is the full model where the other's way is known, and less where it is predicted") {
  const Scene scene = touch_cube();
  const std::vector<Motion> motions = tools_apart(scene, 2, 0.010, 0.8);
  std::vector<ToolPath> paths(2);
  for (int ms = 0; ms <= 800; ++ms)
    for (std::size_t k = 0; k < 2; ++k) paths[k].push_back(motions[k].position(ms * 1e-3));
  // A patch every 50 ms, played from 60 to 110 ms after its stamp.
  std::vector<int> stamp_ms(801, -1);
  for (int ms = 60; ms <= 800; ++ms) stamp_ms[static_cast<std::size_t>(ms)] = (ms - 60) / 50 * 50;
  const std::vector<std::vector<int>> stamps(2, stamp_ms);
  const PathPrediction known = [&](std::span<const Vec3> past, double after_s) {
    const ToolPath& path = past.data() == paths[0].data() ? paths[0] : paths[1];
    return ToolAt{path.at(past.size() - 1 + static_cast<std::size_t>(std::lround(1e3 * after_s))), Vec3::Zero()};
  };
  const auto reference = reference_forces(scene, paths);
  const auto best = ceiling_forces(scene, paths, stamps, known);
  const auto predicted = ceiling_forces(scene, paths, stamps, predicted_to_go_on);
  for (std::size_t k = 0; k < 2; ++k) {
    double off = 0, predicted_off = 0;
    for (std::size_t i = 60; i < paths[k].size(); ++i) {
      off = std::max(off, (best[k].felt.force[i] - reference[k].force[i]).norm());
      predicted_off = std::max(predicted_off, (predicted[k].felt.force[i] - reference[k].force[i]).norm());
    }
    CHECK(off < 1e-4);
    CHECK(predicted_off > 0.02);
    REQUIRE(best[k].steps_n.size() == 14);
    CHECK(*std::ranges::max_element(best[k].steps_n) < 1e-4);
    CHECK(best[k].felt.force[59].isZero(0));
  }
}

TEST_CASE("Two hands 10 mm apart feel each other nearly as anybody can who predicts the other, and no tick of a hand-over") {
  const Scene scene = touch_cube();
  const std::vector<Motion> motions = tools_apart(scene, 2, 0.010, 1.5);
  ReplayOptions options;
  options.link.latency = Micros{30'000};
  const auto results = replay_together(scene, motions, options, [] { return std::int64_t{0}; });
  std::vector<ToolPath> paths(2);
  std::vector<std::vector<int>> stamp_ms(2);
  for (std::size_t k = 0; k < 2; ++k)
    for (std::size_t i = 0; i < results[k].ticks.size(); ++i) {
      const auto age_ms = results[k].ticks[i].patch_age / kTick;
      paths[k].push_back(results[k].ticks[i].position);
      stamp_ms[k].push_back(age_ms < 0 ? -1 : static_cast<int>(static_cast<std::int64_t>(i) - age_ms));
    }
  const auto ceiling = ceiling_forces(scene, paths, stamp_ms, predicted_to_go_on);
  for (std::size_t k = 0; k < 2; ++k) {
    std::vector<Vec3> reference;
    for (const ReplayTick& tick : results[k].ticks) reference.push_back(tick.reference);
    const double most_db = compare(ceiling[k].felt.force, reference, kSkipTicks).snr_db;
    CAPTURE(k, most_db);
    CHECK(results[k].fidelity.snr_db > most_db - 3);
    // What a new patch takes back of the old one is what it knows better of the other hand.
    CHECK(results[k].hand_over.max_n > 0.2);
    CHECK(results[k].hand_over.max_n < 1.1 * *std::ranges::max_element(ceiling[k].steps_n));
    CHECK(results[k].felt_step.max_n < kStepLimitN);
  }
}
