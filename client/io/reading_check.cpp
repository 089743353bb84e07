#include "client/io/reading_check.hpp"

#include <algorithm>
#include <utility>

namespace palpate {

std::string_view describe(ReadingFault fault) noexcept {
  switch (fault) {
    case ReadingFault::jumped:
      return "its position jumped further than it can move, or it turned further";
    case ReadingFault::outside:
      return "its position is outside of its workspace";
    case ReadingFault::frozen:
      return "its position does not change while it is pushed";
    case ReadingFault::none:
      break;
  }
  return "";
}

ReadingCheck::ReadingCheck(const DeviceCaps& caps)
    : felt_(caps.renders_force),
      speed_max_m_s_(caps.velocity_max_m_s),
      spin_max_rad_s_(caps.renders_torque ? caps.spin_max_rad_s : 0),
      reach_(caps.workspace) {
  if (reach_.isEmpty()) return;
  const Vec3 margin = kMargin * reach_.sizes();
  reach_ = Eigen::AlignedBox3d(reach_.min() - margin, reach_.max() + margin);
}

ReadingFault ReadingCheck::look(const ToolPose& pose, Micros t, double force_n) noexcept {
  const Vec3& position = pose.position;
  if (!felt_ || !position.allFinite()) return ReadingFault::none;  // the tick ignores positions that are not finite
  const bool first = !std::exchange(seen_, true);
  const Vec3 way = first ? Vec3::Zero() : Vec3(position - last_.position);
  const double passed_s = first ? 1e-3 : std::max(1e-3, seconds(t - last_t_));
  const double turned_rad = first || spin_max_rad_s_ <= 0 ? 0 : last_.turn.angularDistance(pose.turn);
  last_ = pose;
  last_t_ = t;
  if (first) has_moved_ = false;
  const bool moves = way.squaredNorm() > 0;
  has_moved_ = has_moved_ || moves;
  if (moves) still_ticks_ = 0;
  if (!moves && (force_n > kPushedN || still_ticks_ >= kFrozenTicks)) ++still_ticks_;
  if (way.stableNorm() > kJump * speed_max_m_s_ * passed_s) return ReadingFault::jumped;
  if (turned_rad > kJump * spin_max_rad_s_ * passed_s) return ReadingFault::jumped;
  if (!reach_.isEmpty() && !reach_.contains(position)) return ReadingFault::outside;
  return has_moved_ && still_ticks_ >= kFrozenTicks ? ReadingFault::frozen : ReadingFault::none;
}

}  // namespace palpate
