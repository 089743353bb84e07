#include "bench/paper/truncation_map.hpp"

#include <cmath>
#include <limits>

namespace palpate {

PeakGain proper_norm(const BalancedReduction& balanced) {
  // The first Hankel value is a lower bound of the norm.
  constexpr double kShare = 1e-6;
  int order = 1;
  while (order < balanced.states() && balanced.error_bound(order) > kShare * balanced.hankel()[0]) ++order;
  return hinf_norm(proper(balanced.truncated(balanced.stable_order(order))));
}

std::vector<MapPoint> truncation_map(int sheet_nodes, const Material& material, std::span<const double> dampings_n_s_m,
                                     std::span<const int> orders) {
  std::vector<MapPoint> map;
  for (const double b : dampings_n_s_m) {
    Material damped = material;
    damped.damping_n_s_m = b;
    const BalancedReduction balanced(Specimen::sheet(sheet_nodes, damped).system());
    const double norm = proper_norm(balanced).norm;
    for (const int order : orders) {
      if (order > balanced.states() || balanced.stable_order(order) != order) continue;
      map.push_back({b, damped.damping_ratio(), order, reduction_error(balanced, balanced.truncated(order)).peak.norm / norm,
                     balanced.error_bound(order) / norm});
    }
  }
  return map;
}

std::vector<OrderNeeded> orders_needed(const std::vector<MapPoint>& map, double error) {
  std::vector<OrderNeeded> needed;
  for (const MapPoint& p : map) {
    if (needed.empty() || needed.back().damping_n_s_m != p.damping_n_s_m) needed.push_back({p.damping_n_s_m, p.damping_ratio, 0});
    int& order = needed.back().order;
    if (p.error > error)
      order = 0;
    else if (order == 0)
      order = p.order;
  }
  return needed;
}

double ratio_needed(const std::vector<MapPoint>& map, int order, double error) {
  double needed = std::numeric_limits<double>::infinity();
  const MapPoint* before = nullptr;
  for (const MapPoint& p : map) {
    if (p.order != order) continue;
    if (p.error > error) {
      needed = std::numeric_limits<double>::infinity();
    } else if (!before) {
      needed = p.damping_ratio;
    } else if (before->error > error) {
      const double part = std::log(before->error / error) / std::log(before->error / p.error);
      needed = before->damping_ratio * std::pow(p.damping_ratio / before->damping_ratio, part);
    }
    before = &p;
  }
  return needed;
}

}  // namespace palpate
