// What the forces of a patch have beyond the linear model, as a polynomial in the reduced displacement: scheme `cubic`.
//
// The n variables y = S u are scaled so that |y_i| is about 1 over the time that the patch bridges. u = (d, q) for a grasp
// (d the tool's displacement from the stamp), u = q for touch; n <= rows(u). With `leading` = l of them, the first, carrying the
// highest terms:
//
//     E(y) = sum_{i<=j} e2_ij y_i y_j + sum_{i<=j<=k} e3_ijk y_i y_j y_k + sum_{i<=j<=k<=m; m < l} e4_ijkm y_i y_j y_k y_m [J]
//     elastic:  f = - dE/dy
//     dampers turn with their elements:  f_i -= sum_jk Q_i,jk y_j y'_k + sum_jk Q_k,ij y_j (y'_k - y'*_k)     (i, j, k < l)
//
// y'* the rate at the stamp; Q_i,jk = sum over elements of (c/rho) a_i B_jk with a_i the stretch of the element by y_i along its
// axis and B_jk the product of its motions across it: the first-order change of the dampers' directions. The force on u is
// S^T f. E2 repairs what the linear patch was changed by to be passive; it is zero elsewhere.
// That first order alone would push where dampers turn far. Their change D1(y) y', D1_ik = sum_j y_j (Q_i,jk + Q_k,ji), is
// therefore kept below the patch's own dampers D as it acts, |D1 y'| <= c |D y'| in the norm x^T D^-1 x: so it never pushes more
// than those brake; what is left out of it is left out of the part at the stamp too. c = kDamperChange. The elastic part is
// conservative whatever its coefficients are. A polynomial may fall where the body does not: E3 + E4 are taken for no less than
// -kSoftening E_lin, E_lin = u^T H u / 2 of the patch, so what is left holds the body up (E2, which repairs, aside). Outside of
// |y| = radius the energy is continued along rays as a constant: E(y radius / |y|), so that its force falls off as 1/|y| instead
// of growing with the cube.
//
// Where a body bends beyond any polynomial, the terms are some of its springs instead (sampled_springs.hpp), with y = u and no
// radius. Their dampers turn as the body's do, however far, so c = kSpringDamperChange: short of 1, where nothing would brake and
// what a tick adds to a fast brake would grow from tick to tick. That bounds what pushes. Dampers that brake more for having
// turned may do so by any factor (those of a solid grow with the square of its stretch): where g = D1 y' is beyond that bound and
// y'^T g > 0, they are taken at the end of the step, along g alone, as R = g g^T / (y'^T g), which does to y' what D1 does and
// nothing across (R <= D1 where D1 >= 0). With C f the rates that a force f on the modes gives at a step's end, and f_b the force
// that the step went with already, its end has y'_e = y' - C f_b - C R y'_e:
//     f = -alpha g,   alpha = g^T (y' - C f_b) / (y'^T g + g^T C g)
// of second order where C g is small; from step to step (1 + C R)^-1 (1 - (W - C) R), W what a whole step gives, W / 2 <= C <= W,
// is a contraction in the norm of C^-1 however large R is. One direction is not enough for a solid that is grasped and let go of:
// there S, D1 as it was some milliseconds ago (turned_dampers.hpp), is taken at the end of the step, and g = (D1 - S) y' is what
// is left for all this:
//     f = -S y'_e - alpha g,   y'_e = y' + C (f - f_b),   alpha as above with (1 + C S)^-1 C for C and the y'_e of g = 0.
// A touch has S where D brakes its modes away many times within a step. What sampled elements store they give back, so nothing
// bounds it: a body that snaps gives away more than -kSoftening E_lin. E2 has no end there, so it is left out unless springs that
// are stretched without end hold the body up in spite of it. Of a solid they are some of its finite elements
// (sampled_tetrahedra.hpp), of which all this is true too.
//
// The terms of a touch bring more of the surface too, what the patch's own datagram had no room for: the tool goes on where the
// patch's own piece ends.
//
// Source: reduced internal forces as polynomials in the modal coordinates, Barbic and James, SIGGRAPH (2005), for
// springs and with ports.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <variant>
#include <vector>

#include "common/base/limits.hpp"
#include "common/port/patch.hpp"
#include "common/port/sampled_springs.hpp"
#include "common/port/sampled_tetrahedra.hpp"
#include "common/port/turned_dampers.hpp"

