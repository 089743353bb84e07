// The kernel of a lumped element: its force and both of its tangents.
//
// An element joins nodes a and b. With d = x_b - x_a, L = |d|, n = d / L, elongation e = L - L0, and w = v_b - v_a:
//
//     axial force      s = T(e) + c (n . w)                     [N], tension positive, c the damping [N s/m]
//     force on node a  F_a = s n,   force on node b  F_b = -s n
//
// Tangents of F_a, as 3x3 blocks (those of F_b are their negatives):
//     dF_a/dx_b = (T' n n^T + (s/L) P) + c n (P w)^T / L,       P = I - n n^T
//     dF_a/dv_b = c n n^T
// The bracket is symmetric; the last term, from the rotation of the damper's direction, is not. Solvers and patches use the
// symmetric part only (a quasi-Newton matrix, and a patch that must be passive); stiffness_exact() returns all of it.
//
// T(e) and T' for the spring laws are those of scene.hpp.
#pragma once

#include "common/base/types.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

struct SpringResponse {
  double tension = 0;  ///< T(e) [N]
  double slope = 0;    ///< T'(e) [N/m]
};
SpringResponse spring_response(SpringLaw law, double stiffening, const Element& element, double elongation_m);

/// Integral of T from 0 to e [J].
double spring_energy(SpringLaw law, double stiffening, const Element& element, double elongation_m);

/// T and its first two derivatives.
struct SpringSeries {
  double tension = 0, slope = 0, second = 0;  ///< [N], [N/m], [N/m^2]
};
/// Returns true if the law is smooth at every elongation; thigh_skin is not: it is odd, so its curvature jumps at rest.
bool is_smooth(SpringLaw law);
/// Requires is_smooth(law).
SpringSeries spring_series(SpringLaw law, double stiffening, const Element& element, double elongation_m);

/// All quantities of one element at one state that its force and tangents need.
struct ElementState {
  Vec3 direction = Vec3::UnitX();  ///< n
  double inv_length = 0;           ///< 1/L [1/m]; 0 for an element of zero length, which has no direction and no force
  double axial = 0;                ///< s [N]
  double slope = 0;                ///< T' [N/m]
  Vec3 rate = Vec3::Zero();        ///< w [m/s]
};

class SpringKernel {
 public:
  SpringKernel(SpringLaw law, double stiffening) : law_(law), stiffening_(stiffening) {}

  [[gnu::always_inline]] ElementState evaluate(const Element& element, const Vec3& d, const Vec3& w) const {
    ElementState s;
    const double length = d.norm();
    if (length <= kMinLength) return s;
    s.inv_length = 1.0 / length;
    s.direction = d * s.inv_length;
    s.rate = w;
    const double elongation = length - element.rest_length_m;
    if (law_ == SpringLaw::linear) {
      s.axial = element.stiffness_n_m * elongation;
      s.slope = element.stiffness_n_m;
    } else {
      const SpringResponse r = spring_response(law_, stiffening_, element, elongation);
      s.axial = r.tension;
      s.slope = r.slope;
    }
    s.axial += element.damping_n_s_m * s.direction.dot(w);
    return s;
  }

  static Vec3 force_on_a(const ElementState& s) { return s.axial * s.direction; }

  /// dF_a/dx_b. `clamp` drops the negative geometric stiffness of a compressed element, so that the block is positive
  /// semi-definite.
  static Mat3 stiffness_symmetric(const ElementState& s, bool clamp) {
    double geometric = s.axial * s.inv_length;
    if (clamp && geometric < 0) geometric = 0;
    Mat3 k = (s.slope - geometric) * s.direction * s.direction.transpose();
    k.diagonal().array() += geometric;
    return k;
  }
  static Mat3 stiffness_exact(const Element& element, const ElementState& s) {
    const Vec3 across = s.rate - s.direction * s.direction.dot(s.rate);
    return stiffness_symmetric(s, false) + element.damping_n_s_m * s.inv_length * s.direction * across.transpose();
  }
  /// dF_a/dv_b.
  static Mat3 damping(const Element& element, const ElementState& s) {
    return element.damping_n_s_m * s.direction * s.direction.transpose();
  }

 private:
  static constexpr double kMinLength = 1e-12;
  SpringLaw law_;
  double stiffening_;
};

}  // namespace palpate
