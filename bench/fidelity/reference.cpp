#include "bench/fidelity/reference.hpp"

#include <algorithm>
#include <optional>
#include <stdexcept>

#include "common/player/part_walls.hpp"
#include "server/body/settle.hpp"
#include "server/room/live_cuts.hpp"
#include "server/room/tool_coupling.hpp"
#include "server/room/tool_track.hpp"
#include "server/scene/tools.hpp"

namespace palpate {
namespace {

constexpr double kToleranceM = 1e-8;

/// Uses a direct solver for small bodies: an iterative solution breaks symmetries in the last digits, and a tool that slides
/// exactly along an edge of the surface is then on another triangle than the same tool elsewhere.
IntegratorOptions exact_options(const LumpedBody& body) {
  const bool fine = body.nodes.size() <= kFineNodes, factorised = body.nodes.size() <= LinearSolver::kDirectRowsMax;
  return {.step_s = fine ? kFineStepS : kTickStepS,
          .tolerance_m = kToleranceM,
          .solver = factorised ? LinearSolver::Method::direct : LinearSolver::Method::automatic};
}

}  // namespace

bool needs_settling(const Scene& scene, const Vec3& start) {
  constexpr double kSamePlaceM = 1e-6;
  const bool beside =
      scene.tool.contact == ContactKind::attach && (scene.body.nodes[scene.tool.node] - start).norm() > kSamePlaceM;
  return beside || scene.body.gravity_m_s2.squaredNorm() > 0;
}

ReferenceForce reference_force(const Scene& scene, const ToolPath& path, const ToolTurns& turns, const ToolOpenings& openings) {
  return reference_forces(scene, std::span(&path, 1), {}, {}, std::span(&turns, turns.empty() ? 0 : 1),
                          std::span(&openings, openings.empty() ? 0 : 1))
      .front();
}

namespace {

/// The scene's rigid parts, as the client meets them with a tool.
std::optional<PartWalls> walls_of(const Scene& scene, const ToolSpec& tool) {
  if (scene.body.parts.empty()) return std::nullopt;
  std::vector<TriangleMesh> meshes;
  std::vector<double> friction;
  for (const auto& part : scene.body.parts) {
    meshes.push_back({part->vertices, part->triangles});
    friction.push_back(part->friction);
  }
  return PartWalls(meshes, friction, drawn_shape(tool), tool.contact_stiffness_n_m);
}

}  // namespace

struct ReferenceModel::State {
  explicit State(const Scene& s)
      : scene(s),
        skin(scene.body, scene.contact_radii()),
        tissue(scene.tool.needle ? std::make_unique<NeedleTissue>(scene, skin) : nullptr),
        dynamics(std::in_place, scene.body),
        integrator(std::in_place, *dynamics, skin, exact_options(scene.body)),
        body(settled_state(*dynamics, s.name)),
        rest(body) {
    if (scene.is_cut_live()) cuts.emplace(BodyInParts{&scene, &skin, &tissue, &dynamics, &body, &rest, &ports});
  }

  ToolAt tool_at(const ToolPort& port, double t_s) const {
    return moved_by(tracks[port.tool].turning(from_seconds(t_s)).centre_of(port.sphere), grasps[port.tool], from_seconds(t_s));
  }
  const ToolSpec& spec_of(std::size_t k) const { return scene.tool_of(held[k]); }
  /// Couples a tool: it grasps its node, or may touch.
  void take_up(std::size_t k, Micros now) {
    const ToolSpec& spec = spec_of(k);
    if (spec.contact == ContactKind::attach) {
      const Vec3 offset = body.x.segment<3>(3 * static_cast<Eigen::Index>(spec.node)) - tracks[k].at(now).position;
      if (fade[k] && offset.norm() > kGraspReachM) return;
      grasps[k] = {now, kGraspTime, offset};
    }
    const ToolPort port = port_of(scene, held[k], static_cast<std::uint32_t>(k));
    const std::optional<std::uint32_t> thread =
        spec.holds.empty() || k != 0 ? std::nullopt : dynamics->sutures().end_of(body, spec.holds.front());
    const std::vector<ToolPort> parts =
        thread ? std::vector{suture_port(body, *thread, port)} : parts_of(spec, tissue.get(), port);
    ports.insert(ports.end(), parts.begin(), parts.end());
    fade[k].reset();
  }
  /// Calls `each` for the ports of a tool that hold or touch the body.
  template <class Each>
  void for_contacts(std::size_t tool, const Each& each) const {
    for (const ToolPort& port : ports)
      if (port.tool == tool && (port.kind == ContactKind::attach || port.touching)) each(port);
  }

