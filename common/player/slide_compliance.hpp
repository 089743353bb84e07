// Compliance that the modes of a linear touch patch lack where the tool has slid.
//
// The modes respond to a push at the contact point of the stamp, a. With G = (s^2 + s D + K)^-1 and R_p the port rows at p, they
// yield
//     C_p = R_p G R_p^T
// within a time of 1 / s. They yield less away from a, where the body yields about as much as at a. It yields less than at a
// where p lies between nodes and a was one, since the local part of its compliance is proportional to the sum of squares of the
// barycentric weights w,
//     rho = min(1, |w_p|^2 / |w_a|^2).
// With C_0 = C_a + c_static and C_a - C_p / rho = sum_i mu_i u_i u_i^T in the metric of C_0 (u_i^T C_0^-1 u_j = delta_ij), the
// compliance that acts at once at p, like c_static, is
//     rho sum_i max(0, mu_i - theta) u_i u_i^T,
// which is zero where the modes have all but theta of it. Compliance used under a push remains until the push ends (grown()): if
// the body stiffened again under a tool that slides back, the tool would gain energy that nobody put in. Error: the body's own
// stiffness at p is not known here; that at a is used.
//
// Shapes and units: r modes, R_p 3 x r, D r x r, K = diag; C_p, C_0, c_static 3 x 3 [m/N], frame W; w of length 3; s [1/s]; theta
// has no unit. With too small an s a free body yields without bound; too small a theta counts twice what the modes have.
// Measured: docs/notebook.md, 22. Terms bend the modes instead: with both an organ loses up to 11 dB.
#pragma once

#include "common/patch/patch.hpp"

namespace palpate {

class SlideCompliance {
 public:
  static constexpr double kShift_1_s = 20;         ///< s: within 50 ms; at 0 a body that nothing holds has no compliance
  static constexpr double kMissingShareMin = 0.3;  ///< theta, tuned (docs/notebook.md, 22)

  /// Computes the reference from R_a and w_a. For the network side of the hand-over, not for the tick.
  SlideCompliance(const Patch& patch, const PortRows& rows, const Vec3& weight);
  /// Returns the missing compliance from R_p and w_p. Does not allocate.
  Mat3 missing(const PortRows& rows, const Vec3& weight) const noexcept;
  /// Returns the compliance used by a push that has used `before` so far and slides to where `missing` is missing: before +
  /// (missing - before)_+.
  static Mat3 grown(const Mat3& before, const Mat3& missing) noexcept;

 private:
  Mat3 of_modes(const PortRows& rows) const noexcept;

  ModeMatrix whitening_;          // L^-1 of s^2 + s D + K = L L^T
  Mat3 at_stamp_ = Mat3::Zero();  // C_a
  Mat3 root_, inverse_root_;      // C_0 = root root^T
  double shared_ = 1;             // |w_a|^2
};

}  // namespace palpate
