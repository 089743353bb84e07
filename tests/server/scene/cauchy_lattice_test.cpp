// Springs that resist as a solid does: their energy in homogeneous strain against that of the continuum.
#include <catch2/catch.hpp>
#include <string>

#include "server/scene/cauchy_lattice.hpp"
#include "tests/server/scene/scene_files.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr double kYoungPa = 8000;

/// Energy at small strains: each spring is stretched by L n.e.n.
double energy_of(const LumpedBody& body, const Mat3& strain) {
  double energy = 0;
  for (const Element& e : body.elements) {
    const Vec3 n = (body.nodes[e.b] - body.nodes[e.a]).normalized();
    const double stretch = e.rest_length_m * n.dot(strain * n);
    energy += 0.5 * e.stiffness_n_m * stretch * stretch;
  }
  return energy;
}

/// lambda/2 (tr e)^2 + mu e:e, times the volume; for a sheet under plane stress.
double energy_of_continuum(const Mat3& strain, double volume_m3, bool planar) {
  const double nu = planar ? kCauchyPoissonOfSheet : kCauchyPoisson, mu = kYoungPa / (2 * (1 + nu));
  const double lambda = planar ? kYoungPa * nu / (1 - nu * nu) : kYoungPa * nu / ((1 + nu) * (1 - 2 * nu));
  return volume_m3 * (0.5 * lambda * strain.trace() * strain.trace() + mu * strain.squaredNorm());
}

std::string lattice(const std::string& nodes, const std::string& size, const std::string& more = "\"young_pa\": 8000") {
  return R"({"body": {"lattice": {"nodes": )" + nodes + R"(, "size_m": )" + size + ", " + more + "}}}";
}

std::vector<Mat3> strains(bool planar) {
  std::vector<Mat3> all;
  for (int i = 0; i < (planar ? 2 : 3); ++i)
    for (int j = 0; j <= i; ++j) {
      Mat3 e = Mat3::Zero();
      e(i, j) = e(j, i) = 1e-3;
      all.push_back(e);
      e(0, 0) += 5e-4;
      all.push_back(e);
    }
  return all;
}

}  // namespace

TEST_CASE(
    "A block of springs of young_pa has the continuum's energy in every strain, whatever its cells' proportions and number") {
  const auto [nodes, size] = GENERATE(table<std::string, std::string>({{"[2, 2, 2]", "[0.03, 0.03, 0.03]"},
                                                                       {"[5, 4, 3]", "[0.04, 0.03, 0.02]"},
                                                                       {"[3, 3, 3]", "[0.02, 0.026, 0.03]"},
                                                                       {"[3, 4, 5]", "[0.03, 0.03, 0.04]"}}));
  const Scene scene = read_scene(lattice(nodes, size, R"("young_pa": 8000, "fixed_faces": ["z-"])"), "block.json");
  Vec3 low = scene.body.nodes.front(), high = scene.body.nodes.back();
  for (const Element& e : scene.body.elements) CHECK(e.stiffness_n_m > 0);
  for (const Mat3& e : strains(false))
    CHECK(energy_of(scene.body, e) == Approx(energy_of_continuum(e, (high - low).prod(), false)).epsilon(1e-9));
}

TEST_CASE("A sheet of springs of young_pa has the energy of plane stress in every strain") {
  const Scene scene =
      read_scene(lattice("[4, 5]", "[0.03, 0.05, 0.002]", R"("young_pa": 8000, "fixed_faces": ["y-"])"), "sheet.json");
  for (const Mat3& e : strains(true))
    CHECK(energy_of(scene.body, e) == Approx(energy_of_continuum(e, 0.03 * 0.05 * 0.002, true)).epsilon(1e-9));
}

TEST_CASE("Masses of springs of young_pa are those of the cells around a node") {
  const Scene scene =
      read_scene(lattice("[3, 3, 3]", "[0.02, 0.02, 0.02]", R"("young_pa": 8000, "density_kg_m3": 1200, "fixed_faces": ["z-"])"),
                 "block.json");
  double sum = 0;
  for (const double m : scene.body.masses_kg) sum += m;
  CHECK(sum == Approx(1200 * 8e-6));
  CHECK(scene.body.masses_kg[13] == Approx(1200 * 1e-6));     // the middle one
  CHECK(scene.body.masses_kg[0] == Approx(1200 * 1e-6 / 8));  // a corner
}

TEST_CASE("A layer of springs takes the cells in it, and a spring between two layers half of each") {
  const Scene scene = read_scene(lattice("[2, 2, 3]", "[0.01, 0.01, 0.02]",
                                         R"("young_pa": 8000, "damping_s": 0.02, "fixed_faces": ["z-"],
                                            "layers": [{"below_z_m": 0.01, "young_pa": 2000, "damping_s": 0.01}])"),
                                 "layers.json");
  const double own = 2.0 / 5 * 0.01;  // mu h for 1 Pa
  int seen = 0;
  for (const Element& e : scene.body.elements) {
    const Vec3 &a = scene.body.nodes[e.a], &b = scene.body.nodes[e.b];
    if (a.z() != b.z() || (b - a).norm() > 0.0101) continue;  // horizontal edges
    const double below = a.z() < 0.015 ? 2000 : 0, above = a.z() > 0.005 ? 8000 : 0;
    CHECK(e.stiffness_n_m == Approx(own * (below + above) / 4));
    CHECK(e.damping_n_s_m == Approx(own * (0.01 * below + 0.02 * above) / 4));
    ++seen;
  }
  CHECK(seen == 12);
}

TEST_CASE("What cannot be had of springs is refused with what can") {
  using Catch::Matchers::Contains;
  const Folder folder;
  CHECK_THAT(error_of(folder, lattice("[3, 3, 3]", "[0.04, 0.02, 0.02]")),
             Contains("cells are 20 mm x 10 mm x 10 mm") && Contains("solid"));
  CHECK_THAT(error_of(folder, lattice("[3, 3, 3]", "[0.02, 0.02, 0.02]", R"("young_pa": 8000, "stiffness_n_m": 30)")),
             Contains("stiffness_n_m is given with young_pa"));
  CHECK_THAT(error_of(folder, lattice("[3, 3, 3]", "[0.02, 0.02, 0.02]", R"("density_kg_m3": 900)")),
             Contains("N/m, or young_pa, or a material"));
  CHECK_THAT(error_of(folder, lattice("[3, 3, 3]", "[0.02, 0.02, 0.02]",
                                      R"("young_pa": 8000, "layers": [{"below_z_m": 0.01, "poisson": 0.4}])")),
             Contains("springs have 1/4"));
}

TEST_CASE("A lattice of young_pa is printed with it and reads back to the same springs") {
  const Folder folder;
  const auto file = folder.write("block.json", lattice("[3, 3, 3]", "[0.02, 0.02, 0.02]",
                                                       R"("material": "liver", "fixed_faces": ["z-"],
                                                          "layers": [{"below_z_m": 0.01, "material": "fat"}])"));
  const Scene first = load_scene(file), second = read_scene(print_scene(file), "printed.json");
  REQUIRE(first.body.elements.size() == second.body.elements.size());
  for (std::size_t k = 0; k < first.body.elements.size(); ++k)
    CHECK(first.body.elements[k].stiffness_n_m == second.body.elements[k].stiffness_n_m);
  CHECK(first.body.masses_kg == second.body.masses_kg);
}
