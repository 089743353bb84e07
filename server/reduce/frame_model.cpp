#include "server/reduce/frame_model.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cassert>

namespace palpate {
namespace {

constexpr double kSlidesLooser = 2.5;  // SolveColumn::tolerance_factor: slides are less certain than the present loads

}  // namespace

double shift_for(Micros horizon) {
  // Horizons are clamped to 33 ms ... 0.4 s. Shifts from 5 to 40 hardly differ (docs/decisions/0010).
  constexpr double kShiftLeast_1_s = 5, kShiftMost_1_s = 60;
  return std::clamp(2.0 / std::max(seconds(horizon), 1e-3), kShiftLeast_1_s, kShiftMost_1_s);
}

bool SharedSystem::prepare(const Linearisation& at, double shift, bool clamp, double tolerance) {
  at_ = at;
  shift_ = shift;
  assert(shift >= 0 && tolerance > 0);
  tolerance_ = tolerance;
  fresh_.clear();
  residual_.fresh = motion_.fresh = false;
  return definite_ = solver_.prepare(at, shift, clamp);
}

bool SharedSystem::respond(std::span<const PortPlace> places, const OwnLoads& own) {
  std::vector<SolveColumn> columns;
  std::vector<std::size_t> asked;
  for (const PortPlace& place : places) {
    const auto known = fresh_.find(place.port);
    const bool here = known != fresh_.end() && known->second.point.triangle == place.point.triangle &&
                      known->second.point.weight == place.point.weight;
    PortResponse& port = ports_[place.port];
    if (!here) {
      port.b = place.b;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        port.input[axis] = Vector::Zero(at_.masses().size());
        scatter(port.b, Vec3::Unit(static_cast<int>(axis)), port.input[axis]);
        mask(*at_.held, port.input[axis]);
        columns.push_back({&port.input[axis], &port.response[axis]});
      }
      asked.push_back(place.port);
    }
    Fresh& fresh = fresh_[place.port] = {place.point, here && known->second.slides};
    if (fresh.slides) continue;
    port.slides.resize(place.slides.size());
    for (std::size_t k = 0; k < place.slides.size(); ++k) columns.push_back({&place.slides[k], &port.slides[k], kSlidesLooser});
    fresh.slides = !place.slides.empty();
  }
  for (const auto& [load, response] : {std::pair{own.residual, &residual_}, std::pair{own.motion, &motion_}}) {
    if (!load || response->fresh) continue;
    columns.push_back({load, &response->x, kOwnLooser});
    response->fresh = true;
  }
  if (columns.empty()) return definite_;
  definite_ = definite_ && solve(columns);
  if (!definite_) return false;  // there may be no responses
  for (const std::size_t k : asked) {
    PortResponse& port = ports_[k];
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column)
        port.compliance(row, column) =
            port.input[static_cast<std::size_t>(row)].dot(port.response[static_cast<std::size_t>(column)]);
  }
  return definite_;
}

FrameModel::FrameModel(const Dynamics& dynamics, const Skin& skin)
    : dynamics_(&dynamics), skin_(&skin), whole_body_(new WholeBody(dynamics)), body_(whole_body_) {
  if (RefinedBody::suits(dynamics)) refined_.reset(new FrameModel(this));
}

FrameModel::FrameModel(FrameModel* whole)
    : dynamics_(whole->dynamics_),
      skin_(whole->skin_),
      whole_(whole),
      refined_body_(new RefinedBody(*dynamics_)),
      body_(refined_body_) {}

void FrameModel::begin(const BodyState& state, const std::vector<ToolPort>& ports, std::span<const ToolAt> tools,
                       Micros horizon) {
  state_ = &state;
  ports_ = &ports;
  assert(ports.size() == tools.size() && state.x.size() == dynamics_->masses().size());
  tools_.assign(tools.begin(), tools.end());
  hands_.clear();
  for (const ToolAt& tool : tools) hands_.push_back({tool.velocity, Vec3::Zero()});
  horizon_ = horizon;
  wanted_.assign(ports.size(), {});
  settled_ = linearised_ = placed_ = false;
  forces_.resize(0);
  fading_.reset();
  total_.resize(0);
  predicted_.clear();
  snapshots_.reset();
  subdomain_ = nullptr;
  record_history();
  for (Slot& slot : slots_) slot.in_use = false;
  if (refined_) refined_->begin(state, ports, tools, horizon);
}

void FrameModel::request_patch(std::size_t k, const ExpectedSlide& slide) {
  assert(k < wanted_.size() && slide.time_s >= 0);
  wanted_[k] = {true, slide, {}};
  if (refined_) refined_->request_patch(k, slide);
}

void FrameModel::set_hands(std::vector<HandMotion> hands) {
  assert(hands.size() == tools_.size());
  if (refined_) refined_->set_hands(hands);
  hands_ = std::move(hands);
}

