#include "client/viewer/playback.hpp"

#include <algorithm>

namespace palpate {
namespace {

/// Finds the two neighbours of a moment in a list ascending in body_time, and its relative position between them.
template <class Item>
struct Between {
  const Item *from, *to;
  double s;
};

template <class Item>
Between<Item> between(const std::deque<Item>& items, Micros moment) {
  const auto next = std::find_if(items.begin(), items.end(), [&](const Item& item) { return item.body_time > moment; });
  if (next == items.begin()) return {&items.front(), &items.front(), 0};
  if (next == items.end()) return {&items.back(), &items.back(), 0};
  const Item &from = *std::prev(next), &to = *next;
  return {&from, &to, seconds(moment - from.body_time) / seconds(to.body_time - from.body_time)};
}

template <class Value>
void blend(const std::vector<Value>& from, const std::vector<Value>& to, float s, std::vector<Value>& between) {
  between = from;
  if (s == 0 || to.size() != from.size()) return;
  for (std::size_t i = 0; i < between.size(); ++i) between[i] += s * (to[i] - between[i]);
}

void blend(const Between<Shape>& pair, Shape& shape) {
  const auto s = static_cast<float>(pair.s);
  blend(pair.from->positions, pair.to->positions, s, shape.positions);
  shape.channel = pair.from->channel;
  blend(pair.from->scalars, pair.to->scalars, pair.to->channel == shape.channel ? s : 0, shape.scalars);
}

void blend(const Between<Tools>& pair, std::vector<ToolView>& tools) {
  tools = pair.s < 0.5 ? pair.from->tools : pair.to->tools;
  for (ToolView& tool : tools) {
    const auto same = [&](const ToolView& other) { return other.station == tool.station; };
    const auto a = std::find_if(pair.from->tools.begin(), pair.from->tools.end(), same);
    const auto b = std::find_if(pair.to->tools.begin(), pair.to->tools.end(), same);
    if (a == pair.from->tools.end() || b == pair.to->tools.end()) continue;
    tool.position = a->position + pair.s * (b->position - a->position);
    tool.force = a->force + pair.s * (b->force - a->force);
    tool.opening = std::lerp(a->opening, b->opening, pair.s);
    tool.orientation = orientation_between(a->orientation, b->orientation, pair.s);
  }
}

}  // namespace

void Playback::clear() { *this = Playback{}; }

void Playback::watch_lateness(Micros body_time, Micros now) {
  const Micros value = now - body_time;
  while (!latenesses_.empty() && latenesses_.back().value >= value) latenesses_.pop_back();
  latenesses_.push_back({now, value});
  while (now - latenesses_.front().at > kForget) latenesses_.pop_front();
}

void Playback::add(Shape shape, Micros now) {
  if (!shapes_.empty()) {
    const Micros step = shape.body_time - shapes_.back().body_time;
    if (step <= Micros{0} || step > kBreak)
      clear();
    else
      period_ += (std::min(step, Micros{250'000}) - period_) / 8;
  }
  watch_lateness(shape.body_time, now);
  shapes_.push_back(std::move(shape));
  if (shapes_.size() > kKept) shapes_.pop_front();
}

void Playback::extend(const std::vector<Eigen::Vector3f>& rest, const std::vector<std::uint32_t>& like) {
  for (Shape& shape : shapes_)
    for (std::size_t i = rest.size() - like.size(); i < rest.size(); ++i) {
      const std::uint32_t same = like[i - (rest.size() - like.size())];
      shape.positions.push_back(rest[i] + shape.positions[same] - rest[same]);
      if (!shape.scalars.empty()) shape.scalars.push_back(shape.scalars[same]);
    }
}

void Playback::add(const Tools& tools, Micros) {
  if (!tools_.empty()) {
    const Micros step = tools.body_time - tools_.back().body_time;
    if (step < -kBreak || step > kBreak)
      tools_.clear();
    else if (step <= Micros{0})
      return;
  }
  tools_.push_back(tools);
  if (tools_.size() > kKept) tools_.pop_front();
}

const Shape* Playback::frame_at(Micros body_time) const {
  constexpr Micros kSame{5'000};
  const auto same = [&](const Shape& s) { return s.body_time <= body_time + kSame && s.body_time >= body_time - kSame; };
  const auto frame = std::find_if(shapes_.begin(), shapes_.end(), same);
  return frame != shapes_.end() ? &*frame : nullptr;
}

bool Playback::at(Micros now, Shape& shape, std::vector<ToolView>& tools) const {
  if (shapes_.empty()) return false;
  shape.body_time = moment(now);
  blend(between(shapes_, shape.body_time), shape);
  tools.clear();
  if (!tools_.empty()) blend(between(tools_, shape.body_time), tools);
  return true;
}

}  // namespace palpate
