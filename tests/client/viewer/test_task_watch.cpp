// The progress of a training task at a viewer.
#include "client/viewer/task_watch.hpp"

#include <catch2/catch.hpp>

namespace palpate {
namespace {

Tools tools_at(int frame, double force_n, std::uint32_t buttons = 0) {
  Tools tools{static_cast<std::uint32_t>(frame), Micros{50'000 * frame}, 0, {}};
  tools.tools.push_back({"anna", Vec3::Zero(), Vec3(0, 0, force_n), force_n > 0, {}, buttons});
  return tools;
}

}  // namespace

TEST_CASE("every hand has its own attempt, and a reset begins a new one", "[view]") {
  TaskWatch watch;
  watch.take(tools_at(0, 1));
  CHECK(watch.hands().empty());
  watch.take(Task{"hold", PressTask{0.5, 2, 1}});
  watch.take_resets(3);
  for (int k = 0; k <= 10; ++k) watch.take(tools_at(k, 1));
  REQUIRE(watch.hands().size() == 1);
  CHECK(watch.hands()[0].station == "anna");
  CHECK(watch.hands()[0].progress.score == Approx(50));
  CHECK(watch.hands()[0].force_n == 1);
  watch.take(Task{"hold", PressTask{0.5, 2, 1}});  // repeated
  watch.take_resets(3);
  CHECK(watch.hands()[0].progress.score == Approx(50));
  watch.take_resets(4);
  CHECK(watch.hands().empty());
  watch.take(tools_at(11, 1));
  CHECK(watch.hands()[0].progress.score == 0);
  watch.take(Task{"another", PressTask{0.5, 2, 1}});
  CHECK(watch.hands().empty());
}

TEST_CASE("a hand that touched stays in the list when it leaves, one that did not goes", "[view]") {
  TaskWatch watch;
  watch.take(Task{"find", FindTask{Vec3::Zero(), Vec3::Zero(), 0.01, 0.01}});
  Tools both = tools_at(1, 1);
  both.tools.push_back({"bert", Vec3::Zero(), Vec3::Zero(), false});
  watch.take(both);
  CHECK(watch.hands().size() == 2);
  CHECK_FALSE(watch.marked());
  watch.take(tools_at(2, 1, 1));
  CHECK(watch.hands().size() == 1);
  CHECK(watch.marked());
  watch.take(Tools{3, Micros{150'000}, 0, {}});
  CHECK(watch.hands().size() == 1);
  watch.clear();
  CHECK(watch.task() == nullptr);
}

}  // namespace palpate
