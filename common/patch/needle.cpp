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

double NeedleLayers::friction_n_m(double depth_m) const {
  double friction = 0;
  for (const NeedleLayer& layer : all())
    if (layer.begins_m <= depth_m) friction = layer.friction_n_m;
  return friction;
}

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
  if (all[layer].puncture_n == 0 && all[layer].cutting_n == 0) contact.across_n_m = 0;  // behind the body
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
  tip.inside = slip_m >= 0 || tip.depth_m > 0;
}

double shaft_share_m(const NeedleLayers& layers, const NeedleTip& tip, int j) noexcept {
  const double spacing = layers.spacing_m();
  double end = tip.depth_m;
  const NeedleLayer& last = layers.all().back();
  if (last.puncture_n == 0 && last.cutting_n == 0) end = std::min(end, last.begins_m);
  return spacing * (hat_integral(end / spacing - j) - hat_integral(-j));
}

PathContact shaft_contact(const NeedleLayers& layers, int j, double share_m, double contact_stiffness_n_m) noexcept {
  const double most = layers.friction_n_m(j * layers.spacing_m()) * share_m;
  return {contact_stiffness_n_m * share_m / layers.spacing_m(), most / kNeedleStickM, -most, most};
}

PathPlace place_on_path(const NeedleLayers& layers, double depth_m) noexcept {
  const double at = depth_m / layers.spacing_m();
  const int j = std::clamp(static_cast<int>(at), 0, kNeedlePoints - 2);
  return {j, at - j};
}

}  // namespace palpate
