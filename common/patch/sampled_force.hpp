// The sampled elements of a patch, compiled for the haptic thread: what springs and finite elements have in common.
//
// Elements are in groups of kSampledLanes, side by side in the lanes of a vector. A group of a kind of element computes, from H_e
// u of its elements (sampled_elements.hpp), what `Group` declares:
//
//     static constexpr int kRows, kGroupsMax;      // numbers of H_e u of an element; a bound of the groups
//     void move(const Lane (&change)[kRows]);      // moves to H_e u
//     void force(Lane (&q)[kRows]) const;          // dE_e / d(H_e u), E_e beyond its second order at u = 0
//     double energy() const;                       // sum of E_e
//     void damping(const Lane (&rate)[kRows], Lane (&q)[kRows]) const;  // dampers' forces beyond those at u = 0
//
// and the sums over elements are E(u) [J], dE/du = sum H_e^T q_e, and likewise for dampers.
#pragma once

#include <array>

#include "common/mechanics/lanes.hpp"
#include "common/patch/patch.hpp"
#include "common/patch/sampled_elements.hpp"

namespace palpate {

inline constexpr int kSampledLanes = 8;  ///< floats of a vector register of 256 bits
using ElementLane = Lanes<float, kSampledLanes>;

/// Variables in single precision, or forces on them.
using SampledValues = Eigen::Matrix<float, Eigen::Dynamic, 1, 0, (kMaxVariables + 7) / 8 * 8>;

inline constexpr double kStableStiffness = 4;  ///< in 1 / h^2, for unit mass: an explicit step is stable below

/// Stands at u = 0 when it is new.
template <typename Group>
class SampledForce {
 public:
  static constexpr int kRows = Group::kRows;
  using Values = SampledValues;
  using Rows = ElementLane[kRows];

  /// True without elements, or when they are too stiff for the step and not slowed.
  bool empty() const { return groups_ == 0; }
  int variables() const { return variables_; }
  int groups() const { return groups_; }
  /// A, mass of the modes in addition to 1; empty where the elements need none.
  const ModeMatrix& added_mass() const { return added_mass_; }

  /// Moves to u. No allocation, nor below.
  void move_to(const Values& u) noexcept {
    u_ = u;
    for (int k = 0; k < groups_; ++k) {
      Rows change;
      moved(k, u, change);
      group(k).move(change);
    }
  }
  /// dE/du
  void gradient(Values& g) const noexcept {
    collect([](const Group& at, Rows& q) { at.force(q); }, g);
  }
  /// E [J]
  double energy() const noexcept {
    double sum = 0;
    for (int k = 0; k < groups_; ++k) sum += group(k).energy();
    return sum;
  }
  /// Computes the negative of the force on u due to the dampers' rotation, and the patch's part of it at the stamp, B u, which is
  /// to be subtracted from it.
  void damping(const Values& rate, Values& change, Values& at_stamp) const noexcept {
    at_stamp.setZero(variables_);
    if (damping_at_stamp_.size() > 0) at_stamp = (damping_at_stamp_ * u_.template cast<double>()).template cast<float>();
    change.setZero(variables_);
    if (!damped_) return;
    int k = 0;
    collect(
        [&](const Group& at, Rows& q) {
          Rows motion;
          moved(k++, rate, motion);
          at.damping(motion, q);
        },
        change);
  }

 protected:
  Group& group(int k) { return group_[static_cast<std::size_t>(k)]; }
  const Group& group(int k) const { return group_[static_cast<std::size_t>(k)]; }
  /// Lays out H, kRows rows an element; `lanes`: the lane of each element, counted over the groups.
  void lay_out(const Eigen::MatrixXf& h, const std::vector<int>& lanes, int groups) {
    groups_ = groups;
    motion_.setZero(kRows * kSampledLanes, groups_ * variables_);
    for (std::size_t e = 0; e < lanes.size(); ++e)
      for (int v = 0; v < variables_; ++v)
        for (int i = 0; i < kRows; ++i)
          motion_(kSampledLanes * i + lanes[e] % kSampledLanes, lanes[e] / kSampledLanes * variables_ + v) =
              h(kRows * static_cast<Eigen::Index>(e) + i, v);
  }
  /// Computes H u of a group.
  void moved(int k, const Values& u, Rows& to) const noexcept {
    for (ElementLane& entry : to) entry = ElementLane{};
    for (int v = 0; v < variables_; ++v) {
      const float by = u[v];
      const float* const h = motion(k, v);
#pragma GCC unroll 9
      for (int i = 0; i < kRows; ++i) {
        ElementLane entry;
        load_lanes(h + kSampledLanes * i, entry);
        to[i] += by * entry;
      }
    }
  }
  /// H of a group for one variable, entry by entry, lane by lane.
  const float* motion(int k, int variable) const { return motion_.col(k * variables_ + variable).data(); }
  /// Computes the sum of H^T q over groups; `of` computes q of a group.
  template <typename Of>
  void collect(const Of& of, Values& g) const noexcept {
    std::array<ElementLane, kMaxVariables> sums{};
    for (int k = 0; k < groups_; ++k) {
      Rows q;
      of(group(k), q);
      for (int v = 0; v < variables_; ++v) {
        const float* const h = motion(k, v);
        ElementLane sum{};
#pragma GCC unroll 9
        for (int i = 0; i < kRows; ++i) {
          ElementLane entry;
          load_lanes(h + kSampledLanes * i, entry);
          sum += entry * q[i];
        }
        sums[static_cast<std::size_t>(v)] += sum;
      }
    }
    g.resize(variables_);
    for (int v = 0; v < variables_; ++v) {
      const ElementLane& sum = sums[static_cast<std::size_t>(v)];
      g[v] = ((sum[0] + sum[4]) + (sum[2] + sum[6])) + ((sum[1] + sum[5]) + (sum[3] + sum[7]));
    }
  }

  int groups_ = 0, variables_ = 0;
  bool damped_ = false;
  ModeMatrix added_mass_;
  BoundedMatrix<kMaxVariables, kMaxVariables> damping_at_stamp_;  // B; empty where it is 0

 private:
  Values u_;
  std::array<Group, Group::kGroupsMax> group_;
  Eigen::Matrix<float, kRows * kSampledLanes, Eigen::Dynamic, Eigen::ColMajor, kRows * kSampledLanes,
                Group::kGroupsMax * kMaxVariables>
      motion_;
};

}  // namespace palpate
