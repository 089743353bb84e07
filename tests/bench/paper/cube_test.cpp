// The solids of sections 6 and 7 against the corresponding scene files, and against their names.
#include "bench/paper/cube.hpp"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

using namespace palpate;

namespace {

const std::string kScenes = std::string(PALPATE_SOURCE_DIR) + "/scenes/";

void check_same(const Scene& made, const Scene& read) {
  CHECK(made.tool.contact == read.tool.contact);
  CHECK(made.tool.node == read.tool.node);
  CHECK(made.body.fixed == read.body.fixed);
  CHECK(made.body.triangles == read.body.triangles);
  REQUIRE(made.body.nodes.size() == read.body.nodes.size());
  for (std::size_t i = 0; i < read.body.nodes.size(); ++i) {
    CHECK((made.body.nodes[i] - read.body.nodes[i]).norm() < 1e-12);
    CHECK(made.body.masses_kg[i] == Approx(read.body.masses_kg[i]));
  }
  REQUIRE(made.body.elements.size() == read.body.elements.size());
  for (std::size_t e = 0; e < read.body.elements.size(); ++e) {
    CHECK(made.body.elements[e].a == read.body.elements[e].a);
    CHECK(made.body.elements[e].stiffness_n_m == Approx(read.body.elements[e].stiffness_n_m));
    CHECK(made.body.elements[e].damping_n_s_m == Approx(read.body.elements[e].damping_n_s_m));
  }
}

Eigen::AlignedBox3d changed_region(const Scene& scene, double base_n_m) {
  Eigen::AlignedBox3d box;
  for (const Element& e : scene.body.elements)
    if (std::abs(e.stiffness_n_m - base_n_m) > 1e-9) {
      box.extend(scene.body.nodes[e.a]);
      box.extend(scene.body.nodes[e.b]);
    }
  return box;
}

}  // namespace

TEST_CASE("The paper's cube is the scene cube6, and the one soft below at ratio 6 the scene softcore6") {
  check_same(paper_cube(ContactKind::attach), load_scene(kScenes + "cube6.json"));
  check_same(flawed_cube(Flaw::soft_below, 6), load_scene(kScenes + "softcore6.json"));
  CHECK(paper_cube(ContactKind::touch).tool.contact == ContactKind::touch);
}

TEST_CASE("A flaw of ratio 1 is none") {
  for (const Flaw flaw : {Flaw::stiff_inside, Flaw::stiff_at_top, Flaw::torn})
    check_same(flawed_cube(flaw, 1), paper_cube(ContactKind::attach));
}

TEST_CASE("A lump is two cells wide, at its place, and a torn layer lies between two layers of nodes") {
  const auto inside = changed_region(flawed_cube(Flaw::stiff_inside, 10), 60);
  CHECK((inside.min() - Vec3(0.02, 0.02, 0.02)).norm() < 1e-9);
  CHECK((inside.max() - Vec3(0.06, 0.06, 0.06)).norm() < 1e-9);
  const auto top = changed_region(flawed_cube(Flaw::stiff_at_top, 10), 60);
  CHECK((top.min() - Vec3(0.02, 0.02, 0.06)).norm() < 1e-9);
  CHECK((top.max() - Vec3(0.06, 0.06, 0.1)).norm() < 1e-9);
  const auto torn = changed_region(flawed_cube(Flaw::torn, 10), 60);
  CHECK((torn.min() - Vec3(0, 0, 0.06)).norm() < 1e-9);
  CHECK((torn.max() - Vec3(0.1, 0.1, 0.08)).norm() < 1e-9);
}
