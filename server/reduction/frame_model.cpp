#include "server/reduction/frame_model.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>

#include "common/base/rotation_vector.hpp"

namespace palpate {

double shift_for(Micros horizon) {
  // Horizons are clamped to 33 ms ... 0.4 s. Shifts from 5 to 40 hardly differ (docs/decisions/0010).
  constexpr double kShiftLeast_1_s = 5, kShiftMost_1_s = 60;
  return std::clamp(2.0 / std::max(seconds(horizon), 1e-3), kShiftLeast_1_s, kShiftMost_1_s);
}

FrameModel::FrameModel(const Dynamics& dynamics, const Skin& skin, double softest_1_s2)
    : dynamics_(&dynamics), skin_(&skin), softest_1_s2_(softest_1_s2), spacing_m_(mean_edge_m(dynamics.body())) {
  Eigen::AlignedBox3d box;
  for (const Vec3& x : dynamics.body().nodes) box.extend(x);
  extent_m_ = box.diagonal().norm();
  if (RefinedBody::suits(dynamics))
    bodies_.push_back(std::make_unique<BodyFrame>(*this, std::make_unique<RefinedBody>(dynamics)));
  bodies_.push_back(std::make_unique<BodyFrame>(*this, std::make_unique<WholeBody>(dynamics)));
}

FrameModel::~FrameModel() = default;

void FrameModel::begin(const BodyState& state, const std::vector<ToolPort>& ports, std::span<const ToolAt> tools,
                       Micros horizon) {
  assert(ports.size() == tools.size() && state.x.size() == dynamics_->masses().size());
  state_ = &state;
  ports_ = &ports;
  tools_.assign(tools.begin(), tools.end());
  hands_.clear();
  for (const ToolAt& tool : tools) hands_.push_back({tool.velocity, Vec3::Zero()});
  horizon_ = horizon;
  wanted_.assign(ports.size(), {});
  predicted_.clear();
  positions_.clear();
  if (now_) {
    if (history_.size() == kHistoryFrames) history_.erase(history_.begin());
    history_time_s_ = now_->first;
    history_.push_back(std::move(now_->second));
    now_.reset();
  }
  if (history_time_s_ > state.time_s) history_.clear();  // the room started anew
  for (const auto& body : bodies_) body->begin();
}

void FrameModel::succeed(FrameModel& before, std::span<const std::uint32_t> node_before) {
  listener_ = std::move(before.listener_);
  if (node_before.empty()) return;
  const auto carried = [&](const Vector& x) {
    Vector now(3 * static_cast<Eigen::Index>(node_before.size()));
    for (std::uint32_t k = 0; k < node_before.size(); ++k) at_node(now, k) = at_node(x, node_before[k]);
    return now;
  };
  for (const Vector& x : before.history_) history_.push_back(carried(x));
  history_time_s_ = before.history_time_s_;
  if (before.now_) now_ = {before.now_->first, carried(before.now_->second)};
}

void FrameModel::request_patch(std::size_t k, const ExpectedSlide& slide) {
  assert(k < wanted_.size() && slide.time_s >= 0);
  wanted_[k] = slide;
}

void FrameModel::set_hands(std::vector<HandMotion> hands) {
  assert(hands.size() == tools_.size());
  hands_ = std::move(hands);
}

std::span<const Vector> FrameModel::history() {
  if (history_.empty() || state_->time_s - history_time_s_ >= kHistorySpacingS) now_ = {state_->time_s, state_->x};
  return history_;
}

double FrameModel::shift(Micros horizon) const { return shift_for(ports_->size() > 1 ? horizon_ : horizon); }

const std::vector<double>& FrameModel::positions() {
  if (positions_.empty()) skin_->place(state_->x, positions_);
  return positions_;
}

Vec3 FrameModel::place_of(const ToolPort& port) const {
  if (port.kind == ContactKind::attach) return dynamics_->body().nodes[port.node];
  if (!port.on_path()) return position_at(skin_->view(), skin_->rest(), port.point);
  const Vector& rest = dynamics_->rest_state().x;
  return position_of(*skin_, port, weights_of(*skin_, port), rest);
}

std::vector<FrameModel::SlidingLoad> FrameModel::sliding_loads(std::size_t k) {
  std::vector<SlidingLoad> loads;
  const ToolPort& port = ports()[k];
  if (!wanted_[k] || !port.touching || port.on_path() || wanted_[k]->time_s == 0) return loads;
  for (const Vec3& way : expected_slides(tools_[k].velocity, normal(k), *wanted_[k])) {
    const SurfacePoint end = slide(skin_->view(), positions(), port.point, way);
    const Rotation turn = shortest_rotation(normal(k), normal_at(skin_->view(), positions(), end));
    loads.push_back({end, turn * port.lambda});
  }
  return loads;
}

bool FrameModel::will_touch(std::size_t k, Micros horizon) {
  const ToolPort& port = ports()[k];
  if (port.kind == ContactKind::attach || port.on_path()) return false;
  if (port.touching || !wanted_[k]) return port.touching;
  const Vec3 above = gap(k);
  const HandMotion way = path(k, horizon);
  const double t = seconds(horizon);
  return normal(k).dot(above + t * way.velocity + 0.5 * t * t * way.acceleration) < 0;
}

Vec3 FrameModel::gap(std::size_t k) {
  const ToolPort& port = ports()[k];
  return tools_[k].position - port.sphere.radius_m * normal(k) - position_at(skin_->view(), positions(), port.point);
}

StaticIndentations& FrameModel::indentations(std::size_t k) {
  return indentations_.try_emplace(k, dynamics_->body()).first->second;
}

BodyFrame::BodyFrame(FrameModel& frame, std::unique_ptr<BodyOperator> body) : frame_(&frame), body_(std::move(body)) {}

void BodyFrame::begin() {
  settled_ = linearised_ = false;
  subdomain_ = nullptr;
  forces_.reset();
  total_.reset();
  fading_.reset();
  snapshots_.reset();
  systems_used_ = 0;
}

void BodyFrame::settle() {
  if (settled_) return;
  settled_ = true;
  std::vector<Vec3> places;
  std::vector<std::uint32_t> nodes;
  for (std::size_t k = 0; k < frame_->ports().size(); ++k) {
    const ToolPort& port = frame_->ports()[k];
    if (port.kind == ContactKind::attach) {
      places.push_back(frame_->place_of(port));
      nodes.push_back(port.node);
    } else if (port.touching || frame_->is_wanted(k)) {
      places.push_back(frame_->place_of(port));
      for (const auto& [node, weight] : weights_of(frame_->skin(), port)) nodes.push_back(node);
    }
  }
  const std::uint64_t before = body_->generation();
  body_->focus(places, nodes);
  if (body_->generation() != before) systems_.clear();
  held_ = body_->fixed();
  for (const ToolPort& port : frame_->ports())
    if (port.kind == ContactKind::attach) held_[coordinate(port.node)] = 1;
}

const std::vector<std::uint8_t>& BodyFrame::held() {
  settle();
  return held_;
}

Linearisation BodyFrame::linearisation() {
  settle();
  if (!linearised_) body_->take(frame_->state());
  linearised_ = true;
  Linearisation at;
  at.body = body_.get();
  at.held = &held_;
  at.part = subdomain_ ? &subdomain_->body() : dynamic_cast<const WholeBody*>(body_.get());
  at.subdomain = subdomain_;
  at.coarse = body_->coarse();
  at.pieces = body_->pieces();
  return at;
}

void BodyFrame::select_subdomain(std::size_t which) {
  const auto* const refined = dynamic_cast<const RefinedBody*>(body_.get());
  if (!refined) return;
  linearisation();
  NonlinearSubdomain& subdomain = subdomains_.try_emplace(which, *refined).first->second;
  subdomain.take(frame_->place_of(frame_->ports()[which]), frame_->state());
  subdomain_ = &subdomain;
}

const SnapshotSet& BodyFrame::snapshots() {
  if (snapshots_) return *snapshots_;
  settle();
  const Vector& now = frame_->state().x;
  SnapshotSet& snapshots = snapshots_.emplace();
  for (const Vector& x : frame_->history()) snapshots.add(SnapshotKind::history, body_->displacement(now, x));
  for (const PredictedState& state : frame_->predicted_states())
    snapshots.add(state.kind, body_->displacement(now, state.x), state.weight);
  snapshots.add(SnapshotKind::rest, body_->displacement(now, frame_->dynamics().rest_state().x));
  return snapshots;
}

const Vector& BodyFrame::forces() {
  if (!forces_) {
    linearisation();
    forces_ = body_->forces();
    mask(held_, *forces_);
  }
  return *forces_;
}

const Vector& BodyFrame::total() {
  if (!total_) {
    total_ = forces();
    for (const ToolPort& p : frame_->ports())
      if (p.in_contact()) scatter(weights(p), p.lambda, *total_);
    mask(held_, *total_);
  }
  return *total_;
}

const std::vector<Vector>& BodyFrame::fading() {
  if (!fading_) {
    linearisation();
    fading_ = body_->fading();
  }
  return *fading_;
}

SharedSystem* BodyFrame::system(SystemKey key, double tolerance) {
  for (std::size_t k = 0; k < systems_used_; ++k)
    if (systems_[k].key() == key) return systems_[k].is_definite() ? &systems_[k] : nullptr;
  frame_->enter(BuildPhase::linearise);
  Linearisation at = linearisation();
  if (key.held != held_) at.coarse = nullptr;  // it is that of a body whose far nodes move
  if (systems_used_ == systems_.size()) systems_.emplace_back(frame_->dynamics());
  SharedSystem& system = systems_[systems_used_++];
  return system.prepare(at, std::move(key), tolerance) ? &system : nullptr;
}

std::vector<Vector> BodyFrame::sliding_loads(std::size_t k) {
  std::vector<Vector> loads;
  const ToolPort& port = frame_->ports()[k];
  for (const FrameModel::SlidingLoad& to : frame_->sliding_loads(k)) {
    Vector& load = loads.emplace_back(Vector::Zero(linearisation().masses().size()));
    scatter(weights(to.end), to.lambda_end, load);
    scatter(weights(port.point), -port.lambda, load);
    mask(held(), load);
  }
  return loads;
}

bool BodyFrame::respond(SharedSystem& p, std::size_t which, bool own) {
  SharedSystem::Loads loads;
  for (std::size_t k = 0; k < frame_->ports().size(); ++k) {
    const ToolPort& port = frame_->ports()[k];
    const bool touch = port.kind == ContactKind::touch;
    if (k != which && !(touch && (port.touching || frame_->is_wanted(k)))) continue;
    if (!p.knows(k) && touch) p.add_touch(k, weights(port));
    if (!p.knows(k) && !touch) p.add_grasp(k, coordinate(port.node));
    if (auto slides = sliding_loads(k); !slides.empty()) loads.slides.emplace(k, std::move(slides));
  }
  Vector momentum;
  if (own) {
    momentum = p.at().free_momentum();
    loads.motion = &momentum;
    loads.residual = &total();
  }
  frame_->enter(BuildPhase::solve);
  const bool definite = p.respond(loads);
  frame_->enter(BuildPhase::other);
  return definite;
}

}  // namespace palpate
