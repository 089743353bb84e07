// What Ogden's law and fibres push beyond their linear force, as it is written: with F the deformation gradient at the stamp,
// dF more, F' = F + dF,
//
//     Q = P(F') - P(F) - A(F) dF,   A = dP/dF   [J, times what a tetrahedron counts]
//     its energy beyond the second order  Psi(F') - Psi(F) - P(F) : dF - dF : A(F) dF / 2
//
// In double precision, of which what cancels leaves enough. A is symmetric, the derivative of a gradient.
#pragma once

#include "common/port/fibre_lanes.hpp"
#include "common/port/ogden.hpp"
#include "common/port/tetra_lane.hpp"

namespace palpate {

/// Is there anything of a law that is taken this way?
inline bool is_differenced(const LawParameters& law) { return law.kind == SolidLaw::ogden || law.fibres.share > 0; }

class TetraDifference {
 public:
  /// What does not resist.
  TetraDifference();
  /// At `deformation` in one lane; one law in all. `mu_l`: Lame's, `lambda`: of ogden. Returns mu of the stiffness that this
  /// tangent may get [J].
  double set(int lane, const LawParameters& law, const Eigen::Matrix3d& deformation, double mu_l, double lambda);
  /// What lane 0 has, in all.
  void spread();
  /// q += Q
  void add_residual_stress(const LawParameters& law, const TetraLanes& df, TetraLanes& q) const noexcept;
  TetraLane residual_energy(const LawParameters& law, const TetraLanes& df) const noexcept;

 private:
  /// F' and dF in doubles.
  void move(const TetraLanes& df, Mat<kTetraLane>& f, Mat<kTetraLane>& way) const noexcept;
  /// A dF
  void along_tangent(const Mat<kTetraLane>& way, Mat<kTetraLane>& dp) const noexcept;

  Mat<kTetraLane> f_{}, p_{};                       ///< F, P(F) [J]
  Doubles<kTetraLane> a_[45] = {};                  ///< A(F), row by row of P and of F, from the diagonal on [J]
  Doubles<kTetraLane> energy_{}, mu_{}, lambda_{};  ///< [J]; of the law
  OgdenLaw ogden_;                                  ///< of no sum where the law is another
};

}  // namespace palpate