void FrameModel::listen(std::function<void(BuildPhase)> listener) {
  if (refined_) refined_->listen(listener);
  listener_ = std::move(listener);
}

void FrameModel::record_history() {
  if (now_) {
    if (past_.size() == kHistoryFrames) past_.pop_front();
    past_.push_back(std::move(*now_));
    now_.reset();
  }
  if (!past_.empty() && past_.back().time_s > state_->time_s) past_.clear();  // the room started anew
}

/// Determines the held nodes, and the coordinates of a locally refined body, once all ports have their points for this frame.
void FrameModel::settle() {
  if (settled_) return;
  settled_ = true;
  std::vector<Vec3> places;
  std::vector<std::uint32_t> nodes;
  for (std::size_t k = 0; k < ports_->size(); ++k) {
    const ToolPort& port = (*ports_)[k];
    if (port.kind == ContactKind::attach) {
      places.push_back(place_of(port));
      nodes.push_back(port.node);
    } else if (port.touching || wanted_[k].patch) {
      places.push_back(place_of(port));
      for (const auto& [node, weight] : skin_->weights(port.point)) nodes.push_back(node);
    }
  }
  const std::uint64_t before = body_->generation();
  body_->focus(places, nodes);
  if (body_->generation() != before) slots_.clear();
  held_ = body_->fixed();
  for (const ToolPort& port : *ports_)
    if (port.kind == ContactKind::attach) held_[coordinate(port.node)] = 1;
}

const std::vector<std::uint8_t>& FrameModel::held() {
  settle();
  return held_;
}

const SnapshotSet& FrameModel::snapshots() {
  if (snapshots_) return *snapshots_;
  settle();
  const auto moved_to = [&](const Vector& x) { return body_->displacement(state_->x, x); };
  SnapshotSet& snapshots = snapshots_.emplace();
  FrameModel& whole = whole_ ? *whole_ : *this;
  for (const Known& known : whole.past_) snapshots.add(SnapshotKind::history, moved_to(known.x));
  for (const PredictedState& state : whole.predicted_) snapshots.add(state.kind, moved_to(state.x), state.weight);
  snapshots.add(SnapshotKind::rest, moved_to(dynamics_->rest_state().x));
  if (whole.past_.empty() || state_->time_s - whole.past_.back().time_s >= kHistorySpacingS)
    whole.now_ = Known{state_->time_s, state_->x};
  return snapshots;
}

Linearisation FrameModel::linearisation(const std::vector<std::uint8_t>& held) {
  assert(state_);
  settle();
  if (!linearised_) body_->take(*state_);
  linearised_ = true;
  Linearisation at;
  at.body = body_.get();
  at.held = &held;
  at.part = subdomain_ ? &subdomain_->body() : whole_body_;
  at.subdomain = subdomain_;
  at.coarse = body_->coarse();
  at.pieces = body_->pieces();
  return at;
}

Skin::Weights FrameModel::weights(const SurfacePoint& point) const { return body_->restricted(skin_->weights(point)); }

Vec3 FrameModel::place_of(const ToolPort& port) const {
  return port.kind == ContactKind::attach ? dynamics_->body().nodes[port.node]
                                          : position_at(skin_->view(), skin_->rest(), port.point);
}

void FrameModel::select_subdomain(std::size_t which) {
  if (!refined_body_) return;
  linearisation();
  NonlinearSubdomain& subdomain = subdomains_.try_emplace(which, *refined_body_).first->second;
  subdomain.take(place_of((*ports_)[which]), *state_);
  subdomain_ = &subdomain;
}

const Vector& FrameModel::forces() {
  if (forces_.size() == 0) {
    linearisation();
    forces_ = body_->forces();
    mask(held(), forces_);
  }
  return forces_;
}

const std::vector<Vector>& FrameModel::fading() {
  if (!fading_) {
    linearisation();
    fading_ = body_->fading();
  }
  return *fading_;
}

const Vector& FrameModel::total() {
  if (total_.size() == 0) {
    total_ = forces();
    for (const ToolPort& p : *ports_)
      if (p.kind == ContactKind::touch && p.touching) scatter(weights(p.point), p.lambda, total_);
    mask(held(), total_);
  }
  return total_;
}

Vector FrameModel::forces_beside(std::size_t which) {
  Vector f = forces();
  for (std::size_t k = 0; k < ports_->size(); ++k) {
    const ToolPort& p = (*ports_)[k];
    if (k != which && p.kind == ContactKind::touch && p.touching) scatter(weights(p.point), p.lambda, f);
  }
  mask(held(), f);
  return f;
}

const std::vector<double>& FrameModel::positions() {
  if (whole_) return whole_->positions();
  if (!placed_) skin_->place(state_->x, positions_);
  placed_ = true;
  return positions_;
}

