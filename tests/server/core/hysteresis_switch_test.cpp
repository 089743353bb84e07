#include "server/core/hysteresis_switch.hpp"

#include <catch2/catch.hpp>

#include "raw_station.hpp"

using namespace palpate;

namespace {

constexpr Micros kFrame{50'000}, kTime{40'000};

DetailCost cost_of(Micros nonlinear, int stations = 1) { return {kTime, Micros{5'000}, Micros{}, nonlinear, stations}; }

std::uint32_t changes_in(HysteresisSwitch& choice, double length_s, const auto& cost_at) {
  for (Micros t{}; t < from_seconds(length_s); t += kFrame) choice.decide(cost_at(t), 0, t);
  return choice.changes();
}

}  // namespace

TEST_CASE("a nonlinear patch that fits its share of the frame is taken at once, and port where it does not") {
  HysteresisSwitch one, four, lossy;
  CHECK(one.decide(cost_of(Micros{30'000}), 0, {}));  // 40 - 5 = 35 ms
  CHECK(one.reason() == SchemeReason::fits);
  CHECK_FALSE(four.decide(cost_of(Micros{30'000}, 4), 0, {}));
  CHECK(four.reason() == SchemeReason::server_busy);
  CHECK(HysteresisSwitch::left(cost_of(Micros{30'000}, 4)) == Micros{8'750});
  CHECK_FALSE(lossy.decide(cost_of(Micros{30'000}), 0.12, {}));
  CHECK(lossy.reason() == SchemeReason::link_lossy);
}

TEST_CASE("a nonlinear patch is given up in the frame in which it does not fit, and comes back two seconds after it fits again") {
  HysteresisSwitch choice;
  const Micros dear_from{10'000'000}, dear_to{20'000'000};
  Micros gone{}, back{};
  for (Micros t{}; t < Micros{40'000'000}; t += kFrame) {
    const bool dear = t >= dear_from && t < dear_to;
    const bool nonlinear = choice.decide(cost_of(dear ? Micros{40'000} : Micros{20'000}), 0, t);
    if (!nonlinear && gone == Micros{}) gone = t;
    if (nonlinear && gone > Micros{} && back == Micros{}) back = t;
  }
  CHECK(gone == dear_from);
  CHECK(back >= dear_to + HysteresisSwitch::kComesBackAfter);
  CHECK(back <= dear_to + 2 * HysteresisSwitch::kComesBackAfter + kFrame);
  CHECK(choice.changes() == 2);
}

TEST_CASE("what nobody has measured is tried, but not over a link that loses much") {
  HysteresisSwitch open, lossy;
  CHECK(open.decide(cost_of(Micros{}), 0, {}));
  CHECK(open.reason() == SchemeReason::not_known_yet);
  CHECK_FALSE(open.decide(cost_of(Micros{36'000}), 0, kFrame));
  CHECK(open.reason() == SchemeReason::server_busy);
  CHECK_FALSE(lossy.decide(cost_of(Micros{}), 0.12, {}));
}

TEST_CASE("a cost that swings about the threshold does not make the scheme flap") {
  HysteresisSwitch near, far;
  // Within the hysteresis: dropped once, never chosen again.
  CHECK(changes_in(near, 600,
                   [](Micros t) { return cost_of(t.count() % 300'000 < 150'000 ? Micros{34'000} : Micros{36'000}); }) <= 1);
  // Beyond it, with a period that lets it return each time at first: two changes for each doubling of the wait, no more.
  CHECK(changes_in(far, 600,
                   [](Micros t) { return cost_of(t.count() % 10'000'000 < 8'000'000 ? Micros{10'000} : Micros{40'000}); }) <= 6);
}

TEST_CASE("nonlinear patches that cannot be had are given up by what it takes to try them") {
  Bench bench;
  bench.room.built = Scheme::port;
  bench.room.step_took = Micros{5'000};
  bench.room.patches_took = Micros{60'000};
  RawStation hand(bench, 1, "hand");
  hand.hello.scheme = std::nullopt;
  hand.join().live();
  hand.live(Micros{500'000});
  CHECK(bench.room.jobs.front().stations.at(0).scheme == Scheme::hyper);
  CHECK(bench.room.jobs.back().stations.at(0).scheme == Scheme::port);
}
