// Bodies whose answer somebody else has computed, for palpate-lab tissue.
//
//   bar      100 x 30 x 20 mm, 400 kPa, 1000 kg/m^3, clamped at one end, hangs in gravity: sag of its free end [mm]
//   punch    a square of 20 x 20 mm glued to the top of a block of 60 x 60 x 30 mm, 10 kPa, bonded below, pushed in by 3 and 9
//   mm:
//            force [N]
//
// References: CalculiX 2.20, quadratic hexahedra (C3D20R), neo-Hookean (bench/calculix/README.md); the punch's, whose stress has
// no bound at its edge, continued to elements without size from two meshes, its error being in proportion to their size.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace palpate {

enum class TissueElement { hexahedron, tetrahedron, spring };
inline constexpr const char* kTissueElementNames[] = {"hexahedron", "tetrahedron", "spring"};

struct TissueCase {
  std::string name;  ///< of the plot: "bar, nu = 0.45"
  std::string unit;
  double poisson = 0;
  double punch_m = 0;  ///< 0: the bar
  double reference = 0;
};
const std::vector<TissueCase>& tissue_cases();

struct TissueAnswer {
  TissueElement element = TissueElement::hexahedron;
  int cells_high = 0;
  std::size_t nodes = 0;
  double value = 0, cpu_s = 0;  ///< the answer; processor time to find the equilibrium
};
/// Nothing where the element has no such material: springs have Poisson's ratio 1/4. Throws std::runtime_error where no
/// equilibrium is found.
std::optional<TissueAnswer> answer(const TissueCase& asked, TissueElement element, int cells_high);

}  // namespace palpate
