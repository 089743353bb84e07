#include "server/room/room.hpp"

#include <algorithm>
#include <cassert>
#include <span>

#include "server/room/nodal_fields.hpp"
#include "server/room/room_state.hpp"

namespace palpate {
namespace {

constexpr double kHomeHeightM = 0.020;  // above the top of the body: clear of it, and near

/// Without the nodes that ligaments are fixed to, which come last.
std::size_t own_nodes(const LumpedBody& body) {
  std::size_t own = 0;
  const auto count = [&](const auto& nodes) {
    for (const std::uint32_t node : nodes) own = std::max<std::size_t>(own, node + 1);
  };
  for (const Triangle& t : body.triangles) count(t);
  for (const Tetrahedron& t : body.tetrahedra) count(t.nodes);
  for (const Hexahedron& h : body.hexahedra) count(h.nodes);
  return own > 0 ? own : body.nodes.size();
}

}  // namespace

Room::Room(const Scene& scene) : state_(std::make_unique<State>(scene)) {}
Room::~Room() = default;
Room::Room(Room&&) noexcept = default;
Room& Room::operator=(Room&&) noexcept = default;

Vec3 home_of(const Scene& scene) {
  const LumpedBody& body = scene.body;
  if (scene.tool.contact == ContactKind::attach) return body.nodes[scene.tool.node];
  Vec3 centre = Vec3::Zero();
  double top = -1e300;
  const std::span<const Vec3> own = std::span(body.nodes).first(own_nodes(body));
  for (const Vec3& x : own) {
    centre += x / static_cast<double>(own.size());
    top = std::max(top, x.z());
  }
  return {centre.x(), centre.y(), top + kHomeHeightM};
}

void Room::use_threads(ThreadPool& pool) { state_->integrator.stepper->use_threads(pool); }

std::optional<Room::Origin> Room::origin(StationId id) const {
  const auto owner = std::find(state_->port_owner.begin(), state_->port_owner.end(), id);
  if (owner == state_->port_owner.end()) return std::nullopt;
  return Origin{state_->body, state_->ports[static_cast<std::size_t>(owner - state_->port_owner.begin())],
                state_->stations.at(id).modes.of_nodes()};
}

const std::string& Room::integrator() const { return state_->integrator.reason; }

void Room::start(Micros body_time) {
  state_->body.time_s = seconds(body_time);
  state_->stations.clear();
  state_->ports.clear();
  state_->port_owner.clear();
  state_->snapshot_cache.clear();
  state_->warm_started.clear();
}

bool Room::resume(const Vector& x, const Vector& v, const Eigen::MatrixXf& relaxed) {
  State& s = *state_;
  assert(x.size() == s.rest.x.size() && v.size() == s.rest.v.size());
  s.body.x = x;
  s.body.v = v;
  for (std::uint32_t node = 0; node < s.dynamics.nodes(); ++node) {
    if (s.scene.body.fixed[node] == 0) continue;
    at_node(s.body.x, node) = at_node(s.rest.x, node);
    at_node(s.body.v, node).setZero();
  }
  const bool remembers = s.dynamics.relaxation().take_up(relaxed, s.body);
  s.fall_asleep();
  return remembers;
}

FrameResult Room::simulate(const FrameJob& job) {
  State& s = *state_;
  FrameResult result;
  if (s.asleep) s.body.time_s = std::max(s.body.time_s, seconds(job.begin));
  s.take_samples(job);
  if (job.reset) s.reset_body();
  s.sync_ports(job);
  AdvanceReport report;
  if (s.sleeps_through(job)) {
    s.body.time_s = seconds(job.target);
  } else {
    for (auto& [id, station] : s.stations) station.measured_height.reset(), station.kept.reset();
    report = s.advance(job);
  }
  result.steps = report.steps;
  result.cut_steps = report.cut_steps;
  result.newton_iterations = report.newton_iterations;
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
  if (job.state) result.state = s.body;
  for (const ShapeChannel which : {ShapeChannel::tension, ShapeChannel::stress, ShapeChannel::strain, ShapeChannel::pressure})
    if (job.asks_for(which)) result.fields[index_of(which)] = nodal_field(s.dynamics, s.body, which);
  return result;
}

void Room::build_patches(const FrameJob& job, FrameResult& result) {
  const std::vector<std::uint8_t> gets_patch = state_->begin_patches(job);
  assert(gets_patch.size() == job.stations.size());
  for (std::size_t k = 0; k < job.stations.size(); ++k) {
    StationFrame frame;
    frame.id = job.stations[k].id;
    if (!result.failed) frame = state_->frame_of(job.stations[k], job.target, gets_patch[k] != 0);
    result.stations.push_back(std::move(frame));
  }
  if (!job.asks_for(ShapeChannel::support) || result.positions.empty()) return;
  std::vector<float>& support = result.fields[index_of(ShapeChannel::support)];
  support.assign(result.positions.size(), 0.0F);
  for (const StationFrame& frame : result.stations)
    if (frame.patch) add_support(*frame.patch, result.positions, support);
}

void Room::listen(std::function<void(PatchPart)> listener) { state_->frame_model.listen(std::move(listener)); }

FrameResult Room::run(const FrameJob& job) {
  FrameResult result = simulate(job);
  build_patches(job, result);
  return result;
}

}  // namespace palpate
