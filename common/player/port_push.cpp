#include "common/player/port_push.hpp"

#include <algorithm>

namespace palpate {

double share_of_next_step(double contact_stiffness_n_m, const Mat3& moved) noexcept {
  return contact_stiffness_n_m > 0 ? 0.5 / std::max(contact_stiffness_n_m * moved.trace(), 1.0) : 0.0;
}

void PortPush::set_compliance(const PortRows& rows, double contact_stiffness_n_m, const Mat3& c_static) noexcept {
  compliance = c_static;
  if (rows.cols() == 0) return;
  const Mat3 moved = rows * response.topRows(rows.cols());
  share_next = share_of_next_step(contact_stiffness_n_m, moved);
  compliance += (1 - share_next) * moved;
}

ModeVector PortPush::moved() const noexcept { return (1 - share_next) * (response.topRows(response.rows() / 2) * lambda); }

void PortPush::add_to(StateVector& z) const noexcept { z.noalias() += (1 - share_next) * (response * lambda); }

void PortPush::carry_on(StateVector& next) const noexcept { next.noalias() += share_next * (response * lambda); }

}  // namespace palpate
