#include "server/room/room.hpp"

#include <algorithm>
#include <map>

#include "common/wire/codec.hpp"
#include "server/body/ladder.hpp"
#include "server/body/settle.hpp"
#include "server/body/stillness.hpp"
#include "server/reduce/patch_builder.hpp"
#include "server/room/grasp.hpp"
#include "server/room/shades.hpp"
#include "server/room/tool_track.hpp"

namespace palpate {
namespace {

constexpr double kHomeHeightM = 0.020;

/// How high over the sleeping body a tool was: it stays as far from the surface, less the way that it went since.
struct Sight {
  Vec3 from = Vec3::Zero();
  double height_m = 0;
  double least_height_m(const Vec3& at) const { return height_m - (at - from).norm(); }
};

PatchRequest request_of(const StationJob& job) {
  return {job.scheme, job.order, job.bridge, job.silence,
          [](int modes, bool loaded) { return max_port_vertices(modes, kMaxPortTriangles, loaded); }};
}

/// The last patch of a sleeping body: it holds as long as the body sleeps, for a tool that hardly moves.
struct Kept {
  PatchRequest request;
  Patch patch;
  CubicTerms terms;

  bool serves(const PatchRequest& asked, const ToolAt& tool) const {
    constexpr double kSameM = 0.001, kAheadM = 0.005, kSameBridge = 0.1;  // a hand trembles by 0.2 mm, nodes are 10 mm apart
    const double bridge_s = seconds(asked.bridge);
    return asked.scheme == request.scheme && asked.order == request.order && asked.silence == request.silence &&
           std::abs(bridge_s - seconds(request.bridge)) <= kSameBridge * bridge_s &&
           (tool.position - patch.tool).norm() <= kSameM && bridge_s * (tool.velocity - patch.tool_velocity).norm() <= kAheadM;
  }
};

struct Station {
  ToolTrack track;
  std::optional<Sight> sight;
  std::optional<Kept> kept;
  Grasp grasp;
  std::unique_ptr<PatchBuilder> builder;
  std::uint32_t seq = 0;
};

}  // namespace

struct Room::State {
  explicit State(const Scene& s)
      : scene(s),
        skin(scene.body, scene.tool.radius_m),
        dynamics(scene.body),
        integrator(choose_stepper(scene.solver, dynamics, skin)) {
    body = rest = settled_state(dynamics, skin);
    fall_asleep();
  }

  // The tool of a station in body time: for a grasp the node goes from where it was taken to the tool.
  ToolAt tool_at(const Station& station, Micros t) const {
    return scene.tool.contact == ContactKind::attach ? station.grasp.at(station.track, t) : station.track.at(t);
  }
  void take_samples(const FrameJob& job);
  void sync_ports(const FrameJob& job);
  void fall_asleep();
  bool sleeps_through(const FrameJob& job);
  bool may_meet(std::size_t which, Micros until);
  template <class Place>
  std::optional<NearestPoint> seen_within(std::size_t which, const Vec3& tool, double far_m, const Place& positions);
  AdvanceReport advance(const FrameJob& job);
  /// The port of the tool that a station feels with.
  std::optional<std::size_t> port_of(const StationJob& job) const;
  /// For each station whether it gets a patch.
  std::vector<std::uint8_t> begin_patches(const FrameJob& job);
  bool in_reach(std::size_t which, Micros bridge);
  /// The patch that the station got last, where it still says what a new one would.
  const Kept* kept_for(const StationJob& job, std::size_t which) const;
  void give_patch(const StationJob& job, std::size_t which, StationFrame& frame);
  StationFrame frame_of(const StationJob& job, Micros stamp, bool gets_patch);

