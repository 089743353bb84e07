// The part of a locally refined body whose forces are computed beyond their tangents: the elements around a tool, as a body of
// its own.
//
// It consists of the springs or finite elements with a node within kReachSpacings of the place of the tool, among those with a
// node that keeps its coordinates (refined_body.hpp), and all their nodes. These move by rows T_p of the refined body's T: with y
// its coordinates,
//     x_p = x_p* + T_p y,     F(y) = F* - K y + T_p^T (F_p(x_p) - F_p(x_p*) + K_p T_p y),
// F_p and K_p of these elements alone. All others follow the tangents of the locally refined body.
#pragma once

#include "server/operators/local_body.hpp"
#include "server/operators/refined_body.hpp"

namespace palpate {

class NonlinearSubdomain {
 public:
  static constexpr double kReachSpacings = 4;  ///< in node spacings; measured: 3 to 8 are within 1 dB (docs/notebook.md, 19)
  static constexpr double kKeptSpacings = 1;   ///< a tool that slides by fewer spacings keeps its elements; more: cut less often

  /// `body` must outlive it.
  explicit NonlinearSubdomain(const RefinedBody& body) : refined_(&body) {}
  /// Selects the part around this place of the body at rest, in the state at which the locally refined body is linearised.
  void take(const Vec3& place, const BodyState& state);

  /// Returns the body with F_p and K_p, linearised at x_p*.
  const WholeBody& body() const { return cut_->whole; }
  /// Return T_p Y, and T_p^T F.
  Matrix moved(const Matrix& y) const;
  Vector gathered(const Vector& forces) const;

 private:
  struct Cut {
    explicit Cut(LocalBody body) : local(std::move(body)), dynamics(local.body), whole(dynamics) {}
    LocalBody local;
    Dynamics dynamics;
    WholeBody whole;
  };
  void cut(const Vec3& place);

  const RefinedBody* refined_;
  Vec3 place_ = Vec3::Zero();
  std::unique_ptr<Cut> cut_;
  BodyState state_;
};

}  // namespace palpate
