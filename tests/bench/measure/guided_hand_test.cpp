// A guided hand in the loop of simulated hands, devices, cores and links.
#include "bench/measure/guided_hand.hpp"

#include <catch2/catch.hpp>

#include "bench/paper/cube.hpp"
#include "client/core/guidance.hpp"
#include "common/base/error.hpp"

using namespace palpate;

namespace {

GuidedPoint in_the_air(const char* hand, double guide_rtt_ms, double guided_rtt_ms) {
  return {false, hand, guide_rtt_ms, guided_rtt_ms, 0, 0, 1};
}

}  // namespace

TEST_CASE("A hand that lets itself be led follows its guide over every link, calmly and without gaining energy") {
  const auto [guide_ms, guided_ms] = GENERATE(std::pair{0.0, 0.0}, std::pair{300.0, 300.0}, std::pair{20.0, 300.0});
  CAPTURE(guide_ms, guided_ms);
  const GuidedResult r = measure_guided(paper_cube(ContactKind::touch), in_the_air("led", guide_ms, guided_ms));
  CHECK(r.stable());
  CHECK(r.generated_j <= r.bound_j);
  CHECK(r.body_max_n == 0);
  CHECK(r.step_max_n < GuidanceCoupling::kStepMostN);
  CHECK(r.guided_mean_n > 0.1);
  CHECK(r.lagged_rms_m < r.error_rms_m + 1e-12);
  CHECK(r.lag_s > 0.5e-3 * (guide_ms + guided_ms));  // no earlier than the samples come
  CHECK(r.loops[0].haptic.holds == 1);
  CHECK(r.loops[1].haptic.holds == 1);
}

TEST_CASE("On a body both hands press it while one guides the other, and come to rest") {
  const auto [hand, rtt_ms] =
      GENERATE(std::pair{"led", 0.0}, std::pair{"resting", 300.0}, std::pair{"free", 300.0}, std::pair{"led", 300.0});
  CAPTURE(hand, rtt_ms);
  const GuidedResult r = measure_guided(paper_cube(ContactKind::touch, 0.2), {true, hand, rtt_ms, rtt_ms, 0, 0, 1});
  CHECK(r.body_max_n > 0.3);
  CHECK(r.stable());
  CHECK(r.generated_j <= r.bound_j);
}

TEST_CASE("A device that nobody holds is led over two round trips of 300 ms, and two runs are equal") {
  const Scene scene = paper_cube(ContactKind::touch);
  const GuidedResult first = measure_guided(scene, in_the_air("free", 300, 300));
  CHECK(first.stable());
  CHECK(first.generated_j <= first.bound_j);
  const GuidedResult second = measure_guided(scene, in_the_air("free", 300, 300));
  CHECK(second.error_rms_m == first.error_rms_m);
  CHECK(second.guided_mean_n == first.guided_mean_n);
}

TEST_CASE("A hand that is no kind of guided hand is refused by name") {
  CHECK_THROWS_AS(measure_guided(paper_cube(ContactKind::touch), in_the_air("firm", 0, 0)), InputError);
}
