// Randomly drawn scenes, for statements on bodies that were not hand-picked. A number gives the same scene on any machine.
//
//     nodes       4 to 8 per side, fixed at the bottom; even numbers are grasped in the middle of the top, odd ones are touched
//                 by a tip of 1 to 1.8 cells' radius, with friction 0, 0.3 or 0.6; 1000 kg/m^3
//     springs     8 to 16 mm apart, 15 to 200 N/m, b / k 0.5 to 5 ms; one body in four stiffens, c 3 to 60, and one in four has
//                 a quarter of its stiffness in its lower half
//     solids      cells of 6 to 14 mm, 2.5 to 63 kPa, Poisson's ratio 0.3 to 0.48, damping times 1 to 20 ms, either law
// Quantities that span decades are drawn evenly in their logarithm.
#pragma once

#include <cstdint>
#include <string>

namespace palpate {

struct DrawnScene {
  std::string name, json;
};

DrawnScene drawn_scene(std::uint64_t number, bool solid);

}  // namespace palpate
