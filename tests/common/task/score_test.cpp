// The score of a training task against what a pencil makes of it.
#include "common/task/score.hpp"

#include <catch2/catch.hpp>
#include <cmath>

namespace palpate {
namespace {

constexpr double kFrameS = 0.05;

/// Frames of 20 Hz from a function of the time.
template <class Sample>
TaskProgress judged(const Task& task, double until_s, const Sample& sample) {
  TaskScorer scorer(task);
  for (int k = 0; k <= std::lround(until_s / kFrameS); ++k) {
    TaskSample s = sample(k * kFrameS);
    s.t_s = k * kFrameS;
    scorer.add(s);
  }
  return scorer.progress();
}

TaskSample touching(const Vec3& tool, double force_n = 1, std::uint32_t buttons = 0) {
  return {0, tool, Vec3(0, 0, force_n), force_n > 0, buttons};
}

const Task kPress{"", PressTask{0.8, 1.2, 2}};
/// A line along x, on the plane z = 0, then along y.
const Task kTrace{"", TraceTask{{{Vec3(0, 0, 0)}, {Vec3(0.04, 0, 0)}, {Vec3(0.04, 0.04, 0)}}, 0.002}};
const Task kFind{"", FindTask{Vec3(0, 0, -0.02), Vec3(0, 0, 0), 0.01, 0.01}};

}  // namespace

TEST_CASE("pressing scores the longest time in the band without a break", "[task]") {
  const auto steady = [](double t) { return touching(Vec3::Zero(), t < 0.5 ? 0 : 1); };
  CHECK(judged(kPress, 3, steady).score == 100);
  CHECK(judged(kPress, 3, steady).time_s == Approx(2));  // it ends when it is done
  CHECK(judged(kPress, 1.5, steady).score == Approx(50));
  CHECK(judged(kPress, 1.5, steady).held_s == Approx(1));
  // In the band for 0.6 s of each second: the parts do not add up.
  CHECK(judged(kPress, 10, [](double t) { return touching(Vec3::Zero(), std::fmod(t + 1e-9, 1) < 0.6 ? 1 : 2); }).score ==
        Approx(30));
  CHECK(judged(kPress, 3, [](double) { return touching(Vec3::Zero(), 1.3); }).score == 0);
  CHECK(judged(kPress, 3, [](double) { return touching(Vec3::Zero(), 0.7); }).score == 0);
  CHECK(judged(kPress, 3, [](double) { return touching(Vec3::Zero(), 1.3); }).force_max_n == 1.3);
}

TEST_CASE("a force counts for a quarter of a second at most", "[task]") {
  TaskScorer scorer(kPress);
  for (const double t_s : {0.0, 0.1, 1.1}) scorer.add({t_s, Vec3::Zero(), Vec3(0, 0, 1), true, 0});
  CHECK(scorer.progress().held_s == Approx(0.1 + kTaskHoldMostS));
  scorer.add({0.5, Vec3::Zero(), Vec3(0, 0, 9), true, 0});  // older than the last: it never was
  CHECK(scorer.progress().force_max_n == 1);
}

TEST_CASE("a line followed to its end within its tolerance scores in full, at any depth", "[task]") {
  const auto path = [](double t, double aside_m, double depth_m) {
    const double s = std::min(0.02 * t, 0.08);
    return touching(s < 0.04 ? Vec3(s, aside_m, -depth_m) : Vec3(0.04 + aside_m, s - 0.04, -depth_m));
  };
  const TaskProgress good = judged(kTrace, 5, [&](double t) { return path(t, 0.001, 0.008); });
  CHECK(good.finished());
  CHECK(good.score == Approx(100).margin(3));  // the corner: a step across it
  CHECK(good.miss_m == Approx(0.001).margin(5e-4));
  CHECK(judged(kTrace, 5, [&](double t) { return path(t, 0.003, 0); }).score == 0);  // beside the line all the time
  const TaskProgress half = judged(kTrace, 2, [&](double t) { return path(t, 0, 0); });
  CHECK(half.score == Approx(50));
  CHECK(half.traced_m == Approx(0.04));
  CHECK(judged(kTrace, 5, [&](double t) { return path(t, 0, kDepthMostM + 0.001); }).score == 0);  // through the body
}

TEST_CASE("a line has a direction, and cannot be skipped", "[task]") {
  const auto at = [](double s) { return touching(s < 0.04 ? Vec3(s, 0, 0) : Vec3(0.04, s - 0.04, 0)); };
  CHECK(judged(kTrace, 5, [&](double t) { return at(std::max(0.08 - 0.02 * t, 0.0)); }).traced_m < kStrideM + 0.002);
  CHECK(judged(kTrace, 1, [&](double t) { return t < 0.5 ? at(0) : at(0.08); }).score < 15);
  const auto lifted = judged(kTrace, 5, [&](double t) {
    TaskSample sample = at(std::min(0.02 * t, 0.08));
    sample.contact = t < 1 || t > 2;
    return sample;
  });
  CHECK(lifted.traced_m == Approx(0.02).margin(1e-3));
}

TEST_CASE("the part of the path that leaves the line costs its share", "[task]") {
  // 10 mm along, 20 mm aside and back, then to the end.
  const auto astray = [](double t) {
    const double s = 0.02 * t;
    if (s < 0.01) return touching(Vec3(s, 0, 0));
    if (s < 0.03) return touching(Vec3(0.01, -(s - 0.01), 0));
    if (s < 0.05) return touching(Vec3(0.01, -(0.05 - s), 0));
    const double on = std::min(s - 0.04, 0.08);
    return touching(on < 0.04 ? Vec3(on, 0, 0) : Vec3(0.04, on - 0.04, 0));
  };
  const TaskProgress p = judged(kTrace, 8, astray);
  CHECK(p.finished());
  // 80 mm on the line, 40 mm off it, of which the first and last 2 mm are within the tolerance
  CHECK(p.within == Approx(84.0 / 120).margin(0.03));
  CHECK(p.miss_m == Approx(0.02).margin(1.1e-3));
}

TEST_CASE("a mark scores by its distance from the lump", "[task]") {
  const auto marked = [](const Vec3& at) {
    return judged(kFind, 1, [&](double t) { return touching(at, 1, t > 0.4 && t < 0.6 ? 1 : 0); });
  };
  CHECK(marked(Vec3(0.009, 0, 0)).score == 100);
  CHECK(marked(Vec3(0.02, 0, 0)).score == Approx(50));
  CHECK(marked(Vec3(0.02, 0, -0.01)).score == Approx(50));  // pressed in towards it
  CHECK(marked(Vec3(0.031, 0, 0)).score == 0);
  CHECK(marked(Vec3(0, 0, -0.06)).score == 0);  // from the other side of the body
  CHECK(marked(Vec3(0.02, 0, 0)).miss_m == Approx(0.02));
}

TEST_CASE("only the first press of a button while touching is a mark", "[task]") {
  const auto pressed = [](double from, double to, auto contact) {
    return judged(kFind, 3, [&](double t) {
      TaskSample s = touching(Vec3(0.01 * t, 0, 0), 1, t > from && t < to ? 2 : 0);
      s.contact = contact(t);
      return s;
    });
  };
  const auto always = [](double) { return true; };
  CHECK_FALSE(pressed(5, 6, always).mark);
  CHECK_FALSE(pressed(0.1, 0.9, [](double t) { return t > 0.5; }).mark);  // it was down before the touch
  CHECK(pressed(0.52, 0.9, always).mark->x() == Approx(0.0055));
  const TaskProgress twice =
      judged(kFind, 3, [](double t) { return touching(Vec3(0.01 * t, 0, 0), 1, std::fmod(t, 1) > 0.52 ? 1 : 0); });
  CHECK(twice.mark->x() == Approx(0.0055));
}

}  // namespace palpate
