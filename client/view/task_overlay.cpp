#include "client/view/task_overlay.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "client/view/round_125.hpp"

namespace palpate {
namespace {

constexpr float kPad = 14, kRow = 40, kBar = 9, kLeastWidth = 330, kBand = 46;
constexpr std::size_t kMostHands = 4;
const Vec3f kGood(0.10F, 0.62F, 0.36F), kTarget(0.04F, 0.75F, 0.86F), kRim(0.05F, 0.06F, 0.10F);

Vec3f color_of(const Sight& sight, const std::string& station) {
  for (std::size_t i = 0; i < sight.tools.size(); ++i)
    if (sight.tools[i].station == station) return station_color(sight.hue(i));
  return Vec3f::Constant(0.5F);
}

/// Draws a scale of the force with the band of `press` and a mark for each hand.
void draw_band(const Pen& pen, const Sight& sight, const PressTask& press, const std::vector<TaskWatch::Hand>& hands, float x,
               float y, float width) {
  const float most = round_up_125(1.5F * static_cast<float>(press.max_n)), high = kBar * pen.scale;
  const auto at = [&](double force_n) { return x + width * std::clamp(static_cast<float>(force_n) / most, 0.0F, 1.0F); };
  pen.list.AddRectFilled({x, y}, {x + width, y + high}, packed(pen.theme.ink_soft, 0.22F), 3 * pen.scale);
  pen.list.AddRectFilled({at(press.min_n), y - 2 * pen.scale}, {at(press.max_n), y + high + 2 * pen.scale}, packed(kGood, 0.75F),
                         2 * pen.scale);
  for (const TaskWatch::Hand& hand : hands) {
    const float to = at(hand.force_n), half = 5 * pen.scale;
    pen.list.AddTriangleFilled({to - half, y - 11 * pen.scale}, {to + half, y - 11 * pen.scale}, {to, y - pen.scale},
                               packed(color_of(sight, hand.station)));
    pen.list.AddLine({to, y - pen.scale}, {to, y + high}, packed(pen.theme.ink), 1.6F * pen.scale);
  }
  const auto number = [&](double force_n, const std::string& words) {
    pen.text(at(force_n) - 0.5F * pen.measure(12, words), y + high + 3 * pen.scale, 12, pen.theme.ink_soft, words);
  };
  number(press.min_n, fmt::format("{:g}", press.min_n));
  number(press.max_n, fmt::format("{:g} N", press.max_n));
}

void draw_hand(const Pen& pen, const Sight& sight, const Task& task, const TaskWatch::Hand& hand, float x, float y, float width) {
  const TaskProgress& p = hand.progress;
  const float r = 4 * pen.scale;
  pen.list.AddCircleFilled({x + r, y + 8 * pen.scale}, r, packed(color_of(sight, hand.station)), 20);
  const float after = x + 14 * pen.scale;
  const float name = pen.text(after, y, 13, pen.theme.ink, hand.station);
  pen.text(after + name + 8 * pen.scale, y, 13, pen.theme.ink_soft, in_words(task, p));
  const std::string score = fmt::format("{:.0f}", p.score);
  pen.text_left_of(x + width, y, 13, pen.theme.ink, (p.finished() ? "done: " : "") + score + " of 100");
  const float top = y + 20 * pen.scale, bottom = top + kBar * pen.scale;
  pen.list.AddRectFilled({x, top}, {x + width, bottom}, packed(pen.theme.ink_soft, 0.22F), 3 * pen.scale);
  if (p.done > 0)
    pen.list.AddRectFilled({x, top}, {x + width * static_cast<float>(p.done), bottom},
                           packed(p.finished() || p.in_band ? kGood : pen.theme.accent), 3 * pen.scale);
}

class OnBody {
 public:
  OnBody(const Pen& pen, const Camera& camera)
      : pen_(pen), eye_(camera.eye()), matrix_(camera.projection(pen.width / pen.height) * camera.view()) {}

