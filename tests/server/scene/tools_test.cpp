// Tools by name, and bodies of their own.
#include <catch2/catch.hpp>

#include "common/base/error.hpp"
#include "server/scene/tools.hpp"
#include "tests/server/scene/scene_files.hpp"

using namespace palpate;
using namespace palpate::test;
using Catch::Matchers::Contains;

namespace {

Scene with_tool(const std::string& tool) {
  return read_scene(
      R"({"body": {"lattice": {"nodes": [3, 3, 3], "size_m": [0.02, 0.02, 0.02], "fixed_faces": ["z-"], "solid": {"material": "liver"}}}, "tool": )" +
          tool + "}",
      "block.json");
}

std::string refusal(const std::string& tool) {
  try {
    with_tool(tool);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("Every named tool has a few spheres of a size that both ends share, the lowest of them at the tool point") {
  const std::vector<NamedTool>& all = named_tools();
  CHECK(all.size() == 6);
  for (const NamedTool& tool : all) {
    CAPTURE(tool.name);
    CHECK(tool.what.size() > 10);
    CHECK(tool.shape.size() <= kMaxToolSpheres);
    double lowest = 1;
    for (const ToolSphere& sphere : tool.shape) {
      lowest = std::min(lowest, sphere.centre.z() - sphere.radius_m);
      CHECK(sphere.centre == (sphere.centre / kToolStepM).array().round().matrix() * kToolStepM);
      CHECK(sphere.radius_m == std::round(sphere.radius_m / kToolStepM) * kToolStepM);
    }
    CHECK(std::abs(lowest) < 2 * kToolStepM);
    CHECK(with_tool("{\"named\": \"" + tool.name + "\"}").tool.shape == tool.shape);
    CHECK_THAT(list_of_tools(), Contains(tool.name) && Contains(tool.what));
  }
}

TEST_CASE("A capsule is spheres in a row, one for each two radii of its length and one, or as many as it says") {
  const ToolShape row =
      with_tool(R"({"body": {"capsules": [{"from_m": [0, 0, 0], "to_m": [0.03, 0, 0], "radius_m": 0.005}]}})").tool.shape;
  REQUIRE(row.size() == 4);
  for (std::size_t k = 0; k < 4; ++k) CHECK((row[k].centre - Vec3(0.01 * static_cast<double>(k), 0, 0)).norm() < kToolStepM);
  CHECK(with_tool(R"({"body": {"capsules": [{"from_m": [0, 0, 0], "to_m": [0.03, 0, 0], "radius_m": 0.005, "spheres": 7}]}})")
            .tool.shape.size() == 7);
  CHECK(with_tool(R"({"mu": 0.1})").tool.shape.empty());
}

TEST_CASE("Spheres and capsules of a jaw turn about the hinge by half the angle, and come back from the scene's own text") {
  const std::string body = R"({"body": {"jaws": {"hinge_z_m": 0.03, "open_deg": 50},
      "spheres": [{"center_m": [0.004, 0, 0.004], "radius_m": 0.003, "jaw": 1}, {"center_m": [0, 0, 0.04], "radius_m": 0.003}],
      "capsules": [{"from_m": [-0.004, 0, 0.004], "to_m": [-0.004, 0, 0.016], "radius_m": 0.003, "spheres": 2, "jaw": -1}]}})";
  const ToolShape shape = with_tool(body).tool.shape;
  REQUIRE(shape.size() == 4);
  CHECK(shape[0].swing_rad == Approx(25 * M_PI / 180).margin(kSwingStepRad));
  CHECK_FALSE(shape[1].on_jaw());
  for (const std::size_t k : {2u, 3u}) CHECK(shape[k].swing_rad == -shape[0].swing_rad);
  CHECK(shape[0].hinge_m == Approx(0.03).margin(kToolStepM));
  const std::string text =
      R"({"body": {"lattice": {"nodes": [3, 3, 3], "size_m": [0.02, 0.02, 0.02], "fixed_faces": ["z-"], "solid": {"material": "liver"}}}, "tool": )" +
      body + "}";
  const Folder folder;
  const std::filesystem::path file = folder.write("jaws.json", text);
  CHECK(load_scene(folder.write("again.json", print_scene(file))).tool.shape == shape);
}

