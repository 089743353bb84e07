#include "client/view/foresight.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/tool_pose.hpp"

namespace palpate {
namespace {

/// Interpolates evenly between samples, which ascend; constant beyond the ends.
ToolSample tool_at(const std::vector<ToolSample>& samples, Micros t) {
  const auto after = std::find_if(samples.begin(), samples.end(), [t](const ToolSample& s) { return s.t > t; });
  if (after == samples.begin()) return {t, after->position, after->orientation, after->opening};
  if (after == samples.end()) {
    ToolSample last = samples.back();
    last.t = t;
    return last;
  }
  const ToolSample& before = *std::prev(after);
  const double part = seconds(t - before.t) / seconds(after->t - before.t);
  return {t, before.position + part * (after->position - before.position),
          orientation_between(before.orientation, after->orientation, part), std::lerp(before.opening, after->opening, part)};
}

double least_edge_m(const PortSurface& surface) {
  double least = std::numeric_limits<double>::infinity();
  for (int t = 0; t < surface.triangle_count; ++t) {
    const Triangle& corners = surface.triangles[static_cast<std::size_t>(t)];
    for (std::size_t k = 0; k < 3; ++k)
      least = std::min(least, (surface.vertices[corners[k]].position - surface.vertices[corners[(k + 1) % 3]].position).norm());
  }
  return least;
}

/// Finds the vertex in the next patch.
ForeseenVertex find(const Vec3& foreseen, const PortSurface& next, double within_m) {
  ForeseenVertex vertex{foreseen, Vec3::Zero(), false};
  for (int i = 0; i < next.vertex_count; ++i) {
    const Vec3& there = next.vertices[static_cast<std::size_t>(i)].position;
    const double far = (there - foreseen).norm();
    if (far >= within_m) continue;
    within_m = far;
    vertex.found = there;
    vertex.compared = true;
  }
  return vertex;
}

void compare_surface(const PatchPlayer& player, const Patch& next, Foresight& foresight) {
  const PortSurface& surface = player.patch().surface;
  const double within_m = 0.25 * least_edge_m(next.surface);
  double squares = 0;
  for (int i = 0; i < surface.vertex_count; ++i) {
    const ForeseenVertex vertex = find(player.vertex(i), next.surface, within_m);
    foresight.vertices.push_back(vertex);
    if (!vertex.compared) continue;
    const double miss = (vertex.foreseen - vertex.found).norm();
    ++foresight.compared;
    squares += miss * miss;
    foresight.miss_max_m = std::max(foresight.miss_max_m, miss);
  }
  if (foresight.compared > 0) foresight.miss_rms_m = std::sqrt(squares / foresight.compared);
  foresight.triangles.assign(surface.triangles.begin(), surface.triangles.begin() + surface.triangle_count);
}

}  // namespace

bool PatchPairs::take(const ClientCore& core, PatchPair& pair) {
  const Patch& newest = core.last_patch();
  const bool fresh = core.intake_counts().accepted > 0 && (!patch_ || newest.seq != patch_->seq || newest.stamp != patch_->stamp);
  const Micros between = patch_ ? newest.stamp - patch_->stamp : Micros{};
  const bool follows = fresh && patch_ && between > Micros{} && between <= patch_->valid_for;
  if (follows) {
    pair.patch = *patch_;
    pair.next = newest;
    pair.terms = terms_;
    pair.samples.clear();
    const SampleHistory<ToolSample>& samples = core.samples();
    const std::size_t first = samples.first_after(patch_->stamp), end = samples.first_after(newest.stamp);
    for (std::size_t i = first > 0 ? first - 1 : 0; i < std::min(end + 1, samples.size()); ++i)
      pair.samples.push_back(samples[i]);
  }
  if (fresh) {
    patch_ = newest;
    terms_ = {};
  }
  if (patch_ && terms_.variables == 0)
    if (auto terms = core.terms().terms_for(*patch_)) terms_ = std::move(*terms);
  return follows && !pair.samples.empty();
}

Foresight foresee(const PatchPair& pair) {
  Foresight foresight{pair.patch.stamp, pair.next.stamp, pair.patch.scheme, pair.patch.states(), {}, pair.next.force, {}, {}};
  PatchPlayer player(pair.patch, pair.terms);
  const std::int64_t ticks = (pair.next.stamp - pair.patch.stamp + kTick / 2) / kTick;
  for (std::int64_t k = 1; k <= ticks; ++k) {
    player.advance(tool_at(pair.samples, pair.patch.stamp + k * kTick));
  }
  foresight.force = player.output().force;
  if (pair.patch.modes() > 0 && pair.next.modes() > 0) compare_surface(player, pair.next, foresight);
  return foresight;
}

void Foresights::add(Foresight foresight) {
  if (kept_.size() == kKept) kept_.erase(kept_.begin());
  kept_.push_back(std::move(foresight));
}

const Foresight* Foresights::at(Micros moment) const {
  const auto passed = [moment](const Foresight& f) { return f.at <= moment; };
  const auto last = std::find_if(kept_.rbegin(), kept_.rend(), passed);
  return last != kept_.rend() && moment - last->at < kForget ? &*last : nullptr;
}

}  // namespace palpate
