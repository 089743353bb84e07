#include "bench/fidelity/ceiling.hpp"

#include <algorithm>
#include <cassert>
#include <optional>

namespace palpate {
namespace {

/// Ticks in which one patch is played.
struct Played {
  std::size_t first = 0, end = 0;
};

/// Ticks, searched from `from` on, in which the patch with stamp `ms` is played.
Played played(const std::vector<int>& stamp_ms, std::size_t from, int ms) {
  Played ticks;
  ticks.first = static_cast<std::size_t>(std::find(stamp_ms.begin() + static_cast<std::ptrdiff_t>(from), stamp_ms.end(), ms) -
                                         stamp_ms.begin());
  ticks.end = ticks.first;
  while (ticks.end < stamp_ms.size() && stamp_ms[ticks.end] == ms) ++ticks.end;
  return ticks;
}

}  // namespace

ToolAt predicted_to_rest(std::span<const Vec3> past, double after_s) {
  assert(!past.empty());
  constexpr std::size_t kWindowMs = 8;
  const std::size_t window = std::min(kWindowMs, past.size() - 1);
  const Vec3 way = past.back() - past[past.size() - 1 - window];
  return dead_reckoned({past.back(), window > 0 ? Vec3(1e3 / static_cast<double>(window) * way) : Vec3::Zero()}, after_s);
}

ToolAt predicted_to_go_on(std::span<const Vec3> past, double after_s) {
  constexpr std::size_t kStepMs = 30;
  if (past.size() <= 2 * kStepMs) return predicted_to_rest(past, after_s);
  const Vec3 &here = past.back(), &before = past[past.size() - 1 - kStepMs], &first = past[past.size() - 1 - 2 * kStepMs];
  constexpr double kStepS = 1e-3 * kStepMs;
  return moved_on({here, (3 * here - 4 * before + first) / (2 * kStepS)}, (here - 2 * before + first) / (kStepS * kStepS),
                  after_s);
}

std::vector<CeilingForce> ceiling_forces(const Scene& scene, std::span<const ToolPath> paths,
                                         std::span<const std::vector<int>> stamp_ms, const PathPrediction& prediction,
                                         const std::function<void(double)>& progress, std::span<const std::uint8_t> held) {
  assert(paths.size() == stamp_ms.size() && !paths.empty() && !paths[0].empty());
  const std::size_t ticks = paths[0].size(), n = paths.size();
  std::vector<CeilingForce> result(n);
  for (CeilingForce& r : result)
    r.felt = {std::vector<Vec3>(ticks, Vec3::Zero()), std::vector<std::uint8_t>(ticks, 0),
              std::vector<Vec3>(ticks, Vec3::Zero())};
  std::vector<std::optional<Vec3>> at_end(n);  // force of each hand's previous branch at the tick in which the new one takes over
  std::vector<Vec3> tools;
  for (const ToolPath& path : paths) tools.push_back(path[0]);
  ReferenceModel body(scene, tools, held), branch(scene, tools, held);
  /// Plays a patch made `now` for hand `a` during `use`.
  const auto play = [&](std::size_t a, std::size_t now, const Played& use) {
    branch.continue_from(body);
    CeilingForce& r = result[a];
    for (std::size_t tick = now; tick < std::min(use.end + 1, ticks); ++tick) {
      for (std::size_t k = 0; k < n; ++k)
        tools[k] = k == a ? paths[k][tick]
                          : prediction(std::span(paths[k]).first(now + 1), 1e-3 * static_cast<double>(tick - now)).position;
      if (tick > now) branch.tick(tools);
      if (tick == use.first && at_end[a]) r.steps_n.push_back((branch.force(a) - *at_end[a]).norm());
      if (tick >= use.first && tick < use.end) {
        r.felt.force[tick] = branch.force(a);
        r.felt.contact[tick] = branch.contact(a);
      }
      if (tick == use.end) at_end[a] = branch.force(a);
    }
  };
  for (std::size_t now = 0; now < ticks; ++now) {
    for (std::size_t k = 0; k < n; ++k) tools[k] = paths[k][now];
    body.tick(tools);
    for (std::size_t a = 0; a < n; ++a)
      if (const Played use = played(stamp_ms[a], now, static_cast<int>(now)); use.first < use.end) play(a, now, use);
    if (progress) progress(static_cast<double>(now + 1) / static_cast<double>(ticks));
  }
  return result;
}

}  // namespace palpate
