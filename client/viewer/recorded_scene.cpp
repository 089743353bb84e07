#include "client/viewer/recorded_scene.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "common/base/error.hpp"
#include "common/base/sort_stably.hpp"

namespace palpate {
namespace {

constexpr Micros kLinkHolds{1'000'000};  // age beyond which a link's report is out of date
constexpr Micros kGuidesFor{400'000};    // age beyond which a hold has ended: reports come every 250 ms
constexpr Micros kLossOver{10'000'000};  // time over which losses are counted
constexpr Micros kCostOver{1'000'000};   // time over which frames are averaged
constexpr Micros kFarFrames{250'000};    // frames farther apart are not joined by a motion
constexpr const char* kExpected = "a room's recording, made by palpate-server with --record";

/// Returns the last item at or before t; end() when there is none.
template <class Item>
auto last_until(const std::vector<Item>& items, Micros t) {
  const auto after = std::upper_bound(items.begin(), items.end(), t, [](Micros at, const Item& item) { return at < item.t; });
  return after == items.begin() ? items.end() : std::prev(after);
}

/// Returns the items after `since`, up to t.
template <class Item>
std::span<const Item> within(const std::vector<Item>& items, Micros since, Micros t) {
  const auto later = [](Micros at, const Item& item) { return at < item.t; };
  const auto first = std::upper_bound(items.begin(), items.end(), since, later);
  return {first, std::upper_bound(first, items.end(), t, later)};
}

template <class Items>
void sort_by_time(Items& items) {
  sort_stably(items.begin(), items.end(), [](const auto& a, const auto& b) { return a.t < b.t; });
}

}  // namespace

RecordedScene::RecordedScene(const RecordingReader& recording, const std::string& name)
    : recording_(recording), surfaces_(recording.head().surface) {
  const RecordingHead& head = recording.head();
  if (head.kind == RecordingKind::station) throw InputError(name, "is the recording of a station, which has no body", kExpected);
  if (head.surface.triangles.empty()) throw InputError(name, "its body has no triangles to draw", kExpected);
  show_mesh(mesh_of(head.surface), 0);
  if (head.rate_hz > 0) period_ = from_seconds(1 / head.rate_hz);
  if (head.shapes_hz > 0) shape_period_ = std::max(period_, from_seconds(1 / head.shapes_hz));
  for (std::size_t k = 0; k < recording.blocks().size(); ++k) {
    if (const auto block = recording.read(k))
      take(*block, k);
    else
      ++damaged_;
  }
  if (shapes_.empty())
    throw InputError(name, "holds no shape of the body", std::string(kExpected) + " and --record-shapes-hz above 0");
  sort_by_time(shapes_);
  sort_by_time(frames_);
  for (auto& [id, hand] : hands_) {
    sort_by_time(hand.touches);
    sort_by_time(hand.links);
    sort_by_time(hand.turns);
    sort_by_time(hand.buttons);
    sort_by_time(hand.guidances);
  }
  sort_stably(notes_.begin(), notes_.end(), [](const RecordedNote& a, const RecordedNote& b) { return a.about < b.about; });
  std::sort(resets_.begin(), resets_.end());
  make_course();
  make_task();
}

void RecordedScene::take(const RecordedBlock& block, std::size_t k) {
  for (const RecordedMeshChange& change : block.mesh_changes) surfaces_.take(change);
  for (std::size_t i = 0; i < block.shapes.size(); ++i) {
    if (!surfaces_.mesh_of(block.shapes[i])) continue;  // a damaged block had its surface
    shapes_.push_back({block.shapes[i].t, k, i, block.shapes[i].mesh});
    note_displacement(block.shapes[i]);
  }
  for (const RecordedFrame& frame : block.frames) frames_.push_back({frame.t, frame.took});
  take_events(block);
  for (const RecordedTouch& touch : block.touches) {
    hands_[touch.station].touches.push_back(touch);
    force_max_n_ = std::max(force_max_n_, static_cast<float>(touch.force.norm()));
  }
  for (const RecordedLink& link : block.links) hands_[link.station].links.push_back(link);
  for (const RecordedTurn& turn : block.turns) hands_[turn.station].turns.push_back(turn);
  for (const RecordedButtons& change : block.buttons) hands_[change.station].buttons.push_back(change);
  for (const RecordedGuidance& hold : block.guidances) hands_[hold.guide].guidances.push_back(hold);
  notes_.insert(notes_.end(), block.notes.begin(), block.notes.end());
}

void RecordedScene::take_events(const RecordedBlock& block) {
  for (const RecordedEvent& event : block.events) {
    if (event.kind == RecordedEventKind::reset) resets_.push_back(event.t);
    const bool goes = event.kind == RecordedEventKind::left || event.kind == RecordedEventKind::silent;
    if (event.station == 0 || (!goes && event.kind != RecordedEventKind::joined)) continue;
    Hand& hand = hands_[event.station];
    if (goes) {
      hand.gone = event.t;
      continue;
    }
    hand.name = event.name;
    hand.role = event.role;
    hand.scheme = event.scheme;
    hand.tool = event.tool;
    hand.joined = event.t;
  }
}

void RecordedScene::show_mesh(const BodyMesh& mesh, std::uint32_t number) {
  mesh_ = mesh;
  mesh_number_ = number;
  rest_.clear();
  for (const MeshVertex& vertex : mesh_.vertices) rest_.push_back(vertex.rest.cast<float>());
}

void RecordedScene::note_displacement(const RecordedShape& shape) {
  for (std::size_t v = 0; v < rest_.size(); ++v) {
    if (mesh_.vertices[v].thread) continue;
    const float moved = (shape.positions[v].cast<float>() - rest_[v]).norm();
    displacement_max_m_ = std::max(displacement_max_m_, moved);
  }
}

void RecordedScene::make_course() {
  course_.assign(kCourseParts, 0.0F);
  const double span_us = static_cast<double>(std::max(Micros{1}, end() - begin()).count());
  const auto part_of = [&](Micros t) {
    return std::min(static_cast<std::size_t>(static_cast<double>((t - begin()).count()) / span_us * kCourseParts),
                    kCourseParts - 1);
  };
  for (const auto& [id, hand] : hands_)
    for (std::size_t i = 0; i < hand.touches.size(); ++i) {
      const RecordedTouch& touch = hand.touches[i];
      if (touch.t < begin() || !touch.contact) continue;
      // Frames may be farther apart than parts: a force is assumed to last until the next frame.
      const std::size_t first = part_of(touch.t), next = i + 1 < hand.touches.size() ? part_of(hand.touches[i + 1].t) : first;
      for (std::size_t part = first; part < std::max(first + 1, next); ++part)
        course_[part] = std::max(course_[part], static_cast<float>(touch.force.norm()) / force_max_n_);
    }
}

void RecordedScene::make_task() {
  if (!recording_.head().task) return;
  TaskWatch watch;
  watch.take(*recording_.head().task);
  for (std::size_t from = 0; from <= frames_.size(); from += kTaskFrames) {
    tasks_.push_back(watch);
    watch_frames(from, std::min(from + kTaskFrames, frames_.size()), watch);
  }
}

/// Shows the watch the tools of these frames, with the buttons that were down at any time since the frame before.
void RecordedScene::watch_frames(std::size_t from, std::size_t to, TaskWatch& watch) const {
  for (std::size_t i = from; i < to; ++i) {
    const Micros t = frames_[i].t, before = i > 0 ? frames_[i - 1].t : Micros::min();
    const auto resets = std::upper_bound(resets_.begin(), resets_.end(), t) - resets_.begin();
    watch.take_resets(static_cast<std::uint16_t>(resets));
    Tools tools{0, t, 0, {}};
    for (const auto& [id, hand] : hands_) {
      const auto touch = last_until(hand.touches, t);
      if (touch == hand.touches.end() || touch->t != t || hand.role == RecordedRole::shadow) continue;
      ToolView tool{recording_.name_of(id), touch->tool, touch->force, touch->contact};
      if (const auto change = last_until(hand.buttons, before); change != hand.buttons.end()) tool.buttons = change->pressed;
      for (const RecordedButtons& change : within(hand.buttons, before, t)) tool.buttons |= change.pressed;
      tools.tools.push_back(std::move(tool));
    }
    watch.take(tools);
  }
}

TaskWatch RecordedScene::task_at(Micros t) const {
  if (tasks_.empty()) return {};
  const auto after = std::upper_bound(frames_.begin(), frames_.end(), t, [](Micros at, const Frame& f) { return at < f.t; });
  const auto frames = static_cast<std::size_t>(after - frames_.begin());
  TaskWatch watch = tasks_[frames / kTaskFrames];
  watch_frames(frames - frames % kTaskFrames, frames, watch);
  return watch;
}

std::vector<std::string> RecordedScene::hands() const {
  std::vector<std::string> names;
  for (const auto& [id, hand] : hands_)
    if (!hand.touches.empty() && std::find(names.begin(), names.end(), hand.name) == names.end()) names.push_back(hand.name);
  return names;
}

const std::vector<Vec3>& RecordedScene::positions(std::size_t shape) {
  const ShapePlace& place = shapes_[shape];
  auto at = read_.find(place.block);
  if (at == read_.end()) {
    if (read_.size() >= 2) read_.erase(place.block > read_.rbegin()->first ? read_.begin() : std::prev(read_.end()));
    // It was readable when the recording was opened; if the file has changed since, the body stays at rest.
    at = read_.emplace(place.block, recording_.read(place.block).value_or(RecordedBlock{})).first;
  }
  const auto& shapes = at->second.shapes;
  return place.place < shapes.size() ? shapes[place.place].positions : recording_.head().surface.rest;
}

void RecordedScene::shape_at(Micros t, Shape& shape) {
  const auto from = last_until(shapes_, t);
  const auto i = static_cast<std::size_t>(from == shapes_.end() ? 0 : from - shapes_.begin());
  const std::vector<Vec3>& a = positions(i);
  if (shapes_[i].mesh != mesh_number_)
    if (const BodyMesh* mesh = surfaces_.mesh_of({shapes_[i].t, a, shapes_[i].mesh})) show_mesh(*mesh, shapes_[i].mesh);
  shape.body_time = t;
  shape.positions.clear();
  for (const Vec3& x : a) shape.positions.push_back(x.cast<float>());
  if (i + 1 == shapes_.size()) return;
  const Micros begins = std::max(shapes_[i].t, shapes_[i + 1].t - shape_period_);
  if (t <= begins) return;
  const auto s = static_cast<float>(seconds(t - begins) / seconds(shapes_[i + 1].t - begins));
  const std::vector<Vec3>& b = positions(i + 1);
  // The next may have more vertices.
  for (std::size_t v = 0; v < std::min(b.size(), a.size()); ++v)
    shape.positions[v] += s * (b[v].cast<float>() - shape.positions[v]);
}

/// Returns the tools of the last frame.
std::vector<ToolView> RecordedScene::tools_at(Micros t) const {
  std::vector<ToolView> tools;
  const auto frame = last_until(frames_, t);
  if (frame == frames_.end()) return tools;
  for (const auto& [id, hand] : hands_) {
    const auto a = last_until(hand.touches, t);
    if (a == hand.touches.end() || a->t != frame->t || hand.role == RecordedRole::shadow) continue;
    ToolView tool{hand.name.empty() ? recording_.name_of(id) : hand.name, a->tool, a->force, a->contact};
    tool.torque = a->torque;
    const auto b = std::next(a);
    if (b != hand.touches.end() && b->t - a->t <= kFarFrames) {
      const double s = seconds(t - a->t) / seconds(b->t - a->t);
      tool.position += s * (b->tool - a->tool);
      tool.force += s * (b->force - a->force);
      tool.torque += s * (b->torque - a->torque);
      tool.contact = s < 0.5 ? a->contact : b->contact;
    }
    hold_at(hand, t, tool);
    if (const auto hold = last_until(hand.guidances, t); hold != hand.guidances.end() && t - hold->t <= kGuidesFor)
      tool.guides = recording_.name_of(hold->guided);
    tools.push_back(std::move(tool));
  }
  return tools;
}

/// Sets orientation, opening and buttons of the tool.
void RecordedScene::hold_at(const Hand& hand, Micros t, ToolView& tool) {
  if (const auto change = last_until(hand.buttons, t); change != hand.buttons.end()) tool.buttons = change->pressed;
  const auto a = last_until(hand.turns, t);
  if (a == hand.turns.end()) return;
  tool.orientation = a->orientation;
  tool.opening = a->opening;
  const auto b = std::next(a);
  if (b == hand.turns.end() || b->t - a->t > kFarFrames || b->t <= a->t) return;
  const double share = seconds(t - a->t) / seconds(b->t - a->t);
  tool.orientation = a->orientation.slerp(share, b->orientation);
  tool.opening = std::lerp(a->opening, b->opening, share);
}

ViewMoment RecordedScene::at(Micros t) {
  ViewMoment moment;
  shape_at(t, moment.shape);
  moment.tools = tools_at(t);
  return moment;
}

StationView RecordedScene::station_at(const Hand& hand, Micros t) const {
  StationView view;
  view.station = hand.name;
  view.in_use.scheme = hand.scheme;
  view.tool = hand.tool;
  if (const auto touch = last_until(hand.touches, t); touch != hand.touches.end() && touch->has_patch) {
    view.in_use.scheme = touch->scheme;
    view.states = static_cast<std::uint16_t>(touch->states);
  }
  const auto link = last_until(hand.links, t);
  if (link == hand.links.end() || t - link->t > kLinkHolds) return view;
  view.rtt = link->rtt;
  view.jitter = link->jitter;
  view.patch_age = link->patch_age;
  const RecordedLink& before = within(hand.links, t - kLossOver, t).front();
  const auto lost = link->lost - std::min(link->lost, before.lost);
  const auto judged = lost + link->received - std::min(link->received, before.received);
  view.lost = static_cast<std::uint16_t>(std::min<std::uint64_t>(lost, UINT16_MAX));
  view.judged = static_cast<std::uint16_t>(std::min<std::uint64_t>(judged, UINT16_MAX));
  return view;
}

RoomView RecordedScene::room_at(Micros t) const {
  RoomView room;
  room.nodes = recording_.head().surface.body_nodes;
  room.tool = recording_.head().tool;
  room.bodies = recording_.head().bodies;
  Micros took{};
  const auto frames = within(frames_, t - kCostOver, t);
  for (const Frame& frame : frames) took += frame.took;
  if (frames.size() > 1 && took > Micros{0}) {
    const double n = static_cast<double>(frames.size()), simulated_s = seconds(frames.back().t - frames.front().t);
    room.frame_time = took / static_cast<std::int64_t>(frames.size());
    room.rate_hz = (n - 1) / simulated_s;
    room.real_time_factor = simulated_s * n / (n - 1) / seconds(took);
  }
  for (const auto& [id, hand] : hands_)
    if (hand.role != RecordedRole::viewer && !hand.name.empty() && hand.joined <= t && t < hand.gone)
      room.stations.push_back(station_at(hand, t));
  return room;
}

void RecordedScene::plot(Micros t, History& forces, History& patch_ages) const {
  forces = patch_ages = {};
  for (const auto& [id, hand] : hands_) {
    for (const RecordedTouch& touch : within(hand.touches, t - History::kSpan, t))
      forces.add(touch.t, hand.name, static_cast<float>(touch.force.norm()));
    for (const RecordedLink& link : within(hand.links, t - History::kSpan, t))
      if (hand.role != RecordedRole::viewer) patch_ages.add(link.t, hand.name, static_cast<float>(1e3 * seconds(link.patch_age)));
  }
}

}  // namespace palpate
