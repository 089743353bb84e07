// Snapshots: displacements of a body from where it is, that it is likely to come to while a patch lasts. A patch of scheme
// `hyper` takes its basis from them (pod_basis.hpp) and the weights of its elements (sampling.hpp).
//
// A snapshot w (3 N) counts as alpha w, alpha its weight: as far as the body is likely to go that way. Those of a grasp move the
// tool's node with them, which a basis holds still.
//
// Shapes: N nodes, or coordinates of a locally refined body (refined_body.hpp); w 3 N [m]; weighted() 3 N x count() [m]; alpha
// no unit.
// What can go wrong: weighted() needs at least one snapshot; those that the body never comes near take modes and elements from
// those that it does.
// Source: the method of snapshots, Sirovich, Turbulence and the dynamics of coherent structures, Quart. Appl. Math. 45 (1987).
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "server/body/dynamics.hpp"

namespace palpate {

/// What a snapshot is of, and which file fills it in.
enum class SnapshotKind : std::uint8_t {
  port_response,  ///< P^-1 B a_i, as far as the tool is likely to move along axis i (patch_builder.hpp)
  slide,          ///< P^-1 (B_end lambda_end - B lambda), the tool's load where it may slide to (frame_model.hpp)
  own_motion,     ///< s P^-1 M v*; this and the next three: response_snapshots.hpp
  residual,       ///< P^-1 F*
  moment,         ///< s P^-1 (2 s M + D) x, x a port response or a slide
  second_order,   ///< P^-1 F2(b_i, b_j), the second-order force of two that act together
  indentation,    ///< as deep as the hand may press, by the body's own forces (static_indentation.hpp)
  history,        ///< where the body was in the last frames
  rest,           ///< where it rests
  cached,         ///< where it was when a tool was there before (server/room/snapshot_cache.hpp)
  rollout,        ///< where it will be if its hands go on as they do, and if they do not (server/room/hand_rollouts.hpp)
  rollout_end     ///< the last of those in which no hand turns aside
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
  /// Which columns of weighted() are of a kind, ascending.
  std::vector<Eigen::Index> of(SnapshotKind kind) const;
  /// Columns of weighted() that the body is likeliest to come to: of a touch the ends of rollouts, or else indentations; of a
  /// grasp, whose tool moves its own node, the port responses.
  std::vector<Eigen::Index> likeliest() const;
  /// alpha w, a column each; at least one.
  Matrix weighted() const;

 private:
  std::vector<Snapshot> all_;
};

/// Rows of held nodes become zero.
void mask(const std::vector<std::uint8_t>& held, Matrix& columns);

}  // namespace palpate
