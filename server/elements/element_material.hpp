// The material of finite elements: a law of elasticity (common/mechanics/laws.hpp), its moduli, and its viscosity
// (common/mechanics/viscosity.hpp). Functions of one deformation gradient F; in lanes: law_loops.hpp.
#pragma once

#include <array>
#include <memory>

#include "common/base/types.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

class Elasticity;

struct ElementMaterial {
  explicit ElementMaterial(const SolidMaterial& material);
  bool is_viscous() const { return damping_s > 0; }
  std::shared_ptr<const Elasticity> law;
  SolidLaw kind;
  bool has_fibres;
  double mu, lambda;  ///< Lame's parameters of small strains [Pa]
  double damping_s;   ///< t, the viscous moduli over the elastic ones [s]
};

/// 9 x 9, in the order of F's entries row by row.
using Mat9 = Eigen::Matrix<double, 9, 9>;

/// Returns the energy densities of four elements, side by side [J/m^3].
std::array<double, 4> elastic_energy_densities(const ElementMaterial& material, const std::array<Mat3, 4>& f);
Mat3 elastic_stress(const ElementMaterial& material, const Mat3& f);
/// Returns A = dP/dF; `clamp` projects it onto the positive semi-definite matrices.
Mat9 elastic_tangent(const ElementMaterial& material, const Mat3& f, bool clamp);

}  // namespace palpate
