#include "server/room/deadband.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cassert>
#include <vector>

#include "common/base/minimum_jerk.hpp"

namespace palpate {
namespace {

/// Offsets from the tool's path: none, along the force, and two across it.
using Probes = std::array<Vec3, 4>;

/// Returns offsets towards the surface where there is no force yet, else along the force into it.
Probes probes_of(const PatchPlayer& player) {
  const Patch& patch = player.patch();
  Vec3 in = -player.output().force;
  if (in.squaredNorm() == 0 && patch.surface.triangle_count > 0)
    in = patch.surface.vertices[patch.surface.triangles[patch.point.triangle][0]].position - patch.tool;
  const double way_m = player.output().contact ? Deadband::kProbeM : Deadband::kProbeM + in.norm();
  in = in.squaredNorm() > 0 ? Vec3(in.normalized()) : Vec3(0, 0, -1);
  const Vec3 across = in.unitOrthogonal();
  return {Vec3::Zero(), way_m * in, Deadband::kProbeM * across, Deadband::kProbeM * in.cross(across)};
}

/// Returns true if the hand would feel the same force from `old` as from `next` at their present times.
bool alike(const PatchPlayer& old, const PatchPlayer& next, double fraction) {
  const double most_n = Deadband::kExpectedPathShare * fraction * std::max(next.output().force.norm(), Deadband::kForceLeastN);
  return (old.output().force - next.output().force).norm() <= most_n;
}

/// Returns true if both patches are in the same state of contact and valid for about as long.
bool made_alike(const Patch& old, const Patch& next) {
  constexpr double kValidityShare = 0.9;  // more: sends more often; less: forces fade sooner on a silent link
  return old.touching == next.touching && seconds(old.valid_for) >= kValidityShare * seconds(next.valid_for);
}

bool trusts(const PatchPlayer& player, const Vec3& tool) {
  return (tool - player.patch().tool).norm() <= player.patch().trust_radius_m;
}

/// Returns true if all of them stay alike over the time in which `next` would be used, with the tool `off` its path.
bool stay_alike(std::vector<PatchPlayer> old, PatchPlayer next, const Deadband::Station& station, const Vec3& off) {
  assert(!old.empty() && station.track && station.horizon > Micros{});
  constexpr Micros kCompareEvery{5'000};  // twelve times within kProbeS; longer: cheaper, but misses oscillations
  const Micros stamp = next.patch().stamp;
  for (Micros t = stamp + kCompareEvery; t <= stamp + station.horizon; t += kCompareEvery) {
    ToolSample tool = station.track->sample(t);
    tool.position += minimum_jerk(seconds(t - stamp) / Deadband::kProbeS) * off;
    next.advance(tool);
    for (PatchPlayer& player : old) {
      player.advance(tool);
      if (!alike(player, next, station.fraction) || (trusts(next, tool.position) && !trusts(player, tool.position))) return false;
    }
  }
  return true;
}

}  // namespace

std::optional<Micros> Deadband::pass(const Patch& patch, const NonlinearTerms& terms, const Station& station) {
  PatchPlayer next(patch, terms);
  assert(station.track && station.fraction > 0);
  catch_up(*station.track, patch.stamp);
  if (all_serve(next, station)) return station.playing;
  sent_.push_back(std::move(next));
  if (sent_.size() > kSentMax) sent_.pop_front();
  return std::nullopt;
}

/// Advances the patches as the station does; drops those older than the tool's track.
void Deadband::catch_up(const ToolTrack& track, Micros until) {
  std::erase_if(sent_, [&](const PatchPlayer& old) { return old.time() < track.begin(); });
  for (PatchPlayer& old : sent_)
    for (Micros t = old.time() + kTick; t <= std::min(until, track.newest()); t += kTick) old.advance(track.sample(t));
}

bool Deadband::all_serve(const PatchPlayer& next, const Station& station) {
  if (!station.playing) return false;
  assert(
      std::is_sorted(sent_.begin(), sent_.end(), [](const auto& a, const auto& b) { return a.patch().stamp < b.patch().stamp; }));
  while (!sent_.empty() && sent_.front().patch().stamp < *station.playing) sent_.pop_front();
  if (sent_.empty() || sent_.front().patch().stamp != *station.playing) return false;
  const Micros stamp = next.patch().stamp;
  if (stamp + station.horizon - *station.playing > kPatchAgeMost) return false;
  std::vector<PatchPlayer> old(sent_.begin(), sent_.end());
  for (PatchPlayer& player : old) {
    player.advance(station.track->sample(stamp));
    if (!made_alike(player.patch(), next.patch()) || player.output().contact != next.output().contact ||
        player.needle_tip().inside != next.needle_tip().inside || !alike(player, next, station.fraction))
      return false;
  }
  const Probes probes = probes_of(next);
  return std::all_of(probes.begin(), probes.end(), [&](const Vec3& off) { return stay_alike(old, next, station, off); });
}

}  // namespace palpate
