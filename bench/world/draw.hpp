// Generators behind draw_scenario(), one per part.
#pragma once

#include <array>
#include <initializer_list>
#include <string>
#include <vector>

#include "bench/world/scenario.hpp"
#include "common/base/random.hpp"

namespace palpate {

enum class Part : std::uint64_t { body, server, stations, hand, link, clock, faults, sleep, scheme };

/// Generator of one part; `index` distinguishes stations.
inline Random part_of(std::uint64_t seed, Part part, std::uint64_t index = 0) {
  std::uint64_t state = seed;
  for (const std::uint64_t salt : {static_cast<std::uint64_t>(part), index}) state = splitmix64(state) ^ (salt + 1);
  return Random(splitmix64(state));
}

template <class T>
T pick(Random& random, std::initializer_list<T> of) {
  return of.begin()[random.bits() % of.size()];
}

/// Draws a scene file.
std::string draw_scene(std::uint64_t seed, bool small = false);
/// Draws the stations; the first always pushes. Requires scene and times of `s`.
std::vector<StationPlan> draw_stations(const Scenario& s);
/// Draws the path of the hand of station `index`; `count` stations push.
std::vector<MotionPoint> draw_path(const Scenario& s, std::size_t index, std::size_t count);

}  // namespace palpate
