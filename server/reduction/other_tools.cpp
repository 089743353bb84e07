#include "server/reduction/other_tools.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

/// Returns B_a^T X_b relative to the geometric mean of the two compliances: 0 if neither tool moves the body under the other, 1
/// if they are at one place.
double coupling(const Port& a, const Port& b) {
  Mat3 across;
  for (int axis = 0; axis < 3; ++axis) across.col(axis) = gather(a.b, b.response[static_cast<std::size_t>(axis)]);
  return across.norm() / std::max(std::sqrt(a.compliance.norm() * b.compliance.norm()), 1e-300);
}

/// Returns -sum K_o v_o of the nodes that other tools hold; empty if none moves.
Vector load_rate_of_held_nodes(const FrameModel& frame, const Linearisation& at, std::size_t which) {
  Vector motion;
  for (std::size_t k = 0; k < frame.ports().size(); ++k) {
    const ToolPort& port = frame.ports()[k];
    if (k == which || port.kind != ContactKind::attach || frame.tool(k).velocity.isZero(0)) continue;
    if (motion.size() == 0) motion = Vector::Zero(at.masses().size());
    at_node(motion, at.body->coordinate(port.node)) = frame.tool(k).velocity;
  }
  if (motion.size() == 0) return motion;
  Matrix k_motion, d_motion;
  at.body->multiply(motion, k_motion, d_motion);
  Vector rate = -k_motion;
  mask(*at.held, rate);
  return rate;
}

/// Adds the mean rate at which the traction across a fresh cut fades within the time.
void add_fading_traction(const BodyState& state, const Linearisation& at, double over_s, Vector& rate) {
  if (!state.traction) return;
  const Vector change = (state.traction->at(state.time_s + over_s) - state.traction->at(state.time_s)) / over_s;
  if (rate.size() == 0) rate = Vector::Zero(at.masses().size());
  for (std::uint32_t i = 0; 3 * i < change.size(); ++i)
    if (!at_node(change, i).isZero(0)) scatter(at.body->restricted({{i, 1.0}}), at_node(change, i), rate);
  mask(*at.held, rate);
}

}  // namespace

OtherTools other_tools(FrameModel& frame, const SharedSystem& p, std::size_t which, Micros horizon, std::size_t others_max) {
  OtherTools others;
  others.load_rate = load_rate_of_held_nodes(frame, p.at(), which);
  add_fading_traction(frame.state(), p.at(), seconds(horizon), others.load_rate);
  std::vector<std::pair<double, std::size_t>> own, found;
  const auto add_load = [&](std::size_t k) {
    if (others.load.size() == 0) others.load = Vector::Zero(p.at().masses().size());
    scatter(p.port(k).b, frame.ports()[k].lambda, others.load);
  };
  for (std::size_t k = 0; k < frame.ports().size(); ++k) {
    if (k == which) continue;
    const ToolPort& port = frame.ports()[k];
    if (frame.is_same_tool(k, which)) {
      if (port.needle.part != NeedlePart::none)
        others.shaft.push_back({&p.port(k), k});
      else if (port.touching || frame.is_wanted(k))
        own.emplace_back(port.touching ? -port.lambda.norm() : frame.gap(k).norm(), k);
    } else if (port.on_path() && port.in_contact()) {
      add_load(k);
    } else if (frame.will_touch(k, horizon)) {
      found.emplace_back(-coupling(p.port(which), p.port(k)), k);
    }
  }
  std::sort(own.begin(), own.end());
  std::sort(found.begin(), found.end());
  others.own = std::min(own.size(), std::size_t{kMaxOtherContacts});
  const std::size_t of_others = std::min(others_max, kMaxOtherContacts - others.own);
  for (std::size_t i = 0; i < others.own; ++i) others.contacts.push_back({&p.port(own[i].second), own[i].second});
  for (std::size_t i = 0; i < std::min(of_others, found.size()); ++i)
    others.contacts.push_back({&p.port(found[i].second), found[i].second});
  for (std::size_t i = of_others; i < found.size(); ++i) {
    if (frame.ports()[found[i].second].touching) add_load(found[i].second);
  }
  if (others.load.size() > 0) mask(*p.at().held, others.load);
  return others;
}

}  // namespace palpate
