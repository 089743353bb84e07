// Boundary value problems whose answer somebody else has: a closed form, an integral equation, another solver, a measurement.
// What palpate-lab tissue computes on the project's own bodies, and what tests repeat on the smallest meshes.
//
// Everything about a case is in its list: a law or an element that is added to laws_at() or kTissueElementNames comes with its
// rows.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "server/scene/scene.hpp"

namespace palpate {

enum class TissueElement { hexahedron, tetrahedron, spring };
inline constexpr const char* kTissueElementNames[] = {"hexahedron", "tetrahedron", "spring"};
inline constexpr TissueElement kFiniteElements[] = {TissueElement::hexahedron, TissueElement::tetrahedron};
/// Of what is no spring.
SolidElement solid_element(TissueElement element);

struct TissueSolution {
  std::size_t nodes = 0;
  double value = 0;
};

struct TissueCase {
  std::string family;  ///< cases of one picture: "closed forms", "layers", "CalculiX", ...
  std::string name;    ///< "bar, nu = 0.45"
  std::string unit;
  double reference = 0;
  std::string by;                       ///< who answered
  std::vector<TissueElement> elements;  ///< that have such a material
  std::vector<int> cells;               ///< over what decides the error: meshes, the finest last
  /// Throws std::runtime_error where no equilibrium is found.
  std::function<TissueSolution(TissueElement, int cells)> solve;
  /// Where a scene describes the body; empty for others.
  std::function<Scene(TissueElement, int cells)> scene = {};
};

/// p of |error| ~ size^p by least squares over meshes; NaN for less than two or errors that are rounding.
double order_of(const std::vector<int>& cells, const std::vector<double>& errors);

std::vector<TissueCase> homogeneous_cases();  ///< uniaxial, equibiaxial, simple shear, of every law
std::vector<TissueCase> curved_cases();       ///< torsion, thick sphere
std::vector<TissueCase> layer_cases();        ///< Hertz; Hayes et al.
std::vector<TissueCase> membrane_cases();     ///< Cook
std::vector<TissueCase> calculix_cases();     ///< bars, glued punches
std::vector<TissueCase> time_cases();         ///< relaxation, creep, hysteresis
std::vector<TissueCase> febio_cases();        ///< of its verification suite
/// Of that name; throws std::logic_error for none.
const TissueCase& tissue_case(const std::string& name);
/// All of them.
const std::vector<TissueCase>& tissue_cases();

}  // namespace palpate