namespace palpate {

inline constexpr int kMaxLeading = 12;

/// Numbers of monomials of n variables.
constexpr int pairs_of(int n) { return n * (n + 1) / 2; }
constexpr int triples_of(int n) { return n * (n + 1) * (n + 2) / 6; }
constexpr int quadruples_of(int n) { return n * (n + 1) * (n + 2) * (n + 3) / 24; }

/// Where y_i y_j, y_i y_j y_k, y_i y_j y_k y_m stand, i <= j <= k <= m: colexicographic order, so that the monomials of the first
/// variables come first whatever n is.
constexpr int pair_at(int i, int j) { return i + j * (j + 1) / 2; }
constexpr int triple_at(int i, int j, int k) { return pair_at(i, j) + k * (k + 1) * (k + 2) / 6; }
constexpr int quadruple_at(int i, int j, int k, int m) { return triple_at(i, j, k) + m * (m + 1) * (m + 2) * (m + 3) / 24; }

struct CubicTerms {
  int variables = 0, leading = 0;
  bool grasp = false;          ///< u starts with the tool's displacement
  Eigen::MatrixXd scale;       ///< S, n x rows(u) [1/m for d, 1/(m kg^1/2) for q]
  Eigen::VectorXf e2, e3, e4;  ///< [J]
  Eigen::MatrixXf q;           ///< Q, l x pairs(l) [J s]
  Eigen::VectorXd rate;        ///< y'* [1/s]
  double radius = 0;           ///< of trust, in y; 0: nothing is trusted
  SampledSprings springs;      ///< any: S is the identity, and there is nothing of the polynomials
  SampledTetrahedra solid;     ///< the same; never beside springs
  bool sampled() const { return springs.count() > 0 || solid.count() > 0; }
  // of a touch: vertices numbered on from the patch's own, and triangles between any of them
  std::vector<PortVertex> vertices;
  std::vector<Triangle> triangles;
};

/// Whether patch and terms together keep to the limits of a surface.
bool has_room(const PortSurface& surface, const CubicTerms& terms);
/// `patch` with the surface that its terms bring, for which it has room.
Patch extended(Patch patch, const CubicTerms& terms);

/// Of the player in a tick, with terms: contact law and terms are of second order in the step. Twice as many where springs are
/// too stiff for that.
inline constexpr int kTouchSteps = 2, kGraspSteps = 1;
inline constexpr float kDamperChange = 0.5F, kSpringDamperChange = 0.9F, kSoftening = 0.9F;
/// Of u, with these stiffnesses of the modes: H = [[K_p, -B_k^T], [-B_k, diag(stiffness)]] for a grasp, diag(stiffness) for
/// touch.
Eigen::MatrixXd joint_stiffness(const Patch& patch, const Eigen::VectorXd& stiffness);
/// D of u: [[D_p, -B_d^T], [-B_d, D]] for a grasp, D for touch.
Eigen::MatrixXd joint_damping(const Patch& patch);

/// Compiled for the haptic thread: a gradient is two products of a matrix with the monomials of lower degree.
class CubicForce {
 public:
  using Variables = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxVariables, 1>;

  CubicForce() = default;
  /// Allocates nothing that outlives it, but takes some microseconds. The polynomial alone: nothing is limited, no damper turns.
  explicit CubicForce(const CubicTerms& terms);
  /// Beside the patch that the terms go with; where its damping is not positive definite no damper turns. Empty where nothing
  /// is stable.
  CubicForce(const CubicTerms& terms, const Patch& patch);

  bool empty() const { return variables_ == 0; }
  /// In which the player takes them, in a tick.
  int steps() const { return steps_; }
  /// Of the modes beside 1, as springs need it for a step; of no size: none (sampled_springs.hpp).
  const ModeMatrix& added_mass() const;
  /// To u, for all that follows. No allocation, nor below.
  void move_to(const Variables& u) noexcept;
  /// Elastic force on u.
  void elastic(Variables& force) const noexcept;
  /// Force on u, that moves at u', of dampers that have turned. `closing`: C, of the modes, the last of u; `before`: f_b, of u.
  void damping(const Variables& u_rate, const ModeMatrix& closing, const Variables& before, Variables& force) noexcept;
  /// E [J], for tests of energy.
  double energy() const noexcept;

 private:
  static constexpr int kPairs = pairs_of(kMaxVariables), kTriples = triples_of(kMaxLeading),
                       kLeadingPairs = pairs_of(kMaxLeading);
  // Room for whole vector registers: GCC 12 warns of reads past the end of an odd one.
  static constexpr int kRoom = (kMaxVariables + 7) / 8 * 8;
  using Values = Eigen::Matrix<float, Eigen::Dynamic, 1, 0, kRoom, 1>;

  /// The point of the ray to y that is no further than the radius.
  Values within(const Values& y) const noexcept;
  void take_polynomials(const CubicTerms& terms);
  /// E3 + E4, and its gradient.
  float polynomial(Values& g) const noexcept;
  /// Minus what dampers push more for having turned, and what of that the patch has at the stamp.
  void turn_dampers(const Values& rate, Values& change, Values& at_stamp) const noexcept;
  float linear_energy(const Values& y) const noexcept;
  /// Of a solid's dampers that push `change` more than at the stamp, `most`: the bound of what they do beside S.
  void brake_at_end(const Variables& change, const Variables& u_rate, const ModeMatrix& closing, const Variables& before,
                    float most, Variables& force) const noexcept;

  template <typename Of>
  decltype(auto) of_sampled(const Of& of) const {
    return std::visit(of, sampled_);
  }
  bool has_sampled() const noexcept {
    return of_sampled([](const auto& s) { return !s.empty(); });
  }
  /// In steps of this many a tick.
  void take_sampled(const CubicTerms& terms, bool slowed);

  int variables_ = 0, leading_ = 0, steps_ = 1;
  Values asked_, y_;  // y of u, and within the radius
  std::variant<SampledForce, SampledSolidForce> sampled_;
  TurnedDampers turned_;  // of a solid
  int since_asked_ = 0;   // steps since those were asked
  bool has_e2_ = false, has_damping_ = false;
  float radius_ = 0;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxVariables, kMaxVariables> scale_;
  // Gradients of the three energies: rows of coefficients against y, pairs and triples.
  Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxVariables, kMaxVariables> g2_;
  Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxVariables, kPairs> g3_;
  Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxLeading, kTriples> g4_;
  Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxLeading, kLeadingPairs> q_;
  Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxVariables, kMaxVariables> linear_;  // H in y
  // L^T and L^-1, D = L L^T in y.
  Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxVariables, kMaxVariables> root_, inverse_;
  Eigen::Matrix<float, Eigen::Dynamic, 1, 0, kLeadingPairs> turned_at_stamp_;  // Q^T y'*
};

}  // namespace palpate