  Scene scene;
  Skin skin;
  std::unique_ptr<NeedleTissue> tissue;
  std::optional<Dynamics> dynamics;
  std::optional<Integrator> integrator;
  BodyState body, rest;
  std::vector<std::uint8_t> held;  // number of each tool in the scene
  std::vector<ToolTrack> tracks;
  std::vector<FadingVector> grasps;
  std::vector<std::optional<ReleaseFade>> fade;
  std::vector<ToolPort> ports;
  std::optional<LiveCuts> cuts;
  std::vector<PartWalls> walls;  // for each tool; none without parts
  std::vector<WallTouches> wall_touches;
  std::vector<Wrench> of_walls;  // on each tool
  std::int64_t ticks = 0;
};

ReferenceModel::ReferenceModel(const Scene& scene, std::span<const Vec3> tools, std::span<const std::uint8_t> held)
    : state_(std::make_unique<State>(scene)) {
  State& s = *state_;
  const bool settle = std::any_of(tools.begin(), tools.end(), [&](const Vec3& at) { return needs_settling(scene, at); });
  const Micros begin = settle ? -kSettle : Micros{};
  s.tracks.resize(tools.size());
  s.grasps.resize(tools.size());
  s.fade.resize(tools.size());
  s.held.assign(held.begin(), held.end());
  s.held.resize(tools.size());
  for (std::size_t k = 0; k < tools.size(); ++k)
    if (auto walls = walls_of(scene, s.spec_of(k))) s.walls.push_back(std::move(*walls));
  s.wall_touches.resize(tools.size());
  s.of_walls.resize(tools.size());
  for (std::size_t k = 0; k < tools.size(); ++k) {
    s.tracks[k].add(std::vector{ToolSample{begin, tools[k]}});
    s.take_up(k, begin);
  }
  s.body.time_s = seconds(begin);
}

ReferenceModel::~ReferenceModel() = default;

void ReferenceModel::tick(std::span<const Vec3> tools, std::span<const Rotation> turns, std::span<const double> openings) {
  State& s = *state_;
  const Micros now{1000 * s.ticks};
  for (std::size_t k = 0; k < tools.size(); ++k) {
    s.tracks[k].add(std::vector{
        ToolSample{now, tools[k], turns.empty() ? Orientation() : Orientation(turns[k]), openings.empty() ? 0 : openings[k]}});
    s.tracks[k].forget_before(now - Micros{10'000});
  }
  for (std::size_t k = 0; k < tools.size(); ++k)
    if (s.fade[k] && s.fade[k]->over(now, s.scene, s.held[k], s.skin, s.body.x, s.tracks[k].turning(now))) s.take_up(k, now);
  const auto motion = [&](std::size_t port, double t_s) { return s.tool_at(s.ports[port], t_s); };
  if (!s.integrator->advance(s.body, s.ports, 1e-3 * static_cast<double>(s.ticks), motion).converged)
    throw std::runtime_error("the reference did not converge " + std::to_string(s.ticks) + " ms into the motion");
  for (std::size_t k = 0; k < s.walls.size(); ++k) {
    const ToolPose pose(tools[k], turns.empty() ? Rotation(Rotation::Identity()) : Rotation(turns[k]),
                        openings.empty() ? 0 : openings[k]);
    s.of_walls[k] = s.walls[k].push(pose, s.walls[k].stiffness_n_m(), s.wall_touches[k]);
  }
  if (s.cuts && s.cuts->cut_on()) s.integrator.emplace(*s.dynamics, s.skin, exact_options(s.scene.body));
  ++s.ticks;
}

void ReferenceModel::continue_from(const ReferenceModel& at) {
  if (at.state_->cuts) throw std::runtime_error("a reference that a blade cuts cannot be continued from another");
  State& to = *state_;
  const State& from = *at.state_;
  to.body = from.body;
  to.tracks = from.tracks;
  to.grasps = from.grasps;
  to.fade = from.fade;
  to.ports = from.ports;
  to.wall_touches = from.wall_touches;
  to.of_walls = from.of_walls;
  for (ToolPort& port : to.ports) port.needle.tissue = to.tissue.get();
  to.ticks = from.ticks;
}

void ReferenceModel::reset() {
  State& s = *state_;
  const Micros now{1000 * s.ticks};
  for (std::size_t k = 0; k < s.tracks.size(); ++k) s.fade[k] = ReleaseFade(now, Wrench(force(k), torque(k)));
  if (s.cuts && s.cuts->make_whole()) s.integrator.emplace(*s.dynamics, s.skin, exact_options(s.scene.body));
  s.body.x = s.rest.x;
  s.body.v.setZero();
  s.body.anchors = s.rest.anchors;
  s.body.sutures = s.rest.sutures;
  s.ports.clear();
}

bool ReferenceModel::contact(std::size_t tool) const {
  bool any = false;
  state_->for_contacts(tool, [&](const ToolPort&) { any = true; });
  return any;
}

Vec3 ReferenceModel::force(std::size_t tool) const {
  const State& s = *state_;
  if (s.fade[tool]) return s.of_walls[tool].force + s.fade[tool]->force.at(Micros{1000 * (s.ticks - 1)});
  Vec3 force = s.of_walls[tool].force;
  s.for_contacts(tool, [&](const ToolPort& port) { force -= port.lambda; });
  return force;
}

Vec3 ReferenceModel::torque(std::size_t tool) const {
  const State& s = *state_;
  Vec3 torque = s.of_walls[tool].torque;
  if (!s.spec_of(tool).has_body()) return torque;
  if (s.fade[tool]) return torque + s.fade[tool]->torque.at(Micros{1000 * (s.ticks - 1)});
  const TurningTool at = s.tracks[tool].turning(Micros{1000 * (s.ticks - 1)});
  const std::vector<double> surface = s.skin.place(s.body.x);
  s.for_contacts(
      tool, [&](const ToolPort& port) { torque += wrench_of(port, at, normal_at(s.skin.view(), surface, port.point)).torque; });
  return torque;
}

double ReferenceModel::grip(std::size_t tool) const {
  const State& s = *state_;
  double grip = 0;
  if (!s.spec_of(tool).opens() || s.fade[tool]) return grip;
  const TurningTool at = s.tracks[tool].turning(Micros{1000 * (s.ticks - 1)});
  const std::vector<double> surface = s.skin.place(s.body.x);
  s.for_contacts(tool, [&](const ToolPort& port) {
    const Vec3 normal = normal_at(s.skin.view(), surface, port.point);
    const Vec3 place = contact_place(port, at.centre_of(port.sphere).position, normal);
    grip -= grip_of(port.sphere, at.turn, place - at.at.position, port.lambda);
  });
  return grip;
}

NeedleTip ReferenceModel::tip(std::size_t tool) const {
  for (const ToolPort& port : state_->ports)
    if (port.tool == tool) return port.needle.tip;
  return {};
}

std::vector<ReferenceForce> reference_forces(const Scene& scene, std::span<const ToolPath> paths, std::span<const Micros> resets,
                                             const std::function<void(double)>& progress, std::span<const ToolTurns> turns,
                                             std::span<const ToolOpenings> openings, std::span<const std::uint8_t> held_tools) {
  std::vector<ReferenceForce> result(paths.size());
  if (paths.empty() || paths[0].empty()) return result;
  std::vector<Vec3> tools(paths.size());
  std::vector<Rotation> held(turns.size());
  std::vector<double> opened(openings.size());
  const auto place = [&](std::size_t i) {
    for (std::size_t k = 0; k < paths.size(); ++k) tools[k] = paths[k][i];
    for (std::size_t k = 0; k < turns.size(); ++k) held[k] = turns[k][i];
    for (std::size_t k = 0; k < openings.size(); ++k) opened[k] = openings[k][i];
  };
  place(0);
  ReferenceModel model(scene, tools, held_tools);
  for (std::size_t i = 0; i < paths[0].size(); ++i) {
    place(i);
    for (; !resets.empty() && resets.front() <= Micros{1000 * static_cast<std::int64_t>(i)}; resets = resets.subspan(1))
      model.reset();
    model.tick(tools, held, opened);
    for (std::size_t k = 0; k < paths.size(); ++k) {
      result[k].force.push_back(model.force(k));
      result[k].contact.push_back(model.contact(k));
      const ToolSpec& spec = scene.tool_of(held_tools.empty() ? 0 : held_tools[k]);
      if (spec.has_body()) result[k].torque.push_back(model.torque(k));
      if (spec.needle) result[k].tip.push_back(model.tip(k));
      if (spec.opens()) result[k].grip.push_back(model.grip(k));
    }
    if (progress) progress(static_cast<double>(i + 1) / static_cast<double>(paths[0].size()));
  }
  return result;
}

}  // namespace palpate
