// Rigid parts as triangles: flat faces stay flat, round ones are smooth.
#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include "client/view/solids.hpp"
#include "client/viewer/color.hpp"

using namespace palpate;

TEST_CASE("A part is drawn in its colour, with sharp edges where its faces meet steeply and smooth ones where they do not") {
  PartMesh roof{"roof", 0xff8000, 0, {}};
  for (const Vec3& at :
       {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(1, 1, 0), Vec3(2, 0, -0.1), Vec3(2, 1, -0.1), Vec3(0, 0, -1)})
    roof.mesh.vertices.push_back({at});
  roof.mesh.triangles = {{0, 1, 3}, {0, 3, 2}, {1, 4, 5}, {1, 5, 3}, {0, 6, 1}};  // flat, a bend of 6 degrees, a wall
  SolidMesh mesh;
  append_part(mesh, roof);
  REQUIRE(mesh.size() == 15);
  const Vec3f up(0, 0, 1), bent = Vec3f(0.1F, 0, 1).normalized(), wall(0, -1, 0);
  for (const SolidVertex& v : mesh) {
    CHECK(v.normal.norm() == Approx(1));
    CHECK((v.color - to_linear({1, 128 / 255.0F, 0})).norm() < 1e-6F);
    if (v.position.x() == 0 && v.position.z() == 0 && v.normal.z() > 0.5F) CHECK((v.normal - up).norm() < 1e-6F);
    if (v.position.x() == 1 && v.normal.z() > 0.5F) CHECK((v.normal.dot(up) < 0.9999F && v.normal.dot(bent) < 0.9999F));
    if (v.position.z() < -0.5F) CHECK((v.normal - wall).norm() < 1e-6F);
  }
}