  Vec3f pixels(const Vec3& at) const { return to_pixels(matrix_, at.cast<float>(), pen_.width, pen_.height); }
  bool faces(const LinePoint& point) const {
    return point.normal.cast<float>().dot(eye_ - point.at.cast<float>()) > 0 && pixels(point.at).z() <= 1;
  }
  void line(const Vec3& from, const Vec3& to, const Vec3f& color, float width) const {
    const Vec3f a = pixels(from), b = pixels(to);
    pen_.list.AddLine({a.x(), a.y()}, {b.x(), b.y()}, packed(kRim, 0.55F), (width + 2) * pen_.scale);
    pen_.list.AddLine({a.x(), a.y()}, {b.x(), b.y()}, packed(color), width * pen_.scale);
  }
  void ring(const Vec3& at, float radius, const Vec3f& color) const {
    const Vec3f c = pixels(at);
    pen_.list.AddCircle({c.x(), c.y()}, radius, packed(kRim, 0.55F), 40, 4.5F * pen_.scale);
    pen_.list.AddCircle({c.x(), c.y()}, radius, packed(color), 40, 2.5F * pen_.scale);
  }
  /// Length of a small distance at a point.
  float pixels_of(const Vec3& at, double metres, const Camera& camera) const {
    const Vec3 beside = at + metres * camera.axes().col(0).cast<double>();
    return (pixels(beside) - pixels(at)).head<2>().norm();
  }

 private:
  const Pen& pen_;
  Vec3f eye_;
  Eigen::Matrix4f matrix_;
};

void draw_line(const Pen& pen, const OnBody& body, const TraceTask& trace, double done_m) {
  double at_m = 0;
  for (std::size_t i = 1; i < trace.line.size(); ++i) {
    const LinePoint &a = trace.line[i - 1], &b = trace.line[i];
    const double next_m = at_m + (b.at - a.at).norm();
    if (body.faces(a) && body.faces(b)) {
      const Vec3 split = a.at + (b.at - a.at) * std::clamp((done_m - at_m) / (next_m - at_m), 0.0, 1.0);
      if (done_m < next_m) body.line(split, b.at, kTarget, 3);
      if (done_m > at_m) body.line(a.at, split, kGood, 3);
    }
    at_m = next_m;
  }
  if (body.faces(trace.line.front())) body.ring(trace.line.front().at, 8 * pen.scale, done_m > 0 ? kGood : kTarget);
}

}  // namespace

void draw_task(const Pen& pen, const Sight& sight, const TaskWatch& watch, float x, float y) {
  const Task& task = *watch.task();
  std::vector<TaskWatch::Hand> hands = watch.hands();
  if (hands.size() > kMostHands) hands.resize(kMostHands);
  const auto* press = std::get_if<PressTask>(&task.goal);
  const float at = pen.scale, width = std::max(kLeastWidth * at, pen.measure(15, task.text));
  const float height = kPad + 26 + (press != nullptr ? kBand : 0) + kRow * static_cast<float>(hands.size()) + 4;
  pen.list.AddRectFilled({x, y}, {x + width + 2 * kPad * at, y + height * at}, packed(pen.theme.background_bottom, 0.78F),
                         7 * at);
  pen.list.AddRect({x, y}, {x + width + 2 * kPad * at, y + height * at}, packed(pen.theme.ink_soft, 0.22F), 7 * at, 0, at);
  x += kPad * at;
  y += 0.7F * kPad * at;
  pen.text(x, y, 15, pen.theme.ink, task.text);
  y += 30 * at;
  if (press != nullptr) {
    draw_band(pen, sight, *press, hands, x, y + 10 * at, width);
    y += kBand * at;
  }
  for (const TaskWatch::Hand& hand : hands) {
    draw_hand(pen, sight, task, hand, x, y, width);
    y += kRow * at;
  }
}

void draw_task_target(const Pen& pen, const TaskWatch& watch, const Camera& camera) {
  const Task& task = *watch.task();
  const OnBody body(pen, camera);
  const std::vector<TaskWatch::Hand> hands = watch.hands();
  if (const auto* trace = std::get_if<TraceTask>(&task.goal)) {
    double done_m = 0;
    for (const TaskWatch::Hand& hand : hands) done_m = std::max(done_m, hand.progress.traced_m);
    draw_line(pen, body, *trace, done_m);
  }
  const auto* find = std::get_if<FindTask>(&task.goal);
  if (find == nullptr || !watch.marked()) return;
  body.ring(find->lump, body.pixels_of(find->lump, find->radius_m, camera), kTarget);
  for (const TaskWatch::Hand& hand : hands)
    if (hand.progress.mark) {
      body.line(*hand.progress.mark, find->above, kGood, 2);
      body.ring(*hand.progress.mark, 6 * pen.scale, kGood);
    }
}

}  // namespace palpate
