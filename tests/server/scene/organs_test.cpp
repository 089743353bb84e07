// The organs of scenes/organs: adult masses, sizes that a frame of 20 Hz carries, supports that leave them free to move.
#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <numeric>
#include <string>

#include "server/scene/scene.hpp"

namespace palpate {
namespace {

struct Organ {
  std::string name;
  double least_kg, most_kg;  // of adults; those that are hollow count as full
};

TEST_CASE("Organs have the mass of an adult's, 400 to 900 nodes, and more of them free than held") {
  const auto organ = GENERATE(values<Organ>({{"liver", 1.1, 1.9},
                                             {"kidney", 0.11, 0.18},
                                             {"stomach", 0.3, 1.2},
                                             {"gallbladder", 0.03, 0.08},
                                             {"spleen", 0.1, 0.25},
                                             {"brain", 1.2, 1.5},
                                             {"heart", 0.23, 0.45},
                                             {"tongue", 0.06, 0.11},
                                             {"prostate", 0.015, 0.03},
                                             {"breast", 0.25, 0.8}}));
  const Scene scene = load_scene(std::filesystem::path(PALPATE_SOURCE_DIR) / "scenes/organs" / (organ.name + ".json"));
  const LumpedBody& body = scene.body;
  const double mass_kg = std::accumulate(body.masses_kg.begin(), body.masses_kg.end(), 0.0);
  INFO(organ.name << ", " << mass_kg << " kg");
  CHECK(scene.name == organ.name);
  CHECK(mass_kg >= organ.least_kg);
  CHECK(mass_kg <= organ.most_kg);
  CHECK(body.nodes.size() >= 400);
  CHECK(body.nodes.size() <= 900);
  const auto held = std::count_if(body.fixed.begin(), body.fixed.end(), [](std::uint8_t fixed) { return fixed != 0; });
  CHECK(held >= 3);
  CHECK(2 * static_cast<std::size_t>(held) < body.nodes.size());
  CHECK(body.left_out_share < 0.03);
}

}  // namespace
}  // namespace palpate
