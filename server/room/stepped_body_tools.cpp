// Tools of the body: they come and go with their samples, and are released when the body is reset.
#include <algorithm>
#include <cassert>
#include <utility>
#include <vector>

#include "common/player/player.hpp"
#include "server/dynamics/needle_ports.hpp"
#include "server/reduction/tool_prediction.hpp"
#include "server/room/stepped_body.hpp"

namespace palpate {

void SteppedBody::take_samples(const FrameJob& job) {
  constexpr Micros kTrackKept{100'000};  // longer than hand_motion() looks back
  for (const StationJob& j : job.stations) {
    const auto [place, is_new] = tools_.try_emplace(j.id);
    StationTool& tool = place->second;
    if (is_new) tool.presses = j.presses;
    if (is_new) tool.held = j.held;
    tool.track.add(j.samples, time());
    note_past(tool, j.horizon);
    tool.track.forget_before(time() - kTrackKept);
  }
  std::erase_if(tools_, [&](const auto& entry) {
    return std::none_of(job.stations.begin(), job.stations.end(), [&](const StationJob& j) { return j.id == entry.first; });
  });
}

/// Notes the path of a tool up to body time.
void SteppedBody::note_past(StationTool& tool, Micros horizon) const {
  if (tool.track.empty()) return;
  tool.noted = std::max(tool.noted, tool.track.begin());
  for (; tool.noted <= time(); tool.noted += Predictability::kEvery)
    tool.past.add(tool.track.on_path(tool.noted).at.position, seconds(horizon));
}

void SteppedBody::sync_ports(const FrameJob& job) {
  std::erase_if(ports_, [&](const ToolPort& port) { return !tools_.contains(port.tool); });
  for (const StationJob& j : job.stations) {
    StationTool& tool = tools_[j.id];
    if (!ports_of(j.id).empty() || j.shadow_of != 0 || tool.track.empty() || stays_off(tool)) continue;
    const ToolPort port = port_of(scene_, tool.held, j.id);
    if (port.kind == ContactKind::attach) {
      const Vec3 offset = at_node(body_.x, port.node) - tool.track.at(time()).position;
      if (offset.norm() > kGraspReachM) continue;
      tool.grasp = {time(), kGraspTime, offset};
    }
    const bool takes_thread = tool.held == 0 && (!scene_.tool.needle || tool.pulls);
    const std::optional<std::uint32_t> thread = takes_thread ? next_thread() : std::nullopt;
    if (thread) {
      ports_.push_back(suture_port(body_, *thread, port));
      continue;
    }
    std::vector<ToolPort> parts = parts_of(scene_.tool_of(tool.held), tissue_.get(), port);
    if (j.needle && parts.front().needle.part == NeedlePart::tip) put_in_body(*j.needle, parts);
    ports_.insert(ports_.end(), parts.begin(), parts.end());
  }
  if (!scene_.tool.holds.empty() && !holds_thread())
    for (std::size_t which = 0; which < body_.sutures->threads.size(); ++which)
      dynamics_->sutures().hold(body_, which, std::nullopt);
}

bool SteppedBody::holds_thread() const {
  return std::ranges::any_of(ports_, [](const ToolPort& p) { return p.suture.has_value(); });
}

/// Returns the thread that a hand takes which joins now.
std::optional<std::uint32_t> SteppedBody::next_thread() const {
  if (holds_thread()) return std::nullopt;
  for (const std::uint32_t suture : scene_.tool.holds)
    if (const auto which = dynamics_->sutures().end_of(body_, suture)) return which;
  return std::nullopt;
}

std::optional<ThreadOnNeedle> SteppedBody::thread_on_needle() const {
  if (!scene_.tool.needle || holds_thread()) return std::nullopt;
  const auto which = dynamics_->sutures().on_needle(body_, scene_.tool.holds);
  const auto hand = std::ranges::find_if(tools_, [](const auto& of) { return of.second.held == 0 && !of.second.track.empty(); });
  if (!which || hand == tools_.end()) return std::nullopt;
  const ToolAt at = tool_at(hand->second, {}, time());
  return ThreadOnNeedle{*which, at.position + scene_.tool.needle->length_m * at.axis};
}

/// Draws the thread of a needle through whose tip has come out of the body; the hand then takes its end. Returns false otherwise,
/// and where another hand has drawn it through and waits for its needle's force to fade.
bool SteppedBody::draw_through(StationId id) {
  const auto on_needle = thread_on_needle();
  const auto tip = std::ranges::find_if(ports_, [&](const ToolPort& port) {
    return port.tool == id && port.needle.part == NeedlePart::tip && port.needle.tip.inside;
  });
  const bool drawn_already = std::ranges::any_of(tools_, [](const auto& of) { return of.second.pulls; });
  if (!on_needle || drawn_already || tip == ports_.end()) return false;
  if (!dynamics_->sutures().draw_through(body_, on_needle->which, *tip->needle.path, tip->needle.tip.depth_m)) return false;
  suture_news_.drawn_through.push_back(scene_.body.sutures[body_.sutures->threads[on_needle->which].suture].name);
  release_tool(id, ReleaseFade::kFadeTime);
  tools_.at(id).pulls = true;
  return true;
}

/// Draws threads through, ties and cuts them where buttons were pressed.
void SteppedBody::use_buttons(const FrameJob& job) {
  if (scene_.body.sutures.empty()) return;
  for (const StationJob& j : job.stations) {
    const auto tool = tools_.find(j.id);
    if (tool == tools_.end() || std::exchange(tool->second.presses, j.presses) == j.presses || j.shadow_of != 0) continue;
    const auto names = [&](const SutureState::Thread& thread) { return scene_.body.sutures[thread.suture].name; };
    const auto held = std::ranges::find_if(ports_, [&](const ToolPort& p) { return p.tool == j.id && p.suture; });
    if (held != ports_.end()) {
      const std::uint32_t which = *held->suture;
      const bool is_slack = dynamics_->sutures().pull_to_hand(body_, which).isZero(0);
      release_tool(j.id, ReleaseFade::kFadeTime);
      if (scene_.tool.needle && is_slack) continue;
      suture_news_.tied.push_back(names(body_.sutures->threads[which]));
      dynamics_->sutures().tie(body_, which);
    } else if (scene_.tool_of(tool->second.held).needle) {
      if (!draw_through(j.id)) continue;
    } else if (!tool->second.track.empty() &&
               dynamics_->sutures().cut(body_, tool->second.track.at(time()).position, kScissorsM)) {
      suture_news_.cut.push_back(names(body_.sutures->threads.back()));
    } else {
      continue;
    }
    asleep_ = false;
  }
  let_threads_go();
}

/// Takes threads out of hands that have left the body.
void SteppedBody::let_threads_go() {
  for (std::size_t k = ports_.size(); k-- > 0;)
    if (ports_[k].suture && body_.sutures->threads[*ports_[k].suture].law.bites == 0)
      release_tool(ports_[k].tool, ReleaseFade::kFadeTime);
}

void SteppedBody::predict_paths() {
  if (!tissue_) return;
  for (std::size_t k = 0; k < ports_.size(); ++k) {
    const ToolAt at = tool(k, time());
    ports_[k].needle.axis = at.axis;
    ports_[k].needle.edge = at.edge;
  }
  palpate::predict_paths(body_.x, ports_);
}

std::vector<std::size_t> SteppedBody::ports_of(StationId id) const {
  std::vector<std::size_t> ports;
  for (std::size_t k = 0; k < ports_.size(); ++k)
    if (ports_[k].tool == id) ports.push_back(k);
  return ports;
}

std::vector<std::size_t> SteppedBody::ports_of(const StationJob& job) const {
  return ports_of(job.shadow_of != 0 ? job.shadow_of : job.id);
}

const SteppedBody::StationTool* SteppedBody::tool_of(const StationJob& job) const {
  const auto tool = tools_.find(job.shadow_of != 0 ? job.shadow_of : job.id);
  return tool == tools_.end() || tool->second.track.empty() ? nullptr : &tool->second;
}

const ToolSpec& SteppedBody::spec_of(const StationJob& job) const {
  const StationTool* const tool = tool_of(job);
  return tool ? scene_.tool_of(tool->held) : scene_.tool;
}

HandMotion SteppedBody::hand_motion(std::size_t k) const {
  const StationTool& station = tools_.at(ports_[k].tool);
  const ToolSphere& sphere = ports_[k].sphere;
  assert(!station.track.empty());
  constexpr Micros kDifferenceStep{30'000};  // an encoder's step of 0.03 mm makes up to 0.07 m/s^2; longer: lags more
  const Micros now = time();
  if (now - 2 * kDifferenceStep < station.track.begin()) return {tool_at(station, sphere, now).velocity, Vec3::Zero()};
  const auto place = [&](Micros t) { return tool_at(station, sphere, t).position; };
  const Vec3 here = place(now), before = place(now - kDifferenceStep), first = place(now - 2 * kDifferenceStep);
  const double step_s = seconds(kDifferenceStep);
  const Vec3 acceleration = (here - 2 * before + first) / (step_s * step_s);
  return {(3 * here - 4 * before + first) / (2 * step_s),
          acceleration / std::max(1.0, acceleration.norm() / kHandAccelerationMostMs2)};
}

HandMotion SteppedBody::predictable_motion(std::size_t k) const {
  const HandMotion motion = hand_motion(k);
  const StationTool& tool = tools_.at(ports_[k].tool);
  const double share = tool.past.share();
  return {share * motion.velocity, share * motion.acceleration, tool.past.back(tool.track.on_path(time()).at.position)};
}

/// Resets the body to rest while hands are on it, without a step in any hand's force.
void SteppedBody::reset() {
  while (!ports_.empty()) release_tool(ports_.back().tool, ReleaseFade::kFadeTime);
  if (cuts_ && cuts_->make_whole()) renew_steppers();
  body_.x = rest_.x;
  body_.history = rest_.history;
  body_.anchors = rest_.anchors;
  body_.sutures = rest_.sutures;
  body_.v.setZero();
  asleep_ = false;
}

void SteppedBody::release_tool(StationId id, Micros off) {
  if (const auto tool = tools_.find(id); tool != tools_.end()) {  // else its station left in this very frame
    const TurningTool at = tool->second.track.turning(time());
    const std::vector<double> surface =
        scene_.tool_of(tool->second.held).has_body() ? skin_.place(body_.x) : std::vector<double>();
    Wrench felt;
    for (const std::size_t k : ports_of(id)) {
      const ToolPort& port = ports_[k];
      if (port.kind != ContactKind::attach && !port.touching) continue;
      felt += wrench_of(port, at, port.body ? normal_at(skin_.view(), surface, port.point) : Vec3(Vec3::Zero()));
    }
    tool->second.fade = ReleaseFade(time(), felt, off);
    tool->second.pulls = false;
  }
  std::erase_if(ports_, [&](const ToolPort& port) { return port.tool == id; });
}

void SteppedBody::release_costly(StationId id) {
  release_tool(id, kOff);
  tools_.at(id).costly = true;
  released_.push_back(id);
}

/// Releases the tools near the body whose paths are at their bound of the speed for longer than an outlier of the device.
void SteppedBody::release_leaping(Micros begin, Micros until) {
  constexpr double kAtBound = 0.99;
  constexpr int kLeapTicks = 10;  // 20 mm
  const double bound_m = kAtBound * ToolTrack::kFastestMs * seconds(kTick);
  for (const auto& [id, tool] : tools_) {
    const std::vector<std::size_t> ports = ports_of(id);
    if (ports.empty() || ports_[ports.front()].kind != ContactKind::touch) continue;
    int ticks = 0;
    Vec3 at = tool.track.on_path(begin).at.position;
    for (Micros t = begin; t < until; t += kTick) {
      const Vec3 next = tool.track.on_path(t + kTick).at.position;
      ticks += (next - at).norm() > bound_m;
      at = next;
    }
    if (ticks < kLeapTicks) continue;
    if (std::ranges::any_of(ports, [&](std::size_t k) { return ports_[k].touching || may_meet(k, until); })) release_costly(id);
  }
}

/// Releases up to `most` tools, those with the longest ways; returns false if there is none.
bool SteppedBody::release_longest(std::size_t most, Micros begin, Micros until) {
  const auto way_m = [&](std::size_t k) {
    double way = 0;
    for (Micros t = begin; t < until; t += kTick) way += (tool(k, t + kTick).position - tool(k, t).position).norm();
    return way;
  };
  std::map<StationId, double> ways;  // of the part that goes furthest
  for (std::size_t k = 0; k < ports_.size(); ++k)
    if (ports_[k].kind == ContactKind::touch) ways[ports_[k].tool] = std::max(ways[ports_[k].tool], way_m(k));
  std::vector<std::pair<double, StationId>> costliest;
  for (const auto& [id, way] : ways) costliest.emplace_back(way, id);
  std::sort(costliest.rbegin(), costliest.rend());  // between equal paths, the later station first
  costliest.resize(std::min(most, costliest.size()));
  for (const auto& [way, id] : costliest) release_costly(id);
  return !costliest.empty();
}

bool SteppedBody::stays_off(StationTool& tool) const {
  if (!tool.fade) return false;
  if (!tool.fade->over(time(), scene_, tool.held, skin_, body_.x, tool.track.turning(time()))) return true;
  tool.fade.reset();
  tool.costly = false;
  return false;
}

}  // namespace palpate
