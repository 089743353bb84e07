// Randomly drawn scenes: bodies that can be simulated, all different, the same for the same number.
#include "bench/measure/drawn_scene.hpp"

#include <catch2/catch.hpp>
#include <set>

#include "server/scene/scene.hpp"

using namespace palpate;

TEST_CASE("scenes that are drawn can be read, are what they are said to be, and of one number always the same") {
  for (const bool solid : {false, true}) {
    std::set<std::string> all;
    int stiffening = 0, corotational = 0;
    for (std::uint64_t number = 1; number <= 100; ++number) {
      const DrawnScene drawn = drawn_scene(number, solid);
      CHECK(drawn.json == drawn_scene(number, solid).json);
      all.insert(drawn.json);
      const Scene scene = read_scene(drawn.json, drawn.name);
      CHECK(scene.name == drawn.name);
      CHECK((scene.tool.contact == ContactKind::attach) == (number % 2 == 0));
      CHECK(scene.body.nodes.size() >= 64);
      CHECK(scene.body.nodes.size() <= 512);
      CHECK(scene.body.is_solid() == solid);
      stiffening += scene.body.law == SpringLaw::stiffening ? 1 : 0;
      corotational += solid && scene.body.materials.front().law == SolidLaw::corotational ? 1 : 0;
    }
    CHECK(all.size() == 100);
    if (solid)
      CHECK((corotational > 30 && corotational < 70));
    else
      CHECK((stiffening > 10 && stiffening < 40));
  }
}