TEST_CASE("Jaws that cannot be are refused") {
  CHECK_THAT(refusal(R"({"body": {"spheres": [{"center_m": [0, 0, 0], "radius_m": 0.01, "jaw": 1}]}})"), Contains("has no jaws"));
  CHECK_THAT(
      refusal(
          R"({"body": {"jaws": {"hinge_z_m": 0.03, "open_deg": 50}, "spheres": [{"center_m": [0, 0, 0], "radius_m": 0.01}]}})"),
      Contains("no sphere is on jaw 1"));
  CHECK_THAT(
      refusal(
          R"({"body": {"jaws": {"hinge_z_m": 0.03, "open_deg": 50}, "spheres": [{"center_m": [0, 0, 0], "radius_m": 0.01, "jaw": 1}]}})"),
      Contains("no sphere is on jaw -1"));
  CHECK_THAT(refusal(R"({"body": {"jaws": {"open_deg": 50}, "spheres": [{"center_m": [0, 0, 0], "radius_m": 0.01, "jaw": 1}]}})"),
             Contains("hinge_z_m"));
  CHECK_THAT(
      refusal(
          R"({"body": {"jaws": {"hinge_z_m": 0.03, "open_deg": 150}, "spheres": [{"center_m": [0, 0, 0], "radius_m": 0.01, "jaw": 1}]}})"),
      Contains("1 to 120"));
  CHECK_THAT(
      refusal(
          R"({"body": {"jaws": {"hinge_z_m": 0.03, "open_deg": 50}, "spheres": [{"center_m": [0, 0, 0], "radius_m": 0.01, "jaw": 2}]}})"),
      Contains("-1 to 1"));
}

TEST_CASE("A tool that cannot be is refused with what was expected") {
  CHECK_THAT(refusal(R"({"named": "scalpel"})"), Contains("tool.named") && Contains("shaft"));
  CHECK_THAT(refusal(R"({"body": {}})"), Contains("has no spheres"));
  CHECK_THAT(
      refusal(
          R"({"body": {"spheres": [{"center_m": [0, 0, 0.01], "radius_m": 0.01}, {"center_m": [0, 0, 0.01], "radius_m": 0.01}]}})"),
      Contains("sphere 2") && Contains("twin"));
  CHECK_THAT(refusal(R"({"body": {"capsules": [{"from_m": [0, 0, 0], "to_m": [0.2, 0, 0], "radius_m": 0.001}]}})"),
             Contains("has 9 spheres") && Contains("at most 8"));
  CHECK_THAT(refusal(R"({"body": {"spheres": [{"center_m": [0, 0, 0]}]}})"), Contains("radius_m"));
  CHECK_THAT(refusal(R"({"body": {"spheres": [{"center_m": [0, 0, 0.3], "radius_m": 0.01}]}})"), Contains("0.249"));
  CHECK_THAT(refusal(R"({"body": {"spheres": [{"center_m": [0, 0, 0], "radius_m": 0.01}]}, "named": "ball"})"),
             Contains("both given"));
  CHECK_THAT(refusal(R"({"contact": "attach", "named": "ball"})"), Contains("grasp"));
}

