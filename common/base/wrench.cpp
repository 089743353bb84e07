#include "common/base/wrench.hpp"

namespace palpate {

double share_within(const Wrench& w, double most_n, double most_nm) {
  const double force_n = w.force.stableNorm(), torque_nm = w.torque.stableNorm();
  const double of_force = most_n <= 0 || force_n <= most_n ? 1 : most_n / force_n;
  const double of_torque = most_nm <= 0 || torque_nm <= most_nm ? 1 : most_nm / torque_nm;
  return of_force < of_torque ? of_force : of_torque;
}

}  // namespace palpate
