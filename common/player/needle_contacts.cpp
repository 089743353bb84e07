#include "common/player/needle_contacts.hpp"

#include "common/patch/contact_law.hpp"

namespace palpate {

NeedleContacts::NeedleContacts(const Patch& patch, const StateInput& psi0)
    : needle_(patch.needle), contact_stiffness_n_m_(patch.contact_stiffness_n_m) {
  if (empty()) return;
  const auto r = patch.modes();
  for (std::size_t j = 0; j < shaft_.size(); ++j) {
    const PortRows& rows = needle_.points[j].rows;
    shaft_[j].push.response.resize(2 * r, 3);
    if (r > 0) shaft_[j].push.response = psi0 * rows.transpose();
    shaft_[j].push.set_compliance(rows, contact_stiffness_n_m_);
  }
  tip_rows_.resize(3, r);
  tip_.response.resize(2 * r, 3);
  if (!inside()) return;
  place_tip();
  // At the stamp the modes are at zero, and the contacts are closed.
  const ModeVector none = ModeVector::Zero(r);
  const ToolPose held(patch.tool, patch.turn.value_or(Rotation::Identity()), patch.opening);
  const ToolPose tool(held.centre_of(patch.sphere), held.turn);
  const Vec3 axis = tool.turn * Vec3::UnitZ();
  for (int j = 0; j < kNeedlePoints; ++j) {
    const auto at = static_cast<std::size_t>(j);
    shaft_[at].bonded = shaft_share(needle_.layers, needle_.tip, j).length_m > 0;
    const Mat3 compliance = shaft_[at].push.compliance;
    shaft_[at].push.compliance.setZero();
    close_shaft(j, none, tool, axis);
    shaft_[at].push.compliance = compliance;
  }
  const Mat3 compliance = tip_.compliance;
  tip_.compliance.setZero();
  Vec3 tau;
  const Vec3 at = at_depth(needle_.tip.depth_m, none, tau);
  tip_.lambda = close_on_path(tool.position - at, tip_.compliance, tau.normalized(),
                              tip_contact(needle_.layers, needle_.tip, contact_stiffness_n_m_))
                    .lambda;
  tip_.compliance = compliance;
}

void NeedleContacts::place_tip() noexcept {
  const PathPlace at = place_on_path(needle_.layers, needle_.tip.depth_m);
  const auto j = static_cast<std::size_t>(at.j);
  const double part = std::min(at.part, 1.0);
  tip_rows_ = (1 - part) * needle_.points[j].rows + part * needle_.points[j + 1].rows;
  tip_.response = (1 - part) * shaft_[j].push.response + part * shaft_[j + 1].push.response;
  tip_.set_compliance(tip_rows_, contact_stiffness_n_m_);
}

Vec3 NeedleContacts::at_depth(double depth_m, const ModeVector& q, Vec3& tau) const noexcept {
  const PathPlace at = place_on_path(needle_.layers, depth_m);
  const auto j = static_cast<std::size_t>(at.j);
  const PatchNeedle::Point &from = needle_.points[j], &to = needle_.points[j + 1];
  Vec3 way = to.position - from.position, place = from.position;
  way.noalias() += (to.rows - from.rows) * q;
  place.noalias() += from.rows * q;
  tau = way / needle_.layers.spacing_m();
  return place + at.part * way;
}

bool NeedleContacts::punctures(const Vec3& push, const ToolPose& tool) const noexcept {
  return !empty() && -push.dot(tool.turn * Vec3::UnitZ()) > needle_.layers.of.front().puncture_n;
}

void NeedleContacts::enter(const StateVector& z, const Vec3& entry) noexcept {
  needle_.tip = {true, 0, 0, 0};
  Vec3 tau;
  const Vec3 offset = entry - at_depth(0, z.head(tip_rows_.cols()), tau);
  for (PatchNeedle::Point& point : needle_.points) point.position += offset;
  for (ShaftContact& contact : shaft_) {
    contact.bonded = false;
    contact.push.lambda.setZero();
  }
  place_tip();
  tip_.lambda.setZero();
}

void NeedleContacts::carry_on(StateVector& next) const noexcept {
  if (!inside()) return;
  for (const ShaftContact& contact : shaft_) contact.push.carry_on(next);
  tip_.carry_on(next);
}

ModeVector NeedleContacts::moved() const noexcept {
  ModeVector q = ModeVector::Zero(tip_rows_.cols());
  if (!inside()) return q;
  for (const ShaftContact& contact : shaft_) q += contact.push.moved();
  q += tip_.moved();
  return q;
}

void NeedleContacts::close(StateVector& z, const ToolPose& tip) noexcept {
  const Vec3 axis = tip.turn * Vec3::UnitZ();
  ModeVector q = z.head(tip_rows_.cols()) + moved();
  for (int j = 0; j < kNeedlePoints; ++j) {
    const PortPush& push = shaft_[static_cast<std::size_t>(j)].push;
    q -= push.moved();
    close_shaft(j, q, tip, axis);
    q += push.moved();
    push.add_to(z);
  }
  q -= tip_.moved();
  close_tip(q, tip);
  tip_.add_to(z);
  if (inside()) return;
  for (ShaftContact& contact : shaft_) contact.push.lambda.setZero();
  tip_.lambda.setZero();
}

void NeedleContacts::close_shaft(int j, const ModeVector& q, const ToolPose& tool, const Vec3& axis) noexcept {
  ShaftContact& contact = shaft_[static_cast<std::size_t>(j)];
  contact.push.lambda.setZero();
  const ShaftShare share = shaft_share(needle_.layers, needle_.tip, j);
  const bool reached = share.length_m > 0;
  PatchNeedle::Point& point = needle_.points[static_cast<std::size_t>(j)];
  Vec3 gap = tool.position - point.position;
  gap.noalias() -= point.rows * q;
  if (reached && !contact.bonded) point.bond_m = -axis.dot(gap);
  contact.bonded = reached;
  if (!reached) return;
  gap += point.bond_m * axis;
  const PathClosure closure =
      close_on_path(gap, contact.push.compliance, axis, shaft_contact(needle_.layers, share, contact_stiffness_n_m_));
  contact.push.lambda = closure.lambda;
  contact.arm = point.bond_m * axis;
  point.bond_m -= closure.slip_m;
}

void NeedleContacts::close_tip(const ModeVector& q, const ToolPose& tool) noexcept {
  for (int slides = 0; inside(); ++slides) {
    Vec3 tau;
    const Vec3 at = at_depth(needle_.tip.depth_m, q, tau);
    const double stretch = tau.norm();
    const PathClosure closure = close_on_path(tool.position - at, tip_.compliance, tau / stretch,
                                              tip_contact(needle_.layers, needle_.tip, contact_stiffness_n_m_));
    tip_.lambda = closure.lambda;
    if (closure.slip_m == 0) return;
    move_tip(needle_.layers, needle_.tip, closure.slip_m / stretch);
    place_tip();
    if (slides == kSlidesMax || std::abs(closure.slip_m) < kSlipToleranceM) return;
  }
}

void NeedleContacts::add(Vec3& force, Vec3& torque) const noexcept {
  if (!inside()) return;
  force -= tip_.lambda;
  for (const ShaftContact& contact : shaft_) {
    force -= contact.push.lambda;
    torque -= contact.arm.cross(contact.push.lambda);
  }
}

}  // namespace palpate
