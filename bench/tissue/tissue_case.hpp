// Boundary value problems with an independent solution: a closed form, an integral equation, another solver, a measurement.
// palpate-lab tissue and surgery compute them on the project's own bodies, and tests repeat them on the smallest meshes.
//
// Everything about a case is in its list: a law or an element added to laws_at() or kTissueElementNames brings its rows.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "server/scene/scene.hpp"

namespace palpate {

enum class TissueElement { hexahedron, tetrahedron, spring };
inline constexpr const char* kTissueElementNames[] = {"hexahedron", "tetrahedron", "spring"};
inline constexpr TissueElement kFiniteElements[] = {TissueElement::hexahedron, TissueElement::tetrahedron};
/// Element type of the finite elements; not for springs.
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
  std::string by;                       ///< source of the reference
  std::vector<TissueElement> elements;  ///< elements that support the material
  std::vector<int> cells;               ///< over the length that determines the error: meshes, the finest last
  /// Solves the case. Throws std::runtime_error if no equilibrium is found.
  std::function<TissueSolution(TissueElement, int cells)> solve;
  /// Scene of the body, if one describes it; else empty.
  std::function<Scene(TissueElement, int cells)> scene = {};
};

/// Order p of |error| ~ size^p by least squares over meshes; NaN for fewer than two meshes or for errors at rounding level.
double order_of(const std::vector<int>& cells, const std::vector<double>& errors);

std::vector<TissueCase> homogeneous_cases();  ///< uniaxial, equibiaxial, simple shear, for every law
std::vector<TissueCase> curved_cases();       ///< torsion, thick sphere
std::vector<TissueCase> layer_cases();        ///< Hertz; Hayes et al.
std::vector<TissueCase> membrane_cases();     ///< Cook
std::vector<TissueCase> calculix_cases();     ///< bars, glued punches
std::vector<TissueCase> time_cases();         ///< relaxation, creep, hysteresis
std::vector<TissueCase> febio_cases();        ///< from its verification suite
/// All of these.
const std::vector<TissueCase>& tissue_cases();
std::vector<TissueCase> tool_cases();  ///< needle and blade
std::vector<TissueCase> tear_cases();  ///< tears and threads
/// Both, for palpate-lab surgery.
std::vector<TissueCase> surgery_cases();
/// Returns the case of that name among all of both; throws std::logic_error if there is none.
const TissueCase& tissue_case(const std::string& name);

}  // namespace palpate
