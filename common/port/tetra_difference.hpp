// Force of Ogden's law and of fibres beyond their linear force, by its definition: with F the deformation gradient at the stamp
// and F' = F + dF,
//
//     Q = P(F') - P(F) - A(F) dF,   A = dP/dF   [J, times the tetrahedron's weight and volume]
//     its energy beyond the second order  Psi(F') - Psi(F) - P(F) : dF - dF : A(F) dF / 2
//
// In double precision, which leaves enough digits after the cancellation. A is symmetric, the derivative of a gradient.
#pragma once

#include "common/port/fibre_lanes.hpp"
#include "common/port/ogden.hpp"
#include "common/port/tetra_lane.hpp"

namespace palpate {

/// True when any part of a law is computed in this way.
inline bool is_differenced(const LawParameters& law) { return law.kind == SolidLaw::ogden || law.fibres.share > 0; }

class TetraDifference {
 public:
  /// A tetrahedron without stiffness.
  TetraDifference();
  /// Sets one lane to `deformation`; all lanes have one law. `mu_l`: Lame's, `lambda`: of ogden. Returns mu of the bound of this
  /// tangent's stiffness [J].
  double set(int lane, const LawParameters& law, const Eigen::Matrix3d& deformation, double mu_l, double lambda);
  /// Copies lane 0 to all lanes.
  void spread();
  /// q += Q
  void add_residual_stress(const LawParameters& law, const TetraLanes& df, TetraLanes& q) const noexcept;
  TetraLane residual_energy(const LawParameters& law, const TetraLanes& df) const noexcept;

 private:
  /// Computes F' and dF in doubles.
  void move(const TetraLanes& df, Mat<kTetraLane>& f, Mat<kTetraLane>& way) const noexcept;
  /// Computes A dF.
  void along_tangent(const Mat<kTetraLane>& way, Mat<kTetraLane>& dp) const noexcept;

  Mat<kTetraLane> f_{}, p_{};                       ///< F, P(F) [J]
  Doubles<kTetraLane> a_[45] = {};                  ///< A(F), row by row of P and of F, from the diagonal on [J]
  Doubles<kTetraLane> energy_{}, mu_{}, lambda_{};  ///< energy at F [J]; moduli of the law [J]
  OgdenLaw ogden_;                                  ///< its sum is 0 for another law
};

}  // namespace palpate
