// The off-line check of locality: bodies that it must distinguish, and properties of any body.
#include "bench/paper/dominance.hpp"

#include <catch2/catch.hpp>

#include "bench/paper/cube.hpp"

using namespace palpate;

namespace {

Dominance of_scene(const std::string& name, int layers_max = 3) {
  const Scene scene = load_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/" + name);
  return dominance(Specimen(scene.body, scene.tool.node), layers_max);
}

}  // namespace

TEST_CASE("A soft core below a stiff surface is told from a homogeneous block: a slow push deforms it deeper") {
  const Dominance homogeneous = of_scene("cube6.json"), soft_core = of_scene("softcore6.json");
  for (std::size_t k = 1; k <= 3; ++k) CHECK(soft_core.layers[k].slow_within < homogeneous.layers[k].slow_within);
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(soft_core.rings[k].dc > homogeneous.rings[k].dc);
  }
}

TEST_CASE("Shares grow with the layer to one, and in a homogeneous block stay above those of energy spread evenly") {
  const Dominance d = of_scene("cube6.json", 1);
  CHECK(d.layers.front().within == 0);  // the instrument's own node does not move
  for (std::size_t k = 1; k < d.layers.size(); ++k) {
    CHECK(d.layers[k].within >= d.layers[k - 1].within);
    CHECK(d.layers[k].within >= d.layers[k].even_within - 1e-12);
  }
  CHECK(d.layers.back().within == Approx(1));
  CHECK(d.layers.back().slow_within == Approx(1));
  CHECK(d.distance_50_m <= d.distance_90_m);
  CHECK(d.distance_90_m <= d.extent_m);
  CHECK(d.states_full == 2 * (5 * 36 - 1) * 3);
}

TEST_CASE("A solid is examined like a body of springs") {
  const Scene solid = solid_cube(ContactKind::attach);
  REQUIRE(solid.body.elements.empty());
  const Dominance d = dominance(Specimen(solid.body, solid.tool.node), 12);
  for (std::size_t k = 1; k < d.layers.size(); ++k) {
    CHECK(d.layers[k].within >= d.layers[k - 1].within);
    CHECK(d.layers[k].slow_within >= d.layers[k - 1].slow_within);
  }
  CHECK(d.layers.back().within == Approx(1));
  CHECK(d.layers.back().slow_within == Approx(1));
  CHECK(d.layers.back().even_within == Approx(1));
  CHECK(d.layers[2].slow_within > d.layers[2].even_within);  // a push deforms near parts more than far ones
  CHECK(d.distance_50_m > 0);
  CHECK(d.rings.back().states == d.states_full);
  CHECK(d.rings.back().dc < 1e-6);  // a ring of all layers equals the body
}

TEST_CASE("A ring of all layers is the body itself") {
  const Specimen sheet = Specimen::sheet(5, {});
  const Dominance d = dominance(sheet, 4);
  CHECK(d.rings.back().dc < 1e-6);
  CHECK(d.rings.back().band_10_100 < 1e-6);
  CHECK(d.rings.back().band_100_1000 < 1e-6);
  CHECK(d.rings.back().states == d.states_full);
  CHECK(d.ring_layers_all > 0);
}

TEST_CASE("The paper's sheet at its well-damped parameters is local: most of the energy lies within two layers") {
  const Dominance d = dominance(Specimen::sheet(kPaperNodes, {}), 2);
  CHECK(d.layers[2].within > 0.5);
  CHECK(d.states_dominant < 20);
}
