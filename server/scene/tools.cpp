#include "server/scene/tools.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>

#include "common/base/error.hpp"
#include "server/scene/settings_fields.hpp"
#include "tool_files.hpp"

namespace palpate {
namespace {

constexpr double kMinRadiusM = 2e-4;  // thinner: finer than any surface

Vec3 place(const SceneText& text, const std::string& path, const std::vector<double>& values) {
  return vector(text, path, values, -kMaxToolReachM, kMaxToolReachM, "m");
}

double radius(const SceneText& text, const std::string& path, const flatbuffers::Optional<double>& value) {
  return required(text, path + ".radius_m", value, kMinRadiusM, kMaxToolReachM, "m");
}

ToolSphere sphere(const Vec3& centre, double radius_m) { return {centre.unaryExpr(&in_tool_steps), in_tool_steps(radius_m)}; }

/// The jaws of a tool: their hinge, and by how much each turns.
struct Jaws {
  double hinge_m = 0, swing_rad = 0;
  /// `sphere`, on the jaw that opens to the side of `sign`, if that is not zero.
  ToolSphere on(ToolSphere sphere, int sign) const {
    if (sign == 0) return sphere;
    sphere.hinge_m = hinge_m;
    sphere.swing_rad = sign * swing_rad;
    return sphere;
  }
};

std::optional<Jaws> read_jaws(const SceneText& text, const std::string& path, const schema::ToolBodyT& in) {
  if (!in.jaws) return std::nullopt;
  const std::string here = path + ".jaws";
  const double open_deg = required(text, here + ".open_deg", in.jaws->open_deg, 1, 120, "deg");
  return Jaws{in_tool_steps(required(text, here + ".hinge_z_m", in.jaws->hinge_z_m, -kMaxToolReachM, kMaxToolReachM, "m")),
              std::round(0.5 * open_deg * std::numbers::pi / 180 / kSwingStepRad) * kSwingStepRad};
}

/// Returns the sphere on the jaw that it names.
ToolSphere on_jaw(const SceneText& text, const std::string& path, const std::optional<Jaws>& jaws, int sign,
                  const ToolSphere& sphere) {
  text.in_range(path + ".jaw", sign, -1, 1, "");
  if (sign != 0 && !jaws)
    text.refuse(path + ".jaw", "the body has no jaws", "jaws with hinge_z_m and open_deg beside the spheres");
  return jaws ? jaws->on(sphere, sign) : sphere;
}

NamedTool read_file(const ToolFile& file) {
  const SceneText text("{\"tool\": {\"body\": " + std::string(file.text) + "}}", std::string(file.name));
  const schema::ToolBodyT& body = *text.values().tool->body;
  return {std::string(file.name.substr(0, file.name.rfind('.'))), body.what, read_tool_body(text, "tool.body", body)};
}

std::vector<NamedTool> read_all() {
  std::vector<NamedTool> all;
  for (const ToolFile& file : kToolFiles) all.push_back(read_file(file));
  std::sort(all.begin(), all.end(), [](const NamedTool& a, const NamedTool& b) { return a.name < b.name; });
  return all;
}

}  // namespace

const std::vector<NamedTool>& named_tools() {
  static const std::vector<NamedTool> all = read_all();
  return all;
}

const NamedTool* find_tool(const std::string& name) {
  const auto found =
      std::find_if(named_tools().begin(), named_tools().end(), [&](const NamedTool& tool) { return tool.name == name; });
  return found == named_tools().end() ? nullptr : &*found;
}

ToolShape read_tool_body(const SceneText& text, const std::string& path, const schema::ToolBodyT& in) {
  ToolShape shape;
  const std::optional<Jaws> jaws = read_jaws(text, path, in);
  for (std::size_t i = 0; i < in.spheres.size(); ++i) {
    const std::string here = at(path + ".spheres", i);
    const schema::ToolSphereT& ball = *in.spheres[i];
    shape.push_back(on_jaw(text, here, jaws, ball.jaw,
                           sphere(place(text, here + ".center_m", ball.center_m), radius(text, here, ball.radius_m))));
  }
  for (std::size_t i = 0; i < in.capsules.size(); ++i) {
    const schema::ToolCapsuleT& capsule = *in.capsules[i];
    const std::string here = at(path + ".capsules", i);
    const Vec3 from = place(text, here + ".from_m", capsule.from_m), to = place(text, here + ".to_m", capsule.to_m);
    const double radius_m = radius(text, here, capsule.radius_m);
    const int most = static_cast<int>(kMaxToolSpheres);
    if (capsule.spheres) text.in_range(here + ".spheres", *capsule.spheres, 2, most, "");
    const auto usual = static_cast<int>(std::min(std::ceil((to - from).norm() / (2 * radius_m)), double{most})) + 1;
    const int count = capsule.spheres ? *capsule.spheres : std::max(2, usual);
    for (int k = 0; k < count; ++k)
      shape.push_back(on_jaw(text, here, jaws, capsule.jaw, sphere(from + (to - from) * k / (count - 1), radius_m)));
  }
  if (shape.empty()) text.refuse(path, "the body of the tool has no spheres", "spheres or capsules");
  if (shape.size() > kMaxToolSpheres)
    text.refuse(path, fmt::format("the body of the tool has {} spheres, those of its capsules included", shape.size()),
                fmt::format("at most {}", kMaxToolSpheres));
  for (std::size_t k = 0; k < shape.size(); ++k)
    if (std::ranges::find(std::span(shape).first(k), shape[k]) != std::span(shape).first(k).end())
      text.refuse(path, fmt::format("sphere {} of the body of the tool is another one's twin", k + 1), "each sphere once");
  for (const double side : {1.0, -1.0})
    if (jaws && std::ranges::none_of(shape, [&](const ToolSphere& sphere) { return side * sphere.swing_rad > 0; }))
      text.refuse(path + ".jaws", fmt::format("no sphere is on jaw {:g}", side),
                  "spheres or capsules on both, with a jaw of 1 and -1");
  return shape;
}

namespace {

constexpr double kBladeRadiusM = 7e-4;

/// Scissors: two blades that turn about a hinge behind their stroke, and a shaft.
ToolShape drawn_scissors(double stroke_m) {
  constexpr double kBehindM = 0.003, kSwingRad = 0.3;
  constexpr int kOnBlade = 3;
  const Jaws jaws{in_tool_steps(stroke_m + kBehindM), std::round(kSwingRad / kSwingStepRad) * kSwingStepRad};
  ToolShape shape;
  for (const int side : {1, -1})
    for (int k = 0; k < kOnBlade; ++k)
      shape.push_back(jaws.on(sphere(Vec3(0, 0, k * jaws.hinge_m / (kOnBlade - 1)), kBladeRadiusM), side));
  for (const double along_m : {jaws.hinge_m, jaws.hinge_m + stroke_m})
    shape.push_back(sphere(Vec3(0, 0, std::min(along_m, kMaxToolReachM)), 2 * kBladeRadiusM));
  return shape;
}

}  // namespace

double in_tool_steps(double metres) { return std::round(metres / kToolStepM) * kToolStepM; }

ToolShape drawn_shape(const ToolSpec& tool) {
  if (!tool.needle) return tool.shape;
  const NeedleSpec& needle = *tool.needle;
  if (needle.stroke_m > 0) return drawn_scissors(needle.stroke_m);
  constexpr std::size_t kOnEdge = 4;
  ToolShape shape;
  const double radius_m = needle.is_blade ? kBladeRadiusM : std::max(0.5 * needle.width_m, kMinRadiusM);
  const std::size_t on_edge = needle.is_blade ? kOnEdge : 0, on_shaft = kMaxToolSpheres - on_edge;
  for (std::size_t k = 0; k < on_edge; ++k)
    shape.push_back(sphere(Vec3((static_cast<double>(k) / (kOnEdge - 1) - 0.5) * needle.width_m, 0, 0), radius_m));
  for (std::size_t k = 0; k < on_shaft; ++k) {
    const double along_m = needle.length_m * static_cast<double>(k) / static_cast<double>(on_shaft - 1);
    shape.push_back(sphere(Vec3(0, 0, std::min(along_m, kMaxToolReachM)), radius_m));
  }
  return shape;
}

std::uint8_t tool_number(const Scene& scene, const std::string& name, const std::string& where) {
  if (const auto number = scene.tool_named(name)) return *number;
  std::string names = scene.tool.name;
  for (const ToolSpec& tool : scene.tools) names += (names.empty() ? "" : ", ") + tool.name;
  throw InputError(where, "'" + name + "' is no tool of " + scene.name,
                   names.empty() ? "none: its only tool has no name" : "one of " + names);
}

std::string list_of_tools() {
  std::string list;
  for (const NamedTool& tool : named_tools())
    list += fmt::format("{:<14} {} ({} spheres)\n", tool.name, tool.what, tool.shape.size());
  return list;
}

}  // namespace palpate