namespace {

std::string needle_refusal(const std::string& tool, const std::string& tissue) {
  try {
    read_scene(
        R"({"body": {"lattice": {"nodes": [3, 3, 3], "size_m": [0.02, 0.02, 0.02], "fixed_faces": ["z-"], "solid": {"material": "liver"}}, "tissue": )" +
            tissue + R"(}, "tool": )" + tool + "}",
        "block.json");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("A needle goes through the tissue of its scene, and is drawn along its shaft") {
  const std::string needle = R"({"needle": {"length_m": 0.07, "diameter_m": 0.001}})";
  CHECK(needle_refusal(needle, R"([{"thickness_m": 0.005, "toughness_j_m2": 1136, "puncture_n": 2}, {"toughness_j_m2": 164}])") ==
        "");
  const ToolShape shape = drawn_shape({.needle = NeedleSpec{0.07, 0.001}});
  REQUIRE(shape.size() == kMaxToolSpheres);
  CHECK(shape.front().centre.norm() == 0);
  CHECK(shape.back().centre.z() == Approx(0.07).margin(kToolStepM));
  CHECK(shape.front().radius_m == Approx(0.0005).margin(kToolStepM));
}

TEST_CASE("A blade is a needle with an edge, and is refused where it cannot cut") {
  const std::string blade = R"({"blade": {"length_m": 0.04, "width_m": 0.02}})", tissue = R"([{"toughness_j_m2": 30}])";
  CHECK(needle_refusal(blade, tissue) == "");
  CHECK_THAT(refusal(blade), Contains("body.tissue"));
  CHECK_THAT(needle_refusal(R"({"blade": {"length_m": 0.04}})", tissue), Contains("tool.blade.width_m"));
  CHECK_THAT(needle_refusal(R"({"blade": {"length_m": 0.04, "width_m": 0.2}})", tissue), Contains("0.1"));
  CHECK_THAT(needle_refusal(R"({"named": "ball", "blade": {"length_m": 0.04, "width_m": 0.02}})", tissue),
             Contains("one of them"));
  CHECK_THAT(needle_refusal(R"({"contact": "attach", "blade": {"length_m": 0.04, "width_m": 0.02}})", tissue), Contains("touch"));
  const ToolShape shape = drawn_shape({.needle = NeedleSpec{0.04, 0.02, true}});
  REQUIRE(shape.size() == kMaxToolSpheres);
  CHECK(shape.front().centre.x() == Approx(-0.01).margin(kToolStepM));
  CHECK(shape.back().centre.z() == Approx(0.04).margin(kToolStepM));
}

TEST_CASE(
    "Scissors are a blade with a stroke, drawn as two blades about a hinge behind it, and come back from the scene's own text") {
  const std::string scissors = R"({"scissors": {"length_m": 0.04, "width_m": 0.02, "stroke_m": 0.03}})",
                    tissue = R"([{"toughness_j_m2": 30}])";
  CHECK(needle_refusal(scissors, tissue) == "");
  CHECK_THAT(refusal(scissors), Contains("the tool is scissors"));
  CHECK_THAT(needle_refusal(R"({"scissors": {"length_m": 0.04, "width_m": 0.02}})", tissue), Contains("tool.scissors.stroke_m"));
  CHECK_THAT(needle_refusal(R"({"blade": {"length_m": 0.04, "width_m": 0.02}, )" + scissors.substr(1), tissue),
             Contains("tool.scissors is given with another edge"));
  const ToolSpec tool{.needle = NeedleSpec{0.04, 0.02, true, 0.03}};
  CHECK(tool.opens());
  const ToolShape shape = drawn_shape(tool);
  REQUIRE(shape.size() == kMaxToolSpheres);
  CHECK(has_jaws(shape));
  CHECK(shape.front().centre.norm() == 0);
  CHECK(shape.front().centre_at(1).x() > 0.005);
  CHECK(shape[3].centre_at(1).x() == Approx(-shape.front().centre_at(1).x()));
  CHECK(shape.front().hinge_m > 0.03);
  const std::string text =
      R"({"body": {"lattice": {"nodes": [3, 3, 3], "size_m": [0.02, 0.02, 0.02], "fixed_faces": ["z-"], "solid": {"material": "liver"}}, "tissue": )" +
      tissue + R"(}, "tool": )" + scissors + "}";
  const Folder folder;
  const std::filesystem::path file = folder.write("scissors.json", text);
  const std::optional<NeedleSpec> again = load_scene(folder.write("again.json", print_scene(file))).tool.needle;
  REQUIRE(again);
  CHECK(again->is_blade);
  CHECK(again->stroke_m == Approx(0.03).margin(kToolStepM));
  CHECK((again->length_m == 0.04 && again->width_m == 0.02));
}

TEST_CASE("A needle that cannot be, or a body that it cannot enter, is refused with what was expected") {
  const std::string needle = R"({"needle": {"length_m": 0.07, "diameter_m": 0.001}})", tissue = R"([{"toughness_j_m2": 164}])";
  CHECK_THAT(refusal(needle), Contains("body.tissue"));
  CHECK_THAT(needle_refusal(R"({"needle": {"length_m": 0.07}})", tissue), Contains("tool.needle.diameter_m"));
  CHECK_THAT(needle_refusal(R"({"needle": {"length_m": 3, "diameter_m": 0.001}})", tissue), Contains("0.3"));
  CHECK_THAT(needle_refusal(R"({"named": "ball", "needle": {"length_m": 0.07, "diameter_m": 0.001}})", tissue),
             Contains("one of them"));
  CHECK_THAT(needle_refusal(R"({"contact": "attach", "needle": {"length_m": 0.07, "diameter_m": 0.001}})", tissue),
             Contains("grasp"));
  CHECK_THAT(needle_refusal(needle, R"([{"toughness_j_m2": 164, "thickness_m": 0.01}])"), Contains("innermost"));
  CHECK_THAT(needle_refusal(needle, R"([{"toughness_j_m2": 164}, {"toughness_j_m2": 164}])"),
             Contains("body.tissue[0].thickness_m"));
  CHECK_THAT(needle_refusal(needle, R"([{"puncture_n": 1}])"), Contains("toughness_j_m2"));
  CHECK_THAT(needle_refusal(needle, R"([{"toughness_j_m2": 164, "friction_n_m": -1}])"), Contains("friction_n_m"));
  const std::string layer = R"({"toughness_j_m2": 164, "thickness_m": 0.001})";
  CHECK_THAT(needle_refusal(needle, "[" + layer + "," + layer + "," + layer + R"(, {"toughness_j_m2": 164}])"),
             Contains("at most 3"));
}

namespace {

std::string tools_refusal(const std::string& tools, const std::string& first = R"({"name": "grasper"})") {
  return refusal(first + R"(, "tools": )" + tools);
}

}  // namespace

TEST_CASE("A scene's further tools have names, parameters and bodies of their own, and come back from its own text") {
  const std::string tools =
      R"([{"name": "probe", "named": "probe", "mu": 0.1, "radius_m": 0.004}, {"name": "point", "contact_stiffness_n_m": 300}])";
  const Scene scene = with_tool(R"({"name": "grasper", "named": "grasper", "radius_m": 0.002}, "tools": )" + tools);
  REQUIRE(scene.tools.size() == 2);
  CHECK(scene.tool.shape == find_tool("grasper")->shape);
  CHECK(scene.tool_of(1).shape == find_tool("probe")->shape);
  CHECK(scene.tool_of(1).friction == 0.1);
  CHECK(scene.tool_of(2).shape.empty());
  CHECK(scene.tool_of(2).contact_stiffness_n_m == 300);
  CHECK(scene.tool_named("") == 0);
  CHECK(scene.tool_named("grasper") == 0);
  CHECK(scene.tool_named("point") == 2);
  CHECK_FALSE(scene.tool_named("needle"));
  CHECK(scene.contact_radii() == std::vector{0.002, 0.004, 0.0});
  const Folder folder;
  const auto file = folder.write(
      "held.json",
      R"({"body": {"lattice": {"nodes": [3, 3, 3], "size_m": [0.02, 0.02, 0.02], "fixed_faces": ["z-"], "solid": {"material": "liver"}}}, "tool": {"name": "grasper", "named": "grasper", "radius_m": 0.002}, "tools": )" +
          tools + "}");
  const Scene again = read_scene(print_scene(file), "again.json");
  CHECK(again.tool.name == "grasper");
  REQUIRE(again.tools.size() == 2);
  for (std::size_t k = 0; k < 2; ++k) {
    CHECK(again.tools[k].name == scene.tools[k].name);
    CHECK(again.tools[k].shape == scene.tools[k].shape);
    CHECK(again.tools[k].friction == scene.tools[k].friction);
    CHECK(again.tools[k].radius_m == scene.tools[k].radius_m);
  }
}

TEST_CASE("Further tools that cannot be are refused with what was expected") {
  CHECK(tools_refusal(R"([{"name": "probe"}])").empty());
  CHECK_THAT(tools_refusal(R"([{"mu": 0.1}])"), Contains("tools[0].name"));
  CHECK_THAT(tools_refusal(R"([{"name": "grasper"}])"), Contains("tools[0].name") && Contains("a name of its own"));
  CHECK_THAT(tools_refusal(R"([{"name": "a"}, {"name": "a"}])"), Contains("tools[1].name"));
  CHECK_THAT(tools_refusal(R"([{"name": "a", "contact": "attach"}])"), Contains("tools[0].contact") && Contains("touch"));
  CHECK_THAT(tools_refusal(R"([{"name": "a"}])", R"({"contact": "attach"})"), Contains("tools") && Contains("touch"));
  CHECK_THAT(tools_refusal(R"([{"name": "a", "needle": {"length_m": 0.07, "diameter_m": 0.001}}])"),
             Contains("tools[0].needle") && Contains("only in tool"));
  CHECK_THAT(tools_refusal(R"([{"name": "a", "holds": ["thread"]}])"), Contains("tools[0].holds"));
  CHECK_THAT(tools_refusal(R"([{"name": "a", "named": "scalpel"}])"), Contains("tools[0].named") && Contains("shaft"));
  CHECK_THAT(tools_refusal(R"([{"name": "a", "mu": 3}])"), Contains("tools[0].mu"));
  std::string eight;
  for (int k = 0; k < 8; ++k) eight += (k ? ", " : "[") + std::string(R"({"name": "tool )") + std::to_string(k) + "\"}";
  CHECK_THAT(tools_refusal(eight + "]"), Contains("at most 7"));
  try {
    tool_number(with_tool(R"({"name": "grasper"}, "tools": [{"name": "probe"}])"), "needle", "--tools");
    FAIL("a tool that is not there");
  } catch (const InputError& error) {
    CHECK_THAT(error.what(), Contains("needle") && Contains("grasper, probe"));
  }
}
