// Figures of masking for sequences with known results.
#include "bench/fidelity/metrics.hpp"

#include <catch2/catch.hpp>

using namespace palpate;

namespace {

std::vector<std::uint8_t> contact(std::initializer_list<std::pair<int, int>> spans, int length = 3000) {
  std::vector<std::uint8_t> c(static_cast<std::size_t>(length), 0);
  for (const auto& [from, until] : spans) std::fill(c.begin() + from, c.begin() + until, std::uint8_t{1});
  return c;
}

}  // namespace

TEST_CASE("Onsets are compared with the nearest ones shown, early negative and late positive") {
  const auto truth = contact({{500, 600}, {1000, 1200}, {2000, 2100}});
  const OnsetErrors same = onset_errors(truth, truth);
  CHECK(same.onsets == 3);
  CHECK(same.missed == 0);
  CHECK(same.worst_ms == 0);
  const OnsetErrors off = onset_errors(contact({{497, 600}, {1001, 1200}, {2040, 2100}}), truth);
  CHECK(off.missed == 0);
  CHECK(off.median_ms == 1);
  CHECK(off.worst_ms == 40);
  CHECK(onset_errors(contact({{440, 600}, {1001, 1200}, {2040, 2100}}), truth).worst_ms == -60);
}

TEST_CASE("An onset that is shown too late or not at all is missed, and one shortly after another contact is none") {
  const auto truth = contact({{500, 600}, {640, 700}, {2000, 2100}});
  const OnsetErrors e = onset_errors(contact({{510, 700}}), truth);
  CHECK(e.onsets == 2);
  CHECK(e.missed == 1);
  CHECK(e.worst_ms == 10);
  CHECK(onset_errors(contact({}), truth).missed == 2);
  CHECK(onset_errors(contact({{0, 3000}}), contact({})).onsets == 0);
}

TEST_CASE("A step at a swap may be 0.05 N or 5 % of the force, whichever is larger") {
  const std::vector<HandOver> swaps{{0.05, 0.1}, {0.0501, 0.1}, {0.1, 2}, {0.11, 2}, {0.01, 0}};
  const HandOverSteps steps = hand_over_steps(swaps);
  CHECK(steps.swaps == 5);
  CHECK(steps.share_within == Approx(0.6));
  CHECK(steps.max_n == Approx(0.11));
  CHECK(steps.p50_n == Approx(0.0501));
  CHECK(steps.p999_n == Approx(0.11));
  CHECK(hand_over_steps({}).share_within == 1);
}

TEST_CASE("Ticks in which nothing pushes are no contact, and silence has none at all") {
  std::vector<Vec3> reference(1000, Vec3::Zero());
  CHECK(compare(reference, reference, 250).contact_ticks == 0);
  for (std::size_t i = 200; i < 400; ++i) reference[i] = Vec3::UnitZ();
  CHECK(compare(reference, reference, 250).contact_ticks == 150);
}