  Scene scene;
  Skin skin;
  Dynamics dynamics;
  ChosenStepper integrator;
  BodyState body, rest;
  BalancedBases balanced{dynamics, skin, rest};
  double softest_1_s2 = softest_stiffness(dynamics);
  Stillness stillness{dynamics, softest_1_s2};
  bool asleep = false;
  std::map<StationId, Station> stations;
  std::vector<StationId> port_owner;  // parallel to ports
  std::vector<ToolPort> ports;
  FrameModel frame_model{dynamics, skin};
};

Room::Room(const Scene& scene) : state_(std::make_unique<State>(scene)) {}
Room::~Room() = default;
Room::Room(Room&&) noexcept = default;
Room& Room::operator=(Room&&) noexcept = default;

Vec3 home_of(const Scene& scene) {
  const LumpedBody& body = scene.body;
  if (scene.tool.contact == ContactKind::attach) return body.nodes[scene.tool.node];
  Vec3 centre = Vec3::Zero();
  double top = -1e300;
  for (const Vec3& x : body.nodes) {
    centre += x / static_cast<double>(body.nodes.size());
    top = std::max(top, x.z());
  }
  return {centre.x(), centre.y(), top + kHomeHeightM};
}

const std::string& Room::integrator() const { return state_->integrator.reason; }

void Room::start(Micros body_time) {
  state_->body.time_s = seconds(body_time);
  state_->stations.clear();
  state_->ports.clear();
  state_->port_owner.clear();
}

void Room::State::take_samples(const FrameJob& job) {
  for (const StationJob& j : job.stations) {
    Station& station = stations[j.id];
    if (!station.builder) station.builder = std::make_unique<PatchBuilder>(dynamics, skin, softest_1_s2, &balanced);
    station.track.add(j.samples, from_seconds(body.time_s));
    station.track.forget_before(from_seconds(body.time_s) - Micros{100'000});
  }
  std::erase_if(stations, [&](const auto& entry) {
    return std::none_of(job.stations.begin(), job.stations.end(), [&](const StationJob& j) { return j.id == entry.first; });
  });
}

void Room::State::sync_ports(const FrameJob& job) {
  for (std::size_t k = 0; k < ports.size();) {
    if (stations.contains(port_owner[k])) {
      ++k;
      continue;
    }
    ports.erase(ports.begin() + static_cast<std::ptrdiff_t>(k));
    port_owner.erase(port_owner.begin() + static_cast<std::ptrdiff_t>(k));
  }
  for (const StationJob& j : job.stations) {
    Station& station = stations[j.id];
    const bool known = std::find(port_owner.begin(), port_owner.end(), j.id) != port_owner.end();
    if (known || j.shadow_of != 0 || station.track.empty()) continue;
    ToolPort port;
    port.kind = scene.tool.contact;
    port.node = scene.tool.node;
    port.parameters = {scene.tool.coupling_n_m, scene.tool.friction};
    if (port.kind == ContactKind::attach) {
      const Micros now = from_seconds(body.time_s);
      const Vec3 offset = body.x.segment<3>(3 * static_cast<Eigen::Index>(port.node)) - station.track.at(now).position;
      if (offset.norm() > Grasp::kReachM) continue;
      station.grasp = Grasp(now, offset);
    }
    ports.push_back(port);
    port_owner.push_back(j.id);
  }
}

/// If it may. What is left of its motion goes: the body stays where it is to the bit.
void Room::State::fall_asleep() {
  const bool alone =
      std::none_of(ports.begin(), ports.end(), [](const ToolPort& p) { return p.kind == ContactKind::attach || p.touching; });
  asleep = alone && stillness.holds(body);
  if (asleep) body.v.setZero();
}

/// Whether a tool that does not touch may meet the body, where it is, before `until`.
bool Room::State::may_meet(std::size_t which, Micros until) {
  constexpr Micros kLook{1'000'000 / kHapticRateHz};
  constexpr double kMarginM = 0.001;  // a hand strays less between two looks
  if (ports[which].kind == ContactKind::attach) return true;
  const Station& station = stations.at(port_owner[which]);
  const Micros begin = from_seconds(body.time_s);
  const Vec3 from = tool_at(station, begin).position;
  double way_m = (tool_at(station, until).position - from).norm();
  for (Micros t = begin; t < until; t += kLook) way_m = std::max(way_m, (tool_at(station, t).position - from).norm());
  return seen_within(which, from, way_m + kMarginM, [this] { return skin.place(body.x); }).has_value();
}

/// Where the surface is nearest to a tool, if it is nearer than `far_m`. Over a sleeping body it is looked for only when the tool
/// may have got so near since it was looked for last. `positions()`: of the skin's vertices.
template <class Place>
std::optional<NearestPoint> Room::State::seen_within(std::size_t which, const Vec3& tool, double far_m, const Place& positions) {
  std::optional<Sight>& sight = stations.at(port_owner[which]).sight;
  if (skin.empty() || (sight && sight->least_height_m(tool) >= far_m)) return std::nullopt;
  const NearestPoint nearest = nearest_point(skin.view(), positions(), tool);
  if (asleep) sight = Sight{tool, nearest.height_m};
  return nearest.height_m < far_m ? std::optional(nearest) : std::nullopt;
}

bool Room::State::sleeps_through(const FrameJob& job) {
  if (!asleep || !job.may_sleep) return false;
  for (std::size_t k = 0; k < ports.size(); ++k)
    if (may_meet(k, job.target)) return false;
  return true;
}

// A frame that has to make up for lost time (the machine was busy) costs no more than kFramesMax frames: its steps grow instead.
// A room that fell behind by more steps of the same length would fall behind further.
AdvanceReport Room::State::advance(const FrameJob& job) {
  constexpr int kFramesMax = 2;
  double step_s = scene.solver.step_s;
  const double behind = (seconds(job.target) - body.time_s) / std::max(kFramesMax * seconds(job.frame), 1e-9);
  if (job.frame > Micros{} && behind > 1) step_s *= behind;
  return integrator.stepper->advance(body, ports, seconds(job.target), step_s, [&](std::size_t k, double t) {
    return tool_at(stations.at(port_owner[k]), from_seconds(t));
  });
}

std::optional<std::size_t> Room::State::port_of(const StationJob& job) const {
  const auto at = std::find(port_owner.begin(), port_owner.end(), job.shadow_of != 0 ? job.shadow_of : job.id);
  if (at == port_owner.end()) return std::nullopt;
  return static_cast<std::size_t>(at - port_owner.begin());
}

std::vector<std::uint8_t> Room::State::begin_patches(const FrameJob& job) {
  std::vector<ToolAt> tools;
  for (std::size_t k = 0; k < ports.size(); ++k) {
    tools.push_back(tool_at(stations.at(port_owner[k]), job.target));
    // The velocity that the body felt: a patch's forces hold for it.
    if (ports[k].kind == ContactKind::attach) tools[k].velocity = body.v.segment<3>(3 * static_cast<Eigen::Index>(ports[k].node));
  }
  Micros bridges{};
  for (const StationJob& j : job.stations) bridges += j.bridge / static_cast<std::int64_t>(job.stations.size());
  frame_model.begin(body, ports, tools, bridges);
  // Known for all before the first patch is built: what the patches of a frame have in common is computed together.
  std::vector<std::uint8_t> gets_patch;
  for (const StationJob& j : job.stations) {
    const auto which = port_of(j);
    gets_patch.push_back(which && in_reach(*which, j.bridge));
    if (gets_patch.back() && !kept_for(j, *which)) frame_model.want(*which);
  }
  return gets_patch;
}

/// Moves the point of a tool that does not touch to where it is nearest.
bool Room::State::in_reach(std::size_t which, Micros bridge) {
  ToolPort& port = ports[which];
  if (port.kind == ContactKind::attach || port.touching) return true;
  // How far the tool can get before the next patch: its speed, and a hand's acceleration of 10 m/s^2 on top, each way.
  constexpr double kHandAccelerationMs2 = 10, kMarginM = 0.005;
  const ToolAt& tool = frame_model.tool(which);
  const double t = seconds(bridge);
  const double reach = tool.velocity.norm() * t + 0.5 * kHandAccelerationMs2 * t * t + kMarginM;
  const auto nearest = seen_within(
      which, tool.position, reach, [this]() -> const auto& { return frame_model.positions(); });
  if (nearest) port.point = nearest->point;
  return nearest.has_value();
}

const Kept* Room::State::kept_for(const StationJob& job, std::size_t which) const {
  const std::optional<Kept>& kept = stations.at(job.id).kept;
  return asleep && kept && kept->serves(request_of(job), frame_model.tool(which)) ? &*kept : nullptr;
}

void Room::State::give_patch(const StationJob& job, std::size_t which, StationFrame& frame) {
  Station& station = stations.at(job.id);
  if (const Kept* kept = kept_for(job, which)) {
    frame.patch = kept->patch;
    frame.patch->tool = frame_model.tool(which).position;
    frame.patch->tool_velocity = frame_model.tool(which).velocity;
    frame.terms = kept->terms;
    return;
  }
  station.kept.reset();
  const PatchRequest request = request_of(job);
  frame.patch = station.builder->build(frame_model, which, request);
  if (!frame.patch) return;
  frame.terms = station.builder->terms();
  if (asleep) station.kept = Kept{request, *frame.patch, frame.terms};
}

StationFrame Room::State::frame_of(const StationJob& job, Micros stamp, bool gets_patch) {
  StationFrame frame;
  frame.id = job.id;
  const auto which = port_of(job);
  if (!which) return frame;
  const ToolPort& port = ports[*which];
  frame.tool = frame_model.tool(*which).position;
  frame.contact = port.kind == ContactKind::attach || port.touching;
  frame.force = frame.contact ? Vec3(-port.lambda) : Vec3::Zero();
  if (!gets_patch) return frame;
  give_patch(job, *which, frame);
  if (!frame.patch) return frame;
  frame.patch->seq = ++stations.at(job.id).seq;
  frame.patch->stamp = stamp;
  return frame;
}

FrameResult Room::simulate(const FrameJob& job) {
  State& s = *state_;
  FrameResult result;
  if (s.asleep) s.body.time_s = std::max(s.body.time_s, seconds(job.begin));
  s.take_samples(job);
  s.sync_ports(job);
  AdvanceReport report;
  if (s.sleeps_through(job)) {
    s.body.time_s = seconds(job.target);
  } else {
    for (auto& [id, station] : s.stations) station.sight.reset(), station.kept.reset();
    report = s.advance(job);
  }
  result.steps = report.steps;
  result.cut_steps = report.cut_steps;
  result.newton_iterations = report.newton_iterations;
  result.solver_iterations = report.solver_iterations;
  result.stamp = job.target;
  if (!report.converged) {
    // The last good shape, at rest and let go of, goes on from here: the room must not stop because one frame was beyond it.
    result.failed = true;
    s.body.v.setZero();
    for (ToolPort& port : s.ports) port.touching = false, port.lambda.setZero();
    s.body.time_s = seconds(job.target);
  }
  s.asleep &= job.may_sleep;
  if (report.steps > 0 && job.may_sleep) s.fall_asleep();
  result.asleep = s.asleep;
  if (job.shapes) {
    const std::vector<double> x = s.skin.place(s.body.x);
    for (std::uint32_t i = 0; i < s.dynamics.nodes(); ++i) result.positions.emplace_back(vertex(x, i));
  }
  if (job.tension) result.tension = element_tension(s.scene.body, s.body.x);
  return result;
}

void Room::build_patches(const FrameJob& job, FrameResult& result) {
  const std::vector<std::uint8_t> gets_patch = state_->begin_patches(job);
  for (std::size_t k = 0; k < job.stations.size(); ++k) {
    StationFrame frame;
    frame.id = job.stations[k].id;
    if (!result.failed) frame = state_->frame_of(job.stations[k], job.target, gets_patch[k] != 0);
    result.stations.push_back(std::move(frame));
  }
  if (!job.support || result.positions.empty()) return;
  result.support.assign(result.positions.size(), 0.0F);
  for (const StationFrame& frame : result.stations)
    if (frame.patch) add_support(*frame.patch, result.positions, result.support);
}

void Room::listen(std::function<void(PatchPart)> listener) { state_->frame_model.listen(std::move(listener)); }

FrameResult Room::run(const FrameJob& job) {
  FrameResult result = simulate(job);
  build_patches(job, result);
  return result;
}

}  // namespace palpate
