// Frames, and scenes of received surfaces.
#include "client/igtl/igtl_scene.hpp"

#include <catch2/catch.hpp>
#include <cstring>
#include <nlohmann/json.hpp>

#include "common/base/error.hpp"
#include "tests/client/igtl/ball.hpp"

using namespace palpate;
using nlohmann::json;

TEST_CASE("The patient's direction that is up lies along the scene's z, and the frame stays right-handed", "[igtl]") {
  const auto [name, ras] = GENERATE(table<std::string, Vec3>({{"superior", Vec3(0, 0, 1)},
                                                              {"inferior", Vec3(0, 0, -1)},
                                                              {"anterior", Vec3(0, 1, 0)},
                                                              {"posterior", Vec3(0, -1, 0)},
                                                              {"right", Vec3(1, 0, 0)},
                                                              {"left", Vec3(-1, 0, 0)}}));
  const PatientUp up = patient_up(name);
  CHECK(up.to_ras * Vec3::UnitZ() == ras);
  CHECK(up.to_ras.determinant() == 1);
  CHECK(up.to_ras * up.to_ras.transpose() == Mat3::Identity());
  CHECK_THROWS_WITH(patient_up("up"), Catch::Contains("expected superior"));
}

TEST_CASE("A received surface becomes a scene at its place, held at its lowest part, with the rotation of its messages",
          "[igtl]") {
  const auto [points, triangles] = test::ball(Vec3f(100, -50, 20), 40);
  const IgtlSurface surface{points, triangles};
  ReceivedBody body;
  body.name = "liver";
  body.material = "liver";
  const json plain = json::parse(igtl_scene(surface, body, "liver.stl"));
  const json& lattice = plain["body"]["lattice"];
  CHECK(lattice["spacing_m"] == 0.008);
  CHECK(lattice["clip"]["mesh"] == json{{"file", "liver.stl"}, {"scale", 0.001}});
  CHECK(lattice["solid"]["material"] == "liver");
  CHECK(lattice["fixed_below_z_m"].get<double>() == Approx(-0.020 + 0.15 * 0.080));
  CHECK(plain["tool"] == json{{"contact", "touch"}, {"radius_m", 0.016}});
  body.up = patient_up("anterior");
  body.held_m = 0.010;
  body.radius_m = 0.012;
  const json supine = json::parse(igtl_scene(surface, body, "liver.stl"));
  CHECK(supine["body"]["lattice"]["clip"]["mesh"]["rotation_deg"] == json{90, 0, 0});
  CHECK(supine["body"]["lattice"]["fixed_below_z_m"].get<double>() == Approx(-0.090 + 0.010));  // y is up: -50 - 40 mm
  CHECK(supine["tool"]["radius_m"] == 0.012);
}

TEST_CASE("A spacing or a hold that leaves no body is refused", "[igtl]") {
  const auto [points, triangles] = test::ball(Vec3f::Zero(), 10);
  ReceivedBody body;
  body.spacing_m = 0.011;
  CHECK_THROWS_WITH(igtl_scene({points, triangles}, body, "b.stl"), Catch::Contains("too coarse"));
  body.spacing_m = 0.004;
  body.held_m = 0.021;
  CHECK_THROWS_WITH(igtl_scene({points, triangles}, body, "b.stl"), Catch::Contains("holds the whole surface"));
}

TEST_CASE("A binary STL has a triangle in 50 bytes, in millimetres", "[igtl]") {
  const auto [points, triangles] = test::ball(Vec3f(1, 2, 3), 10);
  const std::string stl = igtl_stl({points, triangles});
  REQUIRE(stl.size() == 84 + 50 * triangles.size());
  float corner[3];
  std::memcpy(corner, stl.data() + 84 + 50 + 12 + 12, sizeof corner);
  const Vec3f& expected = points[triangles[1][1]];
  CHECK(Vec3f(corner[0], corner[1], corner[2]) == expected);
}

TEST_CASE("The messages of a moment are in millimetres and RAS: hands, forces, and the displacement of each point", "[igtl]") {
  const auto [points, triangles] = test::ball(Vec3f::Zero(), 0.04F);
  ViewMoment moment;
  moment.shape.positions = points;
  moment.shape.positions[3] += Vec3f(0, 0.002F, 0);
  ToolView tool;
  tool.station = "or 3";
  tool.position = Vec3(0.01, 0.02, 0.03);
  moment.tools = {tool};
  IgtlReader reader;
  reader.add(igtl_moment(moment, triangles, points, patient_up("anterior"), 1));
  std::vector<std::string> names;
  IgtlSurface surface;
  while (const auto message = reader.next()) {
    names.push_back(message->type + " " + message->name);
    if (message->type == "POLYDATA") surface = read_igtl_surface(message->content);
  }
  CHECK(names == std::vector<std::string>{"TRANSFORM or 3", "SENSOR or 3 force", "POLYDATA body"});
  REQUIRE(surface.triangles.size() == triangles.size());
  const Vec3f place = moment.shape.positions[3];  // up is anterior: W's z is RAS's y, W's y is -z
  bool there = false;
  for (const Vec3f& p : surface.points_mm) there = there || (p - 1000 * Vec3f(place.x(), place.z(), -place.y())).norm() < 1e-3F;
  CHECK(there);
}
