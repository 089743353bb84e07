// The other contacts on the body while the patch of one is in use: those of other tools, and of other spheres of the same tool.
//
// The nearest are contacts of the patch (patch.hpp, OtherContact), which the player solves: they do not appear in its K, g or
// load_rate. The rest of the tools that touch, and needles of others in the body, keep their force: the residual force of the
// patch is F(x*, v*) + sum B_o lambda_o*. A node that another tool holds (grasp) moves on at its velocity v_o: a growing load
// -K_o v_o. The traction across a fresh cut (Traction) is one that fades. A scene has one kind of contact, so a grasp's patch
// meets held nodes only.
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
  std::vector<Contact> contacts;  ///< of the patch: those of the same tool, then of others, the most strongly coupled first
  std::size_t own = 0;            ///< number of those of the same tool
  std::vector<Contact> shaft;     ///< of the same tool, if it is a needle: the points of its path, from the entry on
  Vector load;                    ///< sum B_o lambda_o* of the others that touch; empty when none does
  Vector load_rate;               ///< growing load [N/s]; empty when nothing grows
};

/// Returns the effect of the ports besides `which` on a patch with this horizon. Contacts are at most kMaxOtherContacts: those of
/// the same tool that touch or are wanted, and at most `others_max` of those of other tools that touch the surface, or will
/// within the horizon. Requires the responses of P.
inline constexpr std::size_t kMaxOtherTools = 3;  ///< with more, less of the surface fits into a datagram
OtherTools other_tools(FrameModel& frame, const SharedSystem& p, std::size_t which, Micros horizon, std::size_t others_max);

}  // namespace palpate
