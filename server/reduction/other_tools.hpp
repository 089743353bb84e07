// The other tools on the body while the patch of one is in use.
//
// The nearest are contacts of the patch (patch.hpp, OtherTool), which the player solves: they do not appear in its K, g or
// load_rate. The rest of the tools that touch keep their force: the residual force of the patch is F(x*, v*) + sum B_o lambda_o*.
// A node that another tool holds (grasp) moves on at its velocity v_o: a growing load -K_o v_o. A scene has one kind of contact,
// so a grasp's patch meets held nodes only.
//
// Shapes: lambda, v_o 3 [N], [m/s]; B_o, K_o 3 n x 3, n coordinates (body_operator.hpp).
#pragma once

#include <vector>

#include "server/reduction/frame_model.hpp"

namespace palpate {

struct OtherTools {
  struct Contact {
    const Port* port = nullptr;
    std::size_t tool = 0;
  };
  std::vector<Contact> contacts;  ///< of the patch, the most strongly coupled through the body first
  Vector load;                    ///< sum B_o lambda_o* of the others that touch; empty when none does
  Vector load_rate;               ///< growing load [N/s]; empty when nothing grows
};

/// Returns the effect of the tools besides `which` on a patch with this horizon. At most `contacts_max` of those that touch the
/// surface, or will within the horizon, are contacts. Requires the responses of P.
OtherTools other_tools(FrameModel& frame, const SharedSystem& p, std::size_t which, Micros horizon, std::size_t contacts_max);

}  // namespace palpate
