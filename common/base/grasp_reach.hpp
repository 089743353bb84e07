// How far from its node a tool takes hold of it: a hand that is further away would pull the body to it, or be pulled.
#pragma once

namespace palpate {

inline constexpr double kGraspReachM = 0.05;

}  // namespace palpate
