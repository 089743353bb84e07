// Positions and velocities of the nodes of a body.
#pragma once

#include <cmath>
#include <memory>

#include "server/solve/block_matrix.hpp"

namespace palpate {

struct StressHistory;
struct ContactAnchors;
struct SutureState;

/// Forces on the nodes that hold together what a cut has parted, and fade: load exp(-(t - begin) / fade)
/// (docs/decisions/0081-a-live-blade.md).
struct Traction {
  static constexpr double kLetGoS = 0.1;  ///< shorter: a hand beside the cut feels a step; longer: a cut opens late
  double begin_s = 0, fade_s = kLetGoS;
  Vector load;  ///< [N]
  Vector at(double time_s) const { return std::exp((begin_s - time_s) / fade_s) * load; }
};

/// x, v: 3 N (node 0 x, y, z, node 1 x, ...) [m], [m/s].
struct BodyState {
  double time_s = 0;
  Vector x, v;
  std::shared_ptr<const StressHistory> history =
      nullptr;  ///< of a solid whose stress relaxes (relaxation.hpp); null: nothing has relaxed yet
  std::shared_ptr<const Traction> traction = nullptr;       ///< of a body that was cut lately
  std::shared_ptr<const ContactAnchors> anchors = nullptr;  ///< of friction (contacts.hpp); null: nothing touches
  std::shared_ptr<const SutureState> sutures = nullptr;     ///< lengths of threads (sutures.hpp); null: there are none
};

inline auto at_node(const Vector& y, std::uint32_t node) { return y.segment<3>(3 * static_cast<Eigen::Index>(node)); }
inline auto at_node(Vector& y, std::uint32_t node) { return y.segment<3>(3 * static_cast<Eigen::Index>(node)); }

}  // namespace palpate
