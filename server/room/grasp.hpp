// Path of an attached node to the tool. When a grasp begins at t_0 with the node d = x_node - x_tool away from the tool, the
// difference is removed along the minimum-jerk curve m (minimum_jerk.hpp), so that a jump does not tear the body:
//     x_node(t) = x_tool(t) + (1 - m((t - t_0) / T)) d,   T = kTakeUpS;   from t_0 + T on the node is where the tool is
// A tool further than kGraspReachM from its node does not grasp it: a hand that returns from elsewhere would be pulled, and the
// body with it.
#pragma once

#include "common/base/grasp_reach.hpp"
#include "common/base/minimum_jerk.hpp"
#include "server/room/tool_track.hpp"

namespace palpate {

class Grasp {
 public:
  static constexpr double kTakeUpS = 0.5;  ///< [s], for a distance of at most kGraspReachM: the node moves at 0.19 m/s at most

  Grasp() = default;
  /// `offset` = node minus tool at `begin`.
  Grasp(Micros begin, const Vec3& offset) : begin_(begin), offset_(offset) {}

  ToolAt at(const ToolTrack& track, Micros t) const {
    ToolAt tool = track.at(t);
    const double share = seconds(t - begin_) / kTakeUpS;
    if (share >= 1) return tool;
    tool.position += (1 - minimum_jerk(share)) * offset_;
    tool.velocity -= (minimum_jerk_rate(share) / kTakeUpS) * offset_;
    return tool;
  }

 private:
  Micros begin_{};
  Vec3 offset_ = Vec3::Zero();
};

}  // namespace palpate
