// Snapshots: displacements from the body's present state that it is likely to reach while a patch is in use. A patch of scheme
// `hyper` gets its basis from them (pod_basis.hpp) and the weights of its elements (sampling.hpp).
//
// A snapshot w (3 N) counts as alpha w, alpha its weight, scaled to the displacement that the body is likely to reach. Snapshots
// of a grasp include the motion of the tool's node, which a basis holds still.
//
// Shapes: N nodes, or coordinates of a locally refined body (refined_body.hpp); w 3 N [m]; weighted() 3 N x count() [m]; alpha no
// unit.
// Limits: weighted() needs at least one snapshot; snapshots that the body never comes near waste modes and elements.
// Source: the method of snapshots, Sirovich, Turbulence and the dynamics of coherent structures, Quart. Appl. Math. 45 (1987).
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "server/body/dynamics.hpp"

namespace palpate {

/// Kind of a snapshot, with the file that adds it.
enum class SnapshotKind : std::uint8_t {
  port_response,  ///< P^-1 B a_i, scaled to the tool's likely motion along axis i (port_responses.cpp)
  slide,          ///< P^-1 (B_end lambda_end - B lambda), the tool's load after a likely slide (frame_model.hpp)
  own_motion,     ///< s P^-1 M v*; this and the next three: response_snapshots.hpp
  residual,       ///< P^-1 F*
  moment,         ///< s P^-1 (2 s M + D) x, x a port response or a slide
  second_order,   ///< P^-1 F2(b_i, b_j), the second-order force of two motions that act together
  indentation,    ///< as deep as the hand may press, with nonlinear forces (static_indentation.hpp)
  history,        ///< state in one of the last frames
  rest,           ///< rest state
  rollout,        ///< predicted state with hands on their path, or off it (server/room/state_prediction.hpp)
  rollout_end     ///< the last of those in which all hands stay on their path
};

struct Snapshot {
  SnapshotKind kind = SnapshotKind::port_response;
  double weight = 1;  ///< alpha
  Vector state;       ///< w [m]
};

class SnapshotSet {
 public:
  void add(SnapshotKind kind, Vector state, double weight = 1) { all_.push_back({kind, weight, std::move(state)}); }
  void add(const SnapshotSet& others) { all_.insert(all_.end(), others.all_.begin(), others.all_.end()); }

  const std::vector<Snapshot>& all() const { return all_; }
  Eigen::Index count() const { return static_cast<Eigen::Index>(all_.size()); }
  /// Returns the columns of weighted() of a kind, ascending.
  std::vector<Eigen::Index> of(SnapshotKind kind) const;
  /// Returns the columns of weighted() that the body is most likely to reach: for a touch the ends of rollouts, or else
  /// indentations; for a grasp, whose tool moves its own node, the port responses.
  std::vector<Eigen::Index> likeliest() const;
  /// Returns alpha w, one per column. Requires at least one.
  Matrix weighted() const;

 private:
  std::vector<Snapshot> all_;
};

/// Sets the rows of held nodes to zero.
void mask(const std::vector<std::uint8_t>& held, Matrix& columns);

}  // namespace palpate
