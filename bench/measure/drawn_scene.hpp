// Scenes drawn by chance, for what is said of bodies that nobody has looked at: the same scene of the same number anywhere.
//
//     nodes       4 to 8 a side, held below; those with an even number are grasped in the middle of their top, others touched by
//                 a tip of 1 to 1.8 cells' radius, its friction 0, 0.3 or 0.6; 1000 kg/m^3
//     springs     8 to 16 mm apart, 15 to 200 N/m, b / k 0.5 to 5 ms; one body in four stiffens, c 3 to 60, and one in four has
//                 a quarter of its stiffness in its lower half
//     solids      cells of 6 to 14 mm, 2.5 to 63 kPa, Poisson's ratio 0.3 to 0.48, damping times 1 to 20 ms, of either law
// What spans decades is drawn evenly in its logarithm.
#pragma once

#include <cstdint>
#include <string>

namespace palpate {

struct DrawnScene {
  std::string name, json;
};

DrawnScene drawn_scene(std::uint64_t number, bool solid);

}  // namespace palpate
