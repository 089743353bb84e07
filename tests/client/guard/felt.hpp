// The guard of a device that renders no torque.
#pragma once

#include "client/guard/guard.hpp"

namespace palpate::test {

/// Runs a tick of force and position alone; returns the force to write.
inline Vec3 felt(Guard& guard, const Vec3& force, const Vec3& tool, double dt_s, const Vec3& guidance = Vec3::Zero()) {
  return guard.pass(force, tool, dt_s, guidance).force;
}

}  // namespace palpate::test
