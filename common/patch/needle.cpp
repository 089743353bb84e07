#include "common/patch/needle.hpp"

#include <Eigen/LU>

namespace palpate {
namespace {

constexpr double kHubN = 1e6;  // at its full length a needle's hub lies on the body: no push moves the tip on

/// Integral of max(0, 1 - |x|) from -infinity to `x`.
double hat_integral(double x) noexcept {
  x = std::clamp(x, -1.0, 1.0);
  return x < 0 ? 0.5 * (1 + x) * (1 + x) : 1 - 0.5 * (1 - x) * (1 - x);
}

}  // namespace

PathClosure close_on_path(const Vec3& gap, const Mat3& compliance, const Vec3& t, const PathContact& contact) noexcept {
  const Mat3 along = t * t.transpose(), across = Mat3::Identity() - along;
  const Mat3 stiffness = contact.across_n_m * across + contact.along_n_m * along;
  PathClosure closure;
  closure.lambda = (Mat3::Identity() + stiffness * compliance).inverse() * (stiffness * gap);
  const double push = t.dot(closure.lambda), bound = std::clamp(push, contact.least_n, contact.most_n);
  if (push == bound && contact.along_n_m > 0) return closure;
  const Mat3 sideways = contact.across_n_m * across;
  closure.lambda = (Mat3::Identity() + sideways * compliance).inverse() * (sideways * gap + bound * t);
  const double held_m = contact.along_n_m > 0 ? bound / contact.along_n_m : 0;
  closure.slip_m = t.dot(gap - compliance * closure.lambda) - held_m;
  return closure;
}

PathContact tip_contact(const NeedleLayers& layers, const NeedleTip& tip, double contact_stiffness_n_m) noexcept {
  PathContact contact{contact_stiffness_n_m, contact_stiffness_n_m, 0, 0};
  const std::span<const NeedleLayer> all = layers.all();
  const auto layer = static_cast<std::size_t>(tip.layer);
  if (all[layer].is_outside()) contact.across_n_m = 0;
  if (tip.depth_m < tip.front_m) return contact;
  if (tip.depth_m >= layers.length_m)
    contact.most_n = kHubN;
  else if (layer + 1 < all.size() && tip.front_m >= all[layer + 1].begins_m)
    contact.most_n = all[layer + 1].puncture_n;
  else
    contact.most_n = all[layer].cutting_n;
  return contact;
}

void move_tip(const NeedleLayers& layers, NeedleTip& tip, double slip_m) noexcept {
  const std::span<const NeedleLayer> all = layers.all();
  const auto next = static_cast<std::size_t>(tip.layer) + 1;
  const double wall = next < all.size() ? all[next].begins_m : layers.length_m;
  if (slip_m > 0 && tip.depth_m == tip.front_m) {
    if (next < all.size() && tip.front_m >= wall)
      ++tip.layer;
    else
      tip.depth_m = tip.front_m = std::min(tip.depth_m + slip_m, wall);
    return;
  }
  tip.depth_m = std::min(tip.depth_m + slip_m, tip.front_m);
  if (slip_m < 0 && tip.depth_m <= 0) tip = {};
}

ShaftShare shaft_share(const NeedleLayers& layers, const NeedleTip& tip, int j) noexcept {
  const double spacing = layers.spacing_m();
  const std::span<const NeedleLayer> all = layers.all();
  ShaftShare share;
  for (std::size_t k = 0; k < all.size() && all[k].begins_m < tip.depth_m; ++k) {
    if (all[k].is_outside()) continue;
    const double end = k + 1 < all.size() ? std::min(tip.depth_m, all[k + 1].begins_m) : tip.depth_m;
    const double length_m = spacing * (hat_integral(end / spacing - j) - hat_integral(all[k].begins_m / spacing - j));
    share.length_m += length_m;
    share.friction_n += all[k].friction_n_m * length_m;
  }
  return share;
}

PathContact shaft_contact(const NeedleLayers& layers, const ShaftShare& share, double contact_stiffness_n_m) noexcept {
  const double most = share.friction_n;
  return {contact_stiffness_n_m * share.length_m / layers.spacing_m(), most / kNeedleStickM, -most, most};
}

PathPlace place_on_path(const NeedleLayers& layers, double depth_m) noexcept {
  const double at = depth_m / layers.spacing_m();
  const int j = std::clamp(static_cast<int>(at), 0, kNeedlePoints - 2);
  return {j, at - j};
}

}  // namespace palpate
