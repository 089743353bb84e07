#include "common/base/sample_history.hpp"

#include <catch2/catch.hpp>
#include <deque>

#include "common/base/random.hpp"

using namespace palpate;

namespace {

ToolSample sample_at(int ms) { return {Micros{1000 * ms}, Vec3(ms, 0, 0)}; }

}  // namespace

TEST_CASE("A history keeps the newest samples and finds them by time") {
  SampleHistory<ToolSample> history(4096);
  CHECK(history.first_after(Micros{0}) == 0);
  for (int ms = 0; ms < 4596; ++ms) history.add(sample_at(ms));
  CHECK(history.size() == 4096);
  CHECK(history.oldest().t == sample_at(500).t);
  CHECK(history.newest().t == sample_at(4595).t);
  CHECK(history.first_after(sample_at(700).t) == 201);
  CHECK(history.first_after(sample_at(700).t - Micros{1}) == 200);
  CHECK(history.first_after(Micros{0}) == 0);
  CHECK(history.first_after(sample_at(1'000'000).t) == history.size());
}

TEST_CASE("A history holds what a queue would, whatever is added and dropped at either end") {
  constexpr std::size_t kMost = 7;
  SampleHistory<ToolSample> history(kMost);
  std::deque<ToolSample> queue;
  Random random(3);
  int ms = 0;
  for (int k = 0; k < 5000; ++k) {
    if (random.chance(0.6)) {
      history.add(sample_at(++ms));
      queue.push_back(sample_at(ms));
      if (queue.size() > kMost) queue.pop_front();
    } else if (random.chance(0.5) && !queue.empty()) {
      history.drop_newest();
      queue.pop_back();
    } else {
      const Micros t = sample_at(ms - static_cast<int>(random.uniform(0, 5))).t;
      history.forget_before(t);
      while (queue.size() > 1 && queue[1].t <= t) queue.pop_front();
    }
    REQUIRE(history.size() == queue.size());
    for (std::size_t i = 0; i < queue.size(); ++i) REQUIRE(history[i].t == queue[i].t);
  }
}
