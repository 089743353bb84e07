// The terms that go with a linear patch: scaled variables, the energy's higher orders, and the repair of a stiffness that was
// lifted.
//
// In the modes q of the patch the candidates of the basis (cubic_basis.hpp) have coordinates C, each as large as it is likely to
// become. With the singular value decomposition sqrt(K) C = U diag(sigma) ..., sigma no smaller than kFloor of the largest,
//     q = T y,   T = K^-1/2 U diag(sigma),   S = T^-1 = diag(sigma)^-1 U^T K^1/2
// so that |y_i| is about 1, and the first y_i carry most energy. For a grasp y starts with d_i / a_i, a_i how far the tool is
// likely to move along axis i. That decides which variables get the highest terms.
// Then every variable is measured in how far it may go: to where, alone, the force of the last terms that it has (fourth order
// for the leading ones, third for the others) is as large as the linear one. The radius of trust is 1 in these units: an
// ellipsoid of displacements that the expansion knows something about, whatever the body's size and the hand's speed.
// Where variables act together, or a body snaps, the expansion may end before that. So the body itself is asked at displacements
// that it is likely to come to, with f its own forces at rest on the variables at y:
//     N(y) = f(y) - f(0) + K y,   N^(y) = - d(E3 + E4)/dy,   trusted while |N^ - N| <= max(kWrong |N|, kHarmless |K y|)
// and where that fails the radius ends before (found to a third, and at least kLeast).
// Springs of the body go instead of a polynomial, as they bend as it does, however far, for laws that stiffen and planar bodies
// always; and else where the radius ends below 1 or short of where the body is likely to come to, rest among it, or where they
// are less wrong there (are_truer()).
// Under a touch their dampers stay at home where the modes brake away more than exp(-kMostBraked) of what moves within a step:
// what dampers push for having turned is a step old when the player takes it. A grasp knows at once how the tool moves its node.
// A solid of finite elements has no polynomials here, its terms are always some of its tetrahedra.
// A patch is lifted to be passive (lift.hpp); with u = (d, q) and H, H~ the joint stiffness before and after,
//     E2 = 1/2 u^T (H - H~) u.
#pragma once

#include <optional>

#include "common/port/cubic_terms.hpp"
#include "common/port/patch.hpp"
#include "server/reduce/basis.hpp"

namespace palpate {

struct CubicShapes {
  Matrix port;         ///< how the body moves for d_i = a_i with all modes at zero, 3 N x 3; no columns for touch
  Vec3 amplitude;      ///< a_i [m]; of a grasp
  Matrix modes;        ///< V, of the patch
  Matrix coordinates;  ///< C
  int dents = 0;       ///< of its columns, the last
  Matrix lifted;       ///< H - H~
  Matrix ways;         ///< u of where the body was, rests and will be, a column each
  int ahead = 0;       ///< of its columns, the last: where it will be
  int going_on = 0;    ///< of these, the first: as hands go on by themselves
};

/// u of where the body is likely to come to, or may be pressed to: `ways`, and dents as deep as the hand goes, which yields by a
/// part of that while they are made (dent.hpp) and need not.
Matrix likely_ways(const CubicShapes& shapes);

/// A body, asked for its forces on the variables u of a patch.
class BentBody {
 public:
  BentBody(const Linearisation& at, const CubicShapes& shapes);
  const Linearisation& at() const { return at_; }
  /// How it moves with u, 3 N x n.
  const Matrix& moved() const { return moved_; }
  /// N(u); `linear`: K u.
  Vector beyond_linear(const Vector& u, Vector& linear);

 private:
  Linearisation at_;
  Matrix moved_, stiffness_;
  Vector still_, here_;  // empty until something is asked
};

/// Polynomials, with as many terms of fourth order as fit beside a surface of which so many vertices are in the patch. Nothing
/// for a body whose forces have no expansion.
std::optional<CubicTerms> cubic_terms(BentBody& body, const Patch& patch, const CubicShapes& shapes, int vertices);

/// Terms that are springs or tetrahedra of the body (sample_springs.hpp, sample_tetrahedra.hpp), as many as fit: for a body that
/// no polynomial follows as far as it is likely to go. Nothing where they would not be stable.
std::optional<CubicTerms> sampled_terms(const BentBody& body, const Patch& patch, const CubicShapes& shapes, int vertices);

/// Whether springs `a` are less wrong than polynomials `b` where the body is likely to come to or may be pressed to, and half way
/// there: sum of
///     min(1, |N^ - N| / (|N| + kOfLinear |K u|))^2,   forces in units that make the stiffness of each variable 1.
/// Where polynomials are wrong by a sixth of that in the mean square they are not asked any further: springs bend as the body
/// does, somehow, wherever the hand goes. Never of a grasp that has not moved and will not, as far as anybody knows: springs are
/// fitted to where it is likely to come to, polynomials suit every way.
bool are_truer(BentBody& body, const Patch& patch, const CubicShapes& shapes, const CubicTerms& a, const CubicTerms& b);

}  // namespace palpate
