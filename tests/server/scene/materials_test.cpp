// Materials by name.
#include <catch2/catch.hpp>

#include "common/base/error.hpp"
#include "server/scene/materials.hpp"
#include "tests/server/scene/scene_files.hpp"

using namespace palpate;
using namespace palpate::test;
using Catch::Matchers::Contains;

namespace {

std::string block(const std::string& solid, const std::string& more = "") {
  return R"({"body": {"lattice": {"nodes": [3, 3, 3], "size_m": [0.02, 0.02, 0.02], "fixed_faces": ["z-"], "solid": )" + solid +
         more + "}}}";
}

}  // namespace

TEST_CASE("Every material has a source, a value within its range, and a name of its own") {
  const auto& all = named_materials();
  CHECK(all.size() >= 11);
  for (std::size_t k = 0; k < all.size(); ++k) {
    CAPTURE(all[k].name);
    CHECK(all[k].source.size() > 20);
    CHECK(all[k].young_low_pa < all[k].solid.young_pa);
    CHECK(all[k].solid.young_pa < all[k].young_high_pa);
    CHECK(all[k].density_kg_m3 > 800);
    if (k > 0) CHECK(all[k - 1].name < all[k].name);
    CHECK_THAT(list_of_materials(), Contains(all[k].name) && Contains(all[k].source));
  }
  CHECK(find_material("granite") == nullptr);
}

TEST_CASE("A scene that names a material has its numbers and its density, and what it gives itself has precedence") {
  const NamedMaterial& liver = *find_material("liver");
  const Scene named = read_scene(block(R"({"material": "liver"})"), "named.json");
  REQUIRE(named.body.materials.size() == 1);
  CHECK(named.body.materials[0].young_pa == liver.solid.young_pa);
  CHECK(named.body.materials[0].poisson == liver.solid.poisson);
  double mass_kg = 0;
  for (const double m : named.body.masses_kg) mass_kg += m;
  CHECK(mass_kg == Approx(liver.density_kg_m3 * 8e-6));

  const Scene own = read_scene(block(R"({"material": "liver", "young_pa": 7000, "law": "corotational"})",
                                     R"(, "density_kg_m3": 900, "layers": [{"below_z_m": 0.01, "poisson": 0.3}])"),
                               "own.json");
  REQUIRE(own.body.materials.size() == 2);
  CHECK(own.body.materials[0].young_pa == 7000);
  CHECK(own.body.materials[0].law == SolidLaw::corotational);
  CHECK(own.body.materials[1].young_pa == 7000);
  CHECK(own.body.materials[1].poisson == 0.3);
  CHECK(own.body.materials[1].damping_s == liver.solid.damping_s);
  CHECK(own.body.masses_kg[13] == Approx(900 * 1e-6));

  const Scene layered =
      read_scene(block(R"({"material": "liver"})", R"(, "layers": [{"below_z_m": 0.01, "material": "fat"}])"), "fat.json");
  CHECK(layered.body.materials[1].young_pa == find_material("fat")->solid.young_pa);
}

TEST_CASE("A material that nobody knows, and one of another law than the body, are refused with what there is") {
  const Folder folder;
  CHECK_THAT(error_of(folder, block(R"({"material": "livver"})")),
             Contains("\"livver\"") && Contains("brain") && Contains("liver"));
  CHECK_THAT(error_of(folder, block(R"({"young_pa": 5000, "law": "corotational"})",
                                    R"(, "layers": [{"below_z_m": 0.01, "material": "fat"}])")),
             Contains("another law"));
  CHECK_THAT(error_of(folder, block("{}")), Contains("or a material"));
}

TEST_CASE("A part whose material fades otherwise than the body is refused, and one that fades alike is not") {
  const Folder folder;
  const auto layer = [](const std::string& what) { return R"(, "layers": [{"below_z_m": 0.01, )" + what + "}]"; };
  CHECK_THAT(error_of(folder, block(R"({"material": "liver"})", layer(R"("material": "brain")"))),
             Contains("body.lattice.layers[0].material fades otherwise than the body"));
  CHECK_THAT(error_of(folder, block(R"({"material": "brain"})", layer(R"("material": "liver")"))), Contains("or young_pa"));
  CHECK_THAT(error_of(folder, block(R"({"material": "brain", "relaxation": []})", layer(R"("material": "brain")"))),
             Contains("fades otherwise"));
  const Scene alike = read_scene(block(R"({"material": "brain"})", layer(R"("material": "brain", "young_pa": 3000)")), "x.json");
  CHECK(alike.body.materials[1].young_pa == Approx(alike.body.materials[0].young_pa * 3000 / 1650));
  CHECK_NOTHROW(read_scene(block(R"({"material": "brain"})", layer(R"("young_pa": 3000)")), "x.json"));
}

TEST_CASE("A layer that takes no part of the body is refused with where the body is") {
  const Folder folder;
  for (const char* bounds : {R"("above_z_m": 1)", R"("above_z_m": 0.02, "below_z_m": 0.01)", R"("below_x_m": -0.5)"}) {
    CAPTURE(bounds);
    const std::string layer = std::string(R"(, "layers": [{)") + bounds + R"(, "young_pa": 3000}])";
    CHECK_THAT(error_of(folder, block(R"({"young_pa": 5000})", layer)),
               Contains("body.lattice.layers[0] takes no part of the body; expected bounds that overlap it: x "));
  }
}

TEST_CASE("A material file says what is wrong with it, and where") {
  const std::string good =
      R"({"name": "jelly", "what": "Jelly", "law": "neo-hookean", "young_pa": 500, "young_range_pa": [300, 900],
    "poisson": 0.49, "damping_s": 0.01, "density_kg_m3": 1000, "source": "a kitchen"})";
  CHECK(read_material(good, "jelly.json").solid.young_pa == 500);
  const auto error = [&](const std::string& from, const std::string& to) {
    try {
      read_material(replaced(good, from, to), "jelly.json");
    } catch (const InputError& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  CHECK_THAT(error("500", "100"), Contains("outside young_range_pa"));
  CHECK_THAT(error("neo-hookean", "hooke"), Contains("corotational"));
  CHECK_THAT(error("0.49", "0.5"), Contains("jelly.json:2") && Contains("poisson is 0.5"));
  CHECK_THAT(error("\"source\": \"a kitchen\"", "\"sauce\": \"a kitchen\""), Contains("source is missing"));
  CHECK_THAT(error("\"a kitchen\"", "\"a kitchen\", \"taste\": 3"), Contains("taste is not a known field"));
  CHECK_THAT(error("[300, 900]", "[900, 300]"), Contains("falls"));
  const auto fading = [&](const std::string& branches) {
    return error("\"a kitchen\"", "\"a kitchen\", \"relaxation\": " + branches);
  };
  CHECK_THAT(fading("3"), Contains("list of branches"));
  CHECK_THAT(fading(R"([{"share": 0.3}])"), Contains("time_s"));
  CHECK_THAT(fading(R"([{"share": 0.3, "time_s": 0}])"), Contains("relaxation is 0"));
  CHECK_THAT(fading(R"([{"share": 0.9, "time_s": 1}, {"share": 0.1, "time_s": 1}])"), Contains("in all"));
}
