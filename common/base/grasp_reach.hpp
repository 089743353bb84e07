// Largest distance between a tool and the node that it grasps [m]: from further away it would pull the body to it, or be pulled.
#pragma once

namespace palpate {

inline constexpr double kGraspReachM = 0.05;

}  // namespace palpate
