// Readers of OBJ and STL files, against known surfaces.
#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>
#include <random>

#include "common/base/error.hpp"
#include "scene_files.hpp"
#include "server/scene/surface.hpp"

namespace palpate {
namespace {

double area_of(const std::vector<Triangle>& triangles, const std::vector<Vec3>& x) {
  double area = 0;
  for (const auto& [a, b, c] : triangles) area += 0.5 * (x[b] - x[a]).cross(x[c] - x[a]).norm();
  return area;
}

TEST_CASE("a polygon of any shape is cut into its area, all of its edges kept", "[scene][surface]") {
  std::mt19937 random(4);
  const Mat3 turn = Eigen::Quaterniond(0.3, -0.7, 0.2, 0.6).normalized().toRotationMatrix();
  for (const int corners : {4, 5, 7, 40, 1000}) {
    // A star: the radius is drawn at each corner, so that about half of them point inwards.
    std::vector<Vec3> x;
    double area = 0;
    for (int k = 0; k < corners; ++k) {
      const double radius = 1 + 0.9 * (static_cast<double>(random()) / 4294967296.0 - 0.5), angle = 2 * M_PI * k / corners;
      x.push_back(radius * Vec3(std::cos(angle), std::sin(angle), 0));
    }
    for (std::size_t k = 0; k < x.size(); ++k) area += 0.5 * x[k].cross(x[(k + 1) % x.size()]).z();
    for (Vec3& p : x) p = turn * p + Vec3(1, 2, 3);
    std::vector<std::uint32_t> polygon(x.size());
    std::iota(polygon.begin(), polygon.end(), 0u);
    std::vector<Triangle> triangles;
    cut_polygon(polygon, x, triangles);
    CAPTURE(corners);
    CHECK(triangles.size() == x.size() - 2);
    CHECK(area_of(triangles, x) == Approx(area));
    const EdgeReport edges = check_edges(triangles);
    CHECK(edges.open == x.size());
    CHECK(edges.crowded + edges.flipped + edges.shared == 0);
  }
}

TEST_CASE("corners on a line, in one place or of a polygon that crosses itself make triangles all the same", "[scene][surface]") {
  const std::vector<Vec3> x{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}, {0, 1, 0}};
  for (const std::vector<std::uint32_t>& polygon :
       {std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5}, {0, 1, 2, 1}, {0, 0, 0, 0, 0}, {0, 3, 2, 5, 1, 4}}) {
    std::vector<Triangle> triangles;
    cut_polygon(polygon, x, triangles);
    CHECK(triangles.size() == polygon.size() - 2);
  }
  std::vector<Triangle> triangles;
  cut_polygon(std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5}, x, triangles);
  CHECK(area_of(triangles, x) == Approx(2));
}

TEST_CASE("an OBJ file counts its vertices from the first or from the last, and may break its lines", "[scene][surface]") {
  const std::string text =
      "# a square\r\nmtllib /etc/passwd\nv 0 0 0 1\r\nv +1 0 0\nv 1 1e0 0 0.5 0.5 0.5\nv 0 1 0\nvt 0 0\nvn 0 0 1\ng a b\nf 1/1/1 "
      "2//1 \\\n 3/1 "
      "4\nf -4 -3 -2\n\nl 1 2\np 1\n";
  const TriangleMesh mesh = read_obj(text, "a.obj");
  REQUIRE(mesh.vertices.size() == 4);
  CHECK(mesh.vertices[2] == Vec3(1, 1, 0));
  REQUIRE(mesh.triangles.size() == 3);
  CHECK(area_of({mesh.triangles[0], mesh.triangles[1]}, mesh.vertices) == Approx(1));
  CHECK(mesh.triangles[2] == Triangle{0, 1, 2});
  const TriangleMesh before = read_obj("f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\n", "a");
  REQUIRE(before.triangles.size() == 2);
  CHECK(before.triangles[0] == before.triangles[1]);
}

