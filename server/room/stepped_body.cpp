// Steps or sleep of the body.
#include "server/room/stepped_body.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "common/player/player.hpp"
#include "server/reduction/basis.hpp"

namespace palpate {

SteppedBody::SteppedBody(const Scene& scene, const SteppedBody* like)
    : scene_(scene),
      skin_(scene_.body, scene_.contact_radii()),
      tissue_(scene_.tool.needle ? std::make_unique<NeedleTissue>(scene_, skin_) : nullptr),
      dynamics_(std::in_place, scene_.body),
      integrator_(like ? same_stepper(like->integrator_, *dynamics_, skin_) : choose_stepper(scene_, *dynamics_, skin_)),
      rest_(like ? like->rest_begun() : settled_state(*dynamics_, scene_.name)),
      body_(rest_),
      softest_1_s2_(like ? like->softest_1_s2_ : softest_stiffness(*dynamics_)),
      stillness_(std::in_place, *dynamics_, softest_1_s2_, rest_.x) {
  if (scene_.is_cut_live()) cuts_.emplace(BodyInParts{&scene_, &skin_, &tissue_, &dynamics_, &body_, &rest_, &ports_});
  fall_asleep();
}

void SteppedBody::start(Micros body_time) {
  body_.time_s = seconds(body_time);
  tools_.clear();
  ports_.clear();
}

bool SteppedBody::resume(const Vector& x, const Vector& v, const Eigen::MatrixXf& relaxed,
                         std::shared_ptr<const SutureState> threads) {
  assert(x.size() == rest_.x.size() && v.size() == rest_.v.size());
  body_.x = x;
  body_.v = v;
  if (threads) body_.sutures = std::move(threads);
  for (std::uint32_t node = 0; node < dynamics_->nodes(); ++node) {
    if (scene_.body.fixed[node] == 0) continue;
    at_node(body_.x, node) = at_node(rest_.x, node);
    at_node(body_.v, node).setZero();
  }
  const bool remembers = dynamics_->relaxation().take_up(relaxed, body_);
  fall_asleep();
  return remembers;
}

std::optional<CutChange> SteppedBody::cut_again(const std::vector<CutStep>& cuts) {
  if (cuts.empty()) return std::nullopt;
  assert(cuts_);
  const CutChange change = cuts_->repeat(cuts);
  renew_steppers();
  return change;
}

std::optional<AdvanceReport> SteppedBody::step(const FrameJob& job) {
  released_.clear();
  suture_news_ = {};
  parted_.reset();
  if (asleep_) body_.time_s = std::max(body_.time_s, seconds(job.begin));
  take_samples(job);
  if (job.begin > time()) leave_out_until(job.begin);
  if (job.reset) reset();
  use_buttons(job);
  sync_ports(job);
  const std::shared_ptr<const SutureState> threads = body_.sutures;
  std::optional<AdvanceReport> report;
  if (sleeps_through(job)) {
    body_.time_s = seconds(job.target);
  } else {
    report = advance(job);
    if (!report->converged) {
      // Continues from the last good shape, at rest and released: one frame that does not converge must not stop the room.
      body_.v.setZero();
      for (ToolPort& port : ports_) port.touching = port.suture.has_value(), port.clearance = {}, port.lambda.setZero();
      body_.time_s = seconds(job.target);
    }
  }
  if (threads) {
    suture_news_.torn_m = body_.sutures->torn_m - threads->torn_m;
    suture_news_.torn_out = body_.sutures->torn_out - threads->torn_out;
    let_threads_go();
  }
  asleep_ &= job.may_sleep;
  if (report && report->steps > 0 && job.may_sleep) fall_asleep();
  return report;
}

/// Replaces the steppers after a change of the body's nodes. The kind of integrator and the softest mode are those of the uncut
/// body.
void SteppedBody::renew_steppers() {
  integrator_ = same_stepper(integrator_, *dynamics_, skin_);
  // Under gravity the rest of the uncut body is no equilibrium of a cut one.
  stillness_.emplace(*dynamics_, softest_1_s2_, cuts_->steps() && !scene_.body.gravity_m_s2.isZero(0) ? Vector() : rest_.x);
  asleep_ = false;
  ++epoch_;
}

/// Skips time with the body unchanged; the tools are led from their old positions to those at `begin`.
void SteppedBody::leave_out_until(Micros begin) {
  for (auto& [id, tool] : tools_)
    if (!tool.track.empty()) tool.track.skip(time(), begin);
  body_.time_s = seconds(begin);
}

/// Puts the body to sleep if it may sleep. Its remaining velocity is zeroed, so it stays where it is to the bit.
void SteppedBody::fall_asleep() {
  const bool alone =
      std::none_of(ports_.begin(), ports_.end(), [](const ToolPort& p) { return p.kind == ContactKind::attach || p.touching; });
  asleep_ = alone && !body_.traction && stillness_->holds(body_);
  if (asleep_) body_.v.setZero();
}

/// Returns true if a tool holds the body or a thread, or may meet the body, where it is, before `until`.
bool SteppedBody::may_meet(std::size_t k, Micros until) const {
  assert(k < ports_.size());
  constexpr double kStrayMarginM = 0.001;  // a hand strays less between two checks
  if (ports_[k].kind == ContactKind::attach || ports_[k].suture) return true;
  const Vec3 from = tool(k, time()).position;
  double way_m = (tool(k, until).position - from).norm();
  for (Micros t = time(); t < until; t += kTick) way_m = std::max(way_m, (tool(k, t).position - from).norm());
  return nearest_within(k, from, way_m + ports_[k].sphere.radius_m + kStrayMarginM).has_value();
}

std::optional<NearestPoint> SteppedBody::nearest_within(std::size_t k, const Vec3& tool, double far_m) const {
  if (skin_.empty() || skin_.distance_at_least(tool, body_.x) >= far_m) return std::nullopt;
  const NearestPoint nearest = skin_.nearest(ports_[k].skin_copy, skin_.place(body_.x), tool);
  return nearest.height_m < far_m ? std::optional(nearest) : std::nullopt;
}

bool SteppedBody::sleeps_through(const FrameJob& job) const {
  if (!asleep_ || !job.may_sleep) return false;
  for (std::size_t k = 0; k < ports_.size(); ++k)
    if (may_meet(k, job.target)) return false;
  return true;
}

// A frame that has to make up for lost time (the machine was busy) costs no more than kCatchUpFramesMax frames: its steps are
// longer instead. With more steps of the same length a room that is late would fall further behind.
AdvanceReport SteppedBody::advance(const FrameJob& job) {
  constexpr int kCatchUpFramesMax = 2;  // more: more accurate steps, and later frames
  double step_s = integrator_.step_s;
  const double behind = (seconds(job.target) - body_.time_s) / std::max(kCatchUpFramesMax * seconds(job.frame), 1e-9);
  if (job.frame > Micros{} && behind > 1) step_s *= behind;
  // Half of the allowance for forces that are not computed, which is a fifth of what the hand-over of patches hides.
  constexpr double kLeftOutForceN = 0.005;
  integrator_.stepper->set_quiescence_tolerance(job.may_sleep ? kLeftOutForceN : 0);
  const Micros whole = job.target - time();
  allowance_.begin(std::ceil(seconds(whole) / integrator_.step_s));
  const bool tears_fast = cuts_ && cuts_->due_s() < LiveCuts::kFrameS;
  const Micros every = tears_fast ? std::max(from_seconds(LiveCuts::kLookS), whole / kMostLooks) : whole;
  AdvanceReport report;
  for (Micros until = time();;) {
    until = job.target - until < every + kTick ? job.target : until + every;
    report += advance(until, step_s);
    if (!report.converged) return report;
    cut_on();
    if (until == job.target) return report;
  }
}

/// Parts the body where blades have cut, or where it tears.
void SteppedBody::cut_on() {
  if (!cuts_ || !cuts_->cut_on()) return;
  parted_ = parted_ ? both(*parted_, cuts_->parted()) : cuts_->parted();
  renew_steppers();
}

AdvanceReport SteppedBody::advance(Micros until, double step_s) {
  const auto tools = [&](std::size_t k, double t) { return tool(k, from_seconds(t)); };
  const Micros begin = time();
  release_leaping(begin, until);
  const BodyState before = body_;
  const std::vector<ToolPort> ports_before = ports_;
  AdvanceReport report;
  bool calmed = false;
  for (std::size_t most = 1;;) {
    integrator_.stepper->allow_touched(allowance_.left());
    const AdvanceReport once = integrator_.stepper->advance(body_, ports_, seconds(until), step_s, tools);
    allowance_.take(once.touched_iterations);
    report += once;
    if (report.converged) return report;
    if (calmed && !release_longest(std::exchange(most, 2 * most), begin, until)) return report;
    calmed = true;
    begin_again(before, ports_before);
    allowance_.begin_again();
  }
}

/// Puts the body at rest where it was at the beginning of the frame, and the tools that are left back to their contacts then.
void SteppedBody::begin_again(const BodyState& before, const std::vector<ToolPort>& ports_before) {
  body_ = before;
  body_.v.setZero();
  std::vector<ToolPort> left;
  for (const ToolPort& port : ports_before)
    if (std::ranges::any_of(ports_, [&](const ToolPort& p) { return p.tool == port.tool; })) left.push_back(port);
  ports_ = std::move(left);
}

}  // namespace palpate