double FrameModel::shift(Micros horizon) const { return shift_for(ports_->size() > 1 ? horizon_ : horizon); }

SharedSystem* FrameModel::system(double shift, bool clamp, double tolerance) {
  settle();
  const auto known =
      std::find_if(slots_.begin(), slots_.end(), [&](const Slot& s) { return s.in_use && s.shift == shift && s.clamp == clamp; });
  if (known != slots_.end()) return known->definite ? known->system.get() : nullptr;
  // Any slot of an earlier frame can be reused; one with a similar shift has better first guesses.
  Slot* best = nullptr;
  for (Slot& slot : slots_)
    if (!slot.in_use && (!best || std::abs(slot.shift - shift) < std::abs(best->shift - shift))) best = &slot;
  if (!best) {
    best = &slots_.emplace_back();
    best->system = std::make_unique<SharedSystem>(*dynamics_);
  }
  enter(BuildPhase::linearise);
  best->shift = shift;
  best->clamp = clamp;
  best->in_use = true;
  best->definite = best->system->prepare(linearisation(), shift, clamp, tolerance);
  return best->definite ? best->system.get() : nullptr;
}

Mat3 FrameModel::contact_stiffness(std::size_t k, const PortResponse& response) {
  const ToolPort& port = (*ports_)[k];
  const double tissue_n_m = 3 / std::max(response.compliance.trace(), 1e-12);
  const double contact_stiffness_n_m = port.parameters.contact_stiffness_n_m;
  assert(contact_stiffness_n_m >= 0);
  const double k_o = contact_stiffness_n_m > 0 ? std::min(contact_stiffness_n_m, kContactStiffnessRatioMax * tissue_n_m)
                                               : kContactStiffnessRatioMax * tissue_n_m;
  const Vec3 n = normal_at(skin_->view(), positions(), port.point);
  const double push = -port.lambda.dot(n);
  const double across = (port.lambda + push * n).norm();
  constexpr double kSlippingShare = 0.99;  // of the cone: a slipping force is on it up to rounding and solver tolerance
  const bool slips = across >= kSlippingShare * port.parameters.friction * push;
  return slips ? Mat3(k_o * n * n.transpose()) : Mat3(k_o * Mat3::Identity());
}

void FrameModel::add_held_nodes(std::size_t which, Vector& load_rate) {
  Vector motion;
  for (std::size_t k = 0; k < ports_->size(); ++k) {
    if (k == which || (*ports_)[k].kind != ContactKind::attach || tools_[k].velocity.isZero(0)) continue;
    if (motion.size() == 0) motion = Vector::Zero(size());
    at_node(motion, coordinate((*ports_)[k].node)) = tools_[k].velocity;
  }
  if (motion.size() == 0) return;
  Matrix k_motion, d_motion;
  linearisation().body->multiply(motion, k_motion, d_motion);
  if (load_rate.size() == 0) load_rate = Vector::Zero(motion.size());
  load_rate -= k_motion;
  mask(held(), load_rate);
}

OtherTools FrameModel::other_nodes(std::size_t which) {
  OtherTools others;
  add_held_nodes(which, others.load_rate);
  return others;
}

std::span<const Vector> FrameModel::sliding_loads(std::size_t k) {
  Wanted& wanted = wanted_[k];
  if (wanted.loads) return *wanted.loads;
  const ToolPort& port = (*ports_)[k];
  std::vector<Vector>& loads = wanted.loads.emplace();
  if (!port.touching || wanted.slide.time_s == 0) return loads;
  const Vec3 normal = normal_at(skin_->view(), positions(), port.point);
  for (const Vec3& way : expected_slides(tools_[k].velocity, normal, wanted.slide)) {
    Vector& load = loads.emplace_back(Vector::Zero(size()));
    const SurfacePoint end = slide(skin_->view(), positions(), port.point, way);
    const auto turn = Eigen::Quaterniond::FromTwoVectors(normal, normal_at(skin_->view(), positions(), end));
    scatter(weights(end), turn * port.lambda, load);
    scatter(weights(port.point), -port.lambda, load);
    mask(held(), load);
  }
  return loads;
}

bool FrameModel::respond(SharedSystem& p, std::size_t which, Own own) {
  std::vector<SharedSystem::PortPlace> places;
  for (std::size_t k = 0; k < ports_->size(); ++k) {
    const ToolPort& port = (*ports_)[k];
    if (port.kind == ContactKind::touch && (port.touching || wanted_[k].patch || k == which))
      places.push_back({k, port.point, weights(port.point), sliding_loads(k)});
  }
  Vector momentum;
  if (own.motion) momentum = linearisation().free_momentum();
  enter(BuildPhase::solve);
  const bool definite = p.respond(places, {own.residual ? &total() : nullptr, own.motion ? &momentum : nullptr});
  enter(BuildPhase::other);
  return definite;
}