TEST_CASE("lines of a surface may end with CR alone, and are counted", "[scene][surface]") {
  const TriangleMesh mesh = read_obj("# a triangle\rv 0 0 0\rv 1 0 0 # beside\rv 0 1 0\rf 1 2 \\\r3\r", "a");
  REQUIRE(mesh.triangles.size() == 1);
  CHECK(mesh.vertices[2] == Vec3(0, 1, 0));
  CHECK_THROWS_WITH(read_obj("# a triangle\rv 0 0 0\r\rv 0 0 x\r", "a"), Catch::StartsWith("a:4: \"x\""));
  const std::string stl =
      "solid a\rfacet normal 0 0 1\router loop\rvertex 0 0 0\rvertex 1 0 0\rvertex 0 1 0\rendloop\rendfacet\rendsolid\r";
  CHECK(read_stl(stl, "a").triangles.size() == 1);
}

TEST_CASE("what an OBJ or STL file says wrongly is answered with its line", "[scene][surface]") {
  const auto says = [](const std::string& text, const char* words) {
    CAPTURE(text);
    CHECK_THROWS_WITH(text.starts_with("solid") ? read_stl(text, "a") : read_obj(text, "a"), Catch::StartsWith(words));
  };
  says("v 0 0", "a:1: the line ends too early; expected a vertex of three numbers");
  says("v 0 0 x", "a:1: \"x\"; expected a number");
  says("v 0 0 0\nf 1 2 3", "a:2: a face names vertex 3 of 1; expected one that the file has");
  says("v 0 0 0\nf 1 1 0", "a:2: a face names vertex 0 of 1");
  says("v 0 0 0\nf 1 1 -2", "a:2: a face names vertex -2 of 1");
  says("v 0 0 0\nf 1 1", "a:2: a face of 2 corners; expected 3 or more");
  says("v 0 0 0\nf 1 1 99999999999999999999", "a:2: \"99999999999999999999\"; expected the number of a vertex");
  says("v 0 0 nan", "a:1: \"nan\"; expected a number");
  says("v 0 0 1e400", "a:1: \"1e400\"; expected a number");
  says("solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nendloop", "a:5: a facet of 1 corners; expected 3");
  says("solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0", "a:4: ends too early");
  says("solid a\nsphere\n", "a:2: \"sphere\"; expected facet, vertex or endsolid");
  CHECK(read_obj("v 0 0 1e-400", "a").vertices[0] == Vec3::Zero());
}

TEST_CASE("comments behind the numbers of an OBJ face, and STL texts with blanks, marks or capitals, are read",
          "[scene][surface]") {
  CHECK(read_obj("v 0 0 0 # origin\nv 1 0 0\nv 0 1 0\nf 1 2 3 # a side\nf 3 2 1 #\n", "a").triangles.size() == 2);
  const std::string text =
      "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n";
  std::string upper = text;
  std::transform(upper.begin(), upper.end(), upper.begin(), [](char c) { return static_cast<char>(std::toupper(c)); });
  for (const std::string& written : {text, " \t\n" + text, "\xEF\xBB\xBF" + text, "\xEF\xBB\xBF " + upper, upper}) {
    CAPTURE(written);
    const TriangleMesh mesh = read_stl(written, "a");
    REQUIRE(mesh.triangles.size() == 1);
    CHECK(mesh.vertices[1] == Vec3(1, 0, 0));
  }
}

TEST_CASE("A binary STL that begins with \"solid\" is read whatever follows its triangles", "[scene][surface]") {
  std::string bytes = "solid made by a scanner";
  bytes.resize(80, ' ');
  const std::uint32_t count = 1;
  bytes.append(reinterpret_cast<const char*>(&count), sizeof count);
  for (const float x : {0.0F, 0.0F, 1.0F, 0.0F, 0.0F, 0.0F, 1.0F, 0.0F, 0.0F, 0.0F, 1.0F, 0.0F})
    bytes.append(reinterpret_cast<const char*>(&x), sizeof x);
  bytes.append(2, '\0');
  for (const std::size_t more : {0, 50}) {
    const TriangleMesh mesh = read_stl(bytes + std::string(more, 'x'), "a");
    REQUIRE(mesh.triangles.size() == 1);
    CHECK(mesh.vertices[1] == Vec3(1, 0, 0));
  }
}

}  // namespace
}  // namespace palpate
