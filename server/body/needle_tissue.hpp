// The body as a needle meets it: where a path goes through its material, and through which layers.
//
// A material point X of the body, inside or on the path's continuation, moves with the nodes around it by moving least squares,
//     x(X) = X + sum_i w_i (x_i - X_i),    w_i = m_i p(X_i)^T A^-1 p(X),   A = sum_i m_i p(X_i) p(X_i)^T,   p(Y) = (1, Y - X),
// with m_i = (1 - (|X_i - X| / R)^2)^2 over the nodes nearer than R, so that every affine motion of the nodes moves X exactly,
// and a force at X is spread over R: the indentation under a needle does not depend on the mesh. The first point of a path is the
// point of the skin that was punctured (skin.hpp).
//
// A path is straight where it is begun: x(X_j) = x_0 + d_j t, with |X_(j+1) - X_j| = spacing. Layers are given by their thickness
// at rest; the path enters one where its distance from the surface first passes the sum of those above. Between the stretches of
// a path in the body at rest are gaps: an open wound, a fold. A cut that is closed at rest is none.
//
// Shapes and units: X, x 3 [m], w 1, t of length 1; R [m], of the tool's contact, at least kLeastSpacings mean lengths of an
// element. What can go wrong: where the nodes around X lie in a plane, A is made regular, and rotations out of it move X less.
// Source: Lancaster and Salkauskas, Math. Comp. 37 (1981).
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "common/patch/needle_in_body.hpp"
#include "server/body/skin.hpp"

namespace palpate {

/// A path in the body, of material points.
struct NeedlePath {
  struct Point {
    NodeWeights b;
    Vec3 offset = Vec3::Zero();  ///< x = offset + sum w_i x_i
    Vec3 position(const Vector& x) const { return offset + gather(b, x); }
  };
  NeedleLayers layers;
  std::array<Point, kNeedlePoints> points;
  std::array<Vec3, kNeedlePoints> rest;  ///< X_j
  Vec3 edge = Vec3::Zero();              ///< of a blade: from end to end, at rest; zero: of a needle

  /// Returns the position at a depth; `tau`: the derivative by the depth.
  Vec3 position(double depth_m, const Vector& x, Vec3& tau) const;
  /// Returns the place at a depth in the body at rest.
  Vec3 rest_at(double depth_m) const;
  /// A part of the path in the body, from where it enters to where it comes out.
  struct Stretch {
    double begins_m = 0, ends_m = 0;  ///< depths
  };
  /// Returns those that a needle has passed whose tip is outside again at a depth; none if it is inside.
  std::vector<Stretch> passed(double depth_m) const;
  /// Returns the weights at a depth; beyond the last point those of that one.
  NodeWeights weights(double depth_m) const;
  /// Returns the cut that a blade has made with its front at a depth > 0.
  CutSettings cut(double depth_m) const;
};

class NeedleTissue {
 public:
  /// `body` and `skin` must outlive it. `scene.tool.needle` is set. R stays that of this body.
  NeedleTissue(const Scene& scene, const Skin& skin);
  /// Takes up a change of the body and its skin by a cut. Material points hang on its first `nodes` nodes: not on the copies that
  /// cuts make, whose cells may have a small share.
  void renew(std::size_t nodes) { nodes_ = nodes; }
  /// Returns the path of a needle that enters at `entry` along `way`, a unit vector, in the body at `x`.
  /// `edge`: unit vector along the edge of a blade.
  std::shared_ptr<const NeedlePath> path(const SurfacePoint& entry, const Vec3& way, const Vec3& edge, const Vector& x) const;
  /// Returns the path of a needle that was in this body.
  std::shared_ptr<const NeedlePath> path_of(const NeedleInBody& needle) const;
  /// Returns the path in this body, which one that had it was cut to; `now`: nodes_now().
  std::shared_ptr<const NeedlePath> carried_over(const NeedlePath& path, std::span<const std::uint32_t> now) const;
  /// Returns the push with which a tip enters the body.
  double puncture_n() const { return body_->tissue.front().puncture_n; }
  /// Returns the weights of a point of the body at rest.
  NeedlePath::Point point(const Vec3& rest) const;

 private:
  Vec3 rest_of(const Vec3& target, Vec3 guess, const Vector& x) const;
  std::vector<double> crossings(const std::array<Vec3, kNeedlePoints>& rest) const;
  NeedleLayers layers_along(const std::array<Vec3, kNeedlePoints>& rest) const;
  double depth_of(const Vec3& rest) const;

  const LumpedBody* body_;
  std::size_t nodes_;
  const Skin* skin_;
  double radius_m_ = 0;
  NeedleSpec needle_;
};

}  // namespace palpate