/// Returns B_a^T X_b relative to the geometric mean of the two compliances: 0 if neither tool moves the body under the other, 1
/// if they are at one place.
double FrameModel::coupling(const SharedSystem& p, std::size_t a, std::size_t b) const {
  Mat3 across;
  for (int axis = 0; axis < 3; ++axis) across.col(axis) = gather(p.port(a).b, p.port(b).response[static_cast<std::size_t>(axis)]);
  return across.norm() / std::max(std::sqrt(p.port(a).compliance.norm() * p.port(b).compliance.norm()), 1e-300);
}

bool FrameModel::will_touch(std::size_t k, Micros horizon) {
  const ToolPort& port = (*ports_)[k];
  if (port.touching || !wanted_[k].patch) return port.touching;
  const Vec3 above = tools_[k].position - position_at(skin_->view(), positions(), port.point);
  const Vec3 normal = normal_at(skin_->view(), positions(), port.point);
  const HandMotion way = path(k, horizon);
  const double t = seconds(horizon);
  return normal.dot(above + t * way.velocity + 0.5 * t * t * way.acceleration) < 0;
}

std::vector<std::size_t> FrameModel::neighbours(const SharedSystem& p, std::size_t which, Micros horizon) {
  std::vector<std::pair<double, std::size_t>> found;
  for (std::size_t k = 0; k < ports_->size(); ++k)
    if (k != which && (*ports_)[k].kind == ContactKind::touch && will_touch(k, horizon))
      found.emplace_back(-coupling(p, which, k), k);
  std::sort(found.begin(), found.end());
  std::vector<std::size_t> tools;
  for (const auto& [less, k] : found) tools.push_back(k);
  return tools;
}

OtherTools FrameModel::others(const SharedSystem& p, std::size_t which, std::span<const std::size_t> contacts) {
  assert(which < ports_->size());
  OtherTools others = other_nodes(which);
  for (const std::size_t k : contacts) others.contacts.push_back({&p.port(k), k});
  for (std::size_t k = 0; k < ports_->size(); ++k) {
    const ToolPort& port = (*ports_)[k];
    if (k == which || port.kind != ContactKind::touch || !port.touching) continue;
    if (std::find(contacts.begin(), contacts.end(), k) != contacts.end()) continue;
    const PortResponse& response = p.port(k);
    const Mat3 stiffness = contact_stiffness(k, response);
    others.springs.push_back({&response, stiffness, coupling(p, which, k) > kCoupledShare});
    if (others.load.size() == 0) others.load = Vector::Zero(size());
    scatter(response.b, port.lambda, others.load);
    const Vec3 rate = stiffness * tools_[k].velocity;
    if (rate.isZero(0)) continue;
    if (others.load_rate.size() == 0) others.load_rate = Vector::Zero(size());
    scatter(response.b, rate, others.load_rate);
  }
  if (others.load.size() > 0) mask(held(), others.load);
  if (others.load_rate.size() > 0) mask(held(), others.load_rate);
  return others;
}

SpringCorrection::SpringCorrection(const OtherTools& others) {
  for (const OtherTools::Spring& spring : others.springs)
    if (spring.coupled) coupled_.push_back(&spring);
  const auto n = static_cast<Eigen::Index>(3 * coupled_.size());
  Matrix system = Matrix::Identity(n, n), stiffness = Matrix::Zero(n, n);
  for (Eigen::Index i = 0; i < n / 3; ++i) {
    const OtherTools::Spring& row = *coupled_[static_cast<std::size_t>(i)];
    stiffness.block<3, 3>(3 * i, 3 * i) = row.stiffness;
    for (Eigen::Index j = 0; j < n; ++j) {
      const PortResponse& column = *coupled_[static_cast<std::size_t>(j / 3)]->port;
      system.block<3, 1>(3 * i, j) += row.stiffness * gather(row.port->b, column.response[static_cast<std::size_t>(j % 3)]);
    }
  }
  if (n > 0) gain_ = system.partialPivLu().solve(stiffness);
}

void SpringCorrection::apply(Vector& x) const {
  if (coupled_.empty()) return;
  Vector at_ports(3 * static_cast<Eigen::Index>(coupled_.size()));
  for (std::size_t i = 0; i < coupled_.size(); ++i)
    at_ports.segment<3>(3 * static_cast<Eigen::Index>(i)) = gather(coupled_[i]->port->b, x);
  const Vector forces = gain_ * at_ports;
  for (std::size_t i = 0; i < coupled_.size(); ++i) {
    const auto& response = coupled_[i]->port->response;
    const Vec3 force = forces.segment<3>(static_cast<Eigen::Index>(3 * i));
    x -= force.x() * response[0] + force.y() * response[1] + force.z() * response[2];
  }
}

}  // namespace palpate
