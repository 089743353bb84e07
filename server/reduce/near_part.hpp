// The part of a graded body whose forces are known beyond their tangents: elements around a tool, a body of its own.
//
// It has the springs or tetrahedra with a node within kSpacings of the place of the tool, among those with a node that keeps its
// coordinates (graded_body.hpp), and all their nodes. These move as rows T_p of the graded body's T do: with y its coordinates,
//     x_p = x_p* + T_p y,     F(y) = F* - K y + T_p^T (F_p(x_p) - F_p(x_p*) + K_p T_p y),
// F_p and K_p of these elements alone. All others are as the tangents of the graded body say.
#pragma once

#include "server/body/tangents.hpp"
#include "server/reduce/graded_body.hpp"
#include "server/reduce/local_body.hpp"

namespace palpate {

class NearPart {
 public:
  static constexpr double kSpacings = 4;      ///< of nodes
  static constexpr double kKeptSpacings = 1;  ///< a tool that slides less has the same elements

  /// `body` must outlive it.
  explicit NearPart(const GradedBody& body) : graded_(&body) {}
  /// Around this place of the body at rest, at the state that the graded body was taken at.
  void take(const Vec3& place, const BodyState& state);

  const Dynamics& dynamics() const { return cut_->dynamics; }
  const BodyState& state() const { return state_; }
  const Tangents& tangents() const { return cut_->tangents; }
  /// T_p Y, and T_p^T F.
  Matrix moved(const Matrix& y) const;
  Vector gathered(const Vector& forces) const;

 private:
  struct Cut {
    explicit Cut(LocalBody body) : local(std::move(body)), dynamics(local.body), tangents(dynamics) {}
    LocalBody local;
    Dynamics dynamics;
    Tangents tangents;
  };
  void cut(const Vec3& place);

  const GradedBody* graded_;
  Vec3 place_ = Vec3::Zero();
  std::unique_ptr<Cut> cut_;
  BodyState state_;
};

}  // namespace palpate
