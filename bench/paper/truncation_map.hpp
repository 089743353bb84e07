// Range in which the paper's "10 states, less than 1 %" holds: the error of balanced truncation over the number of states and the
// damping of the sheet.
//
//     error = || G - G_r ||_inf / || G - s D1 ||_inf,       bound = 2 sum_{k > r} sigma_k / || G - s D1 ||_inf
//
// D1 is the damper at the port, without which the norm of G would be infinite. Both depend only on b / sqrt(k m) and the order
// (specimen.hpp). Source: Cavusoglu and Tendick, section 4.
// (specimen.hpp). Source: Cavusoglu and Tendick, section 4.
#pragma once

#include <span>
#include <vector>

#include "bench/paper/hinf.hpp"
#include "bench/paper/specimen.hpp"

namespace palpate {

/// || G - s D1 ||_inf of the balanced body [N/m], to about a millionth.
PeakGain proper_norm(const BalancedReduction& balanced);

struct MapPoint {
  double damping_n_s_m = 0, damping_ratio = 0;
  int order = 0;
  double error = 0, bound = 0;
};

/// A block of `orders` (ascending) for each damping, without orders beyond the states that stand above rounding and orders that
/// separate two equal Hankel values (BalancedReduction::stable_order).
std::vector<MapPoint> truncation_map(int sheet_nodes, const Material& material, std::span<const double> dampings_n_s_m,
                                     std::span<const int> orders);

/// For a damping of the map: the fewest states from which on the error stays at or below `error`; 0 if no order of the map
/// reaches it.
struct OrderNeeded {
  double damping_n_s_m = 0, damping_ratio = 0;
  int order = 0;
};
std::vector<OrderNeeded> orders_needed(const std::vector<MapPoint>& map, double error);

/// Lowest b / sqrt(k m) from which on `order` states have at most `error`, interpolated in the logarithms of both between the
/// dampings of the map; infinity if its largest damping is not enough.
double ratio_needed(const std::vector<MapPoint>& map, int order, double error);

}  // namespace palpate
