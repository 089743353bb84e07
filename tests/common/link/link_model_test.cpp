#include <catch2/catch.hpp>
#include <vector>

#include "common/base/error.hpp"
#include "common/link/delay_queue.hpp"
#include "common/link/link_model.hpp"

using namespace palpate;

namespace {

struct Run {
  std::vector<Deliveries> deliveries;
  LinkCounts counts;
};

Run run(const LinkSpec& spec, int datagrams, Micros every = Micros{2000}, std::size_t bytes = 500) {
  LinkModel link(spec);
  Run result;
  for (int i = 0; i < datagrams; ++i) result.deliveries.push_back(link.schedule(every * i, bytes));
  result.counts = link.counts();
  return result;
}

struct Losses {
  double share = 0, burst_mean = 0;
};

Losses losses(const Run& run) {
  int lost = 0, bursts = 0;
  bool before = false;
  for (const auto& d : run.deliveries) {
    const bool now = d.count == 0;
    lost += now;
    bursts += now && !before;
    before = now;
  }
  return {static_cast<double>(lost) / static_cast<double>(run.deliveries.size()),
          bursts ? static_cast<double>(lost) / bursts : 0};
}

std::vector<Micros> first_copies(const Run& run) {
  std::vector<Micros> at;
  for (const auto& d : run.deliveries)
    if (d.count > 0) at.push_back(d.at[0]);
  return at;
}

}  // namespace

TEST_CASE("a clean link delays everything by its latency") {
  const Run result = run({.latency = Micros{30'000}}, 100);
  for (std::size_t i = 0; i < result.deliveries.size(); ++i) {
    REQUIRE(result.deliveries[i].count == 1);
    CHECK(result.deliveries[i].at[0] == Micros{2000} * static_cast<int>(i) + Micros{30'000});
  }
}

TEST_CASE("losses have the share and the mean burst that were asked for") {
  for (const double loss : {0.01, 0.03, 0.2, 0.6})
    for (const double burst : {0.0, 1.0, 4.0, 10.0}) {
      const Losses seen = losses(run({.loss = loss, .burst_mean = burst, .seed = 5}, 400'000));
      CAPTURE(loss, burst);
      const double expected_burst = std::max(burst, 1 / (1 - loss));
      CHECK(seen.share == Approx(loss).epsilon(0.12));
      CHECK(seen.burst_mean == Approx(expected_burst).epsilon(0.08));
    }
  CHECK(losses(run({.loss = 1.0}, 1000)).share == 1);
  CHECK(losses(run({.loss = 0.0}, 1000)).share == 0);
}

TEST_CASE("jitter is uniform about the latency, bounded, and keeps the order") {
  const Run slow = run({.latency = Micros{60'000}, .jitter = Micros{10'000}}, 20'000, Micros{30'000});
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < slow.deliveries.size(); ++i) {
    const auto delay = slow.deliveries[i].at[0] - Micros{30'000} * static_cast<int>(i);
    REQUIRE((delay >= Micros{50'000} && delay <= Micros{70'000}));
    sum += seconds(delay);
    squares += seconds(delay) * seconds(delay);
  }
  const double n = static_cast<double>(slow.deliveries.size()), mean = sum / n;
  CHECK(mean == Approx(0.06).epsilon(0.005));
  CHECK(std::sqrt(squares / n - mean * mean) == Approx(0.01 / std::sqrt(3.0)).epsilon(0.03));

  const auto dense = first_copies(run({.latency = Micros{60'000}, .jitter = Micros{10'000}, .loss = 0.1}, 20'000, Micros{500}));
  CHECK(std::is_sorted(dense.begin(), dense.end()));
}

TEST_CASE("datagrams overtake each other only when reordering asks for it") {
  const Run result = run({.latency = Micros{60'000}, .jitter = Micros{3'000}, .reorder = 0.05}, 20'000);
  const auto at = first_copies(result);
  CHECK_FALSE(std::is_sorted(at.begin(), at.end()));
  CHECK(static_cast<double>(result.counts.reordered) / 20'000 == Approx(0.05).epsilon(0.1));
}

TEST_CASE("a duplicate comes with the share that was asked for") {
  const Run result = run({.latency = Micros{1000}, .duplicate = 0.1}, 50'000);
  CHECK(static_cast<double>(result.counts.duplicated) / 50'000 == Approx(0.1).epsilon(0.05));
  for (const auto& d : result.deliveries) CHECK((d.count == 1 || d.at[0] == d.at[1]));
}

TEST_CASE("the wire carries its bandwidth and no more, and a full backlog drops the newest") {
  // 972 + 28 bytes at 1000 kbit/s: 8 ms each, offered once per millisecond.
  const Run result = run({.kbit_s = 1000}, 4000, Micros{1000}, 972);
  const auto at = first_copies(result);
  for (std::size_t i = 1; i < at.size(); ++i) REQUIRE(at[i] - at[i - 1] >= Micros{7999});
  CHECK(static_cast<double>(at.size()) == Approx(4000 / 8 + LinkModel::kMaxBacklog.count() / 8000.0).margin(3));
  CHECK(result.counts.queue_dropped == 4000 - at.size());
  CHECK(at.back() <= Micros{4'000'000} + LinkModel::kMaxBacklog + Micros{8000});
  const Run light = run({.kbit_s = 1000}, 100, Micros{10'000}, 972);
  for (std::size_t i = 0; i < 100; ++i) CHECK(light.deliveries[i].at[0] == Micros{10'000} * static_cast<int>(i) + Micros{8000});
}

TEST_CASE("one seed gives one link, another seed another") {
  const LinkSpec spec{.latency = Micros{60'000},
                      .jitter = Micros{10'000},
                      .loss = 0.03,
                      .burst_mean = 3,
                      .duplicate = 0.01,
                      .reorder = 0.02,
                      .kbit_s = 4000,
                      .seed = 7};
  LinkSpec other = spec;
  other.seed = 8;
  CHECK(first_copies(run(spec, 5000)) == first_copies(run(spec, 5000)));
  CHECK(first_copies(run(spec, 5000)) != first_copies(run(other, 5000)));
}

TEST_CASE("a link can heal") {
  LinkModel link({.loss = 1});
  CHECK(link.schedule(Micros{0}, 100).count == 0);
  link.change({.latency = Micros{5}});
  link.schedule(Micros{1}, 100);
  CHECK(link.schedule(Micros{2}, 100).at[0] == Micros{7});
}

TEST_CASE("a spec out of range is refused with what was expected") {
  CHECK_THROWS_AS(LinkModel({.latency = Micros{-1}}), InputError);
  CHECK_THROWS_AS(LinkModel({.loss = 1.5}), InputError);
  CHECK_THROWS_AS(LinkModel({.kbit_s = std::nan("")}), InputError);
  CHECK_THROWS_WITH(validate({.reorder = -0.5}, "relay"),
                    Catch::Contains("relay: reorder is -0.5") && Catch::Contains("expected a share"));
}

TEST_CASE("a delay queue gives items by due moment, and equal ones in the order of entry") {
  DelayQueue<int> queue;
  for (const int due : {5, 3, 9, 3, 5, 3}) queue.push(Micros{due}, due * 100 + static_cast<int>(queue.size()));
  CHECK_FALSE(queue.pop(Micros{2}));
  std::vector<int> order;
  while (const auto item = queue.pop(Micros{8})) order.push_back(*item);
  CHECK(order == std::vector<int>{301, 303, 305, 500, 504});
  CHECK(queue.next_due() == Micros{9});
}
