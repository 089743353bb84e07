#include "server/scene/tools.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "server/scene/settings_fields.hpp"
#include "tool_files.hpp"

namespace palpate {
namespace {

constexpr double kMinRadiusM = 2e-4;  // thinner: finer than any surface

double rounded(double metres) { return std::round(metres / kToolStepM) * kToolStepM; }

Vec3 place(const SceneText& text, const std::string& path, const std::vector<double>& values) {
  return vector(text, path, values, -kMaxToolReachM, kMaxToolReachM, "m");
}

double radius(const SceneText& text, const std::string& path, const flatbuffers::Optional<double>& value) {
  return required(text, path + ".radius_m", value, kMinRadiusM, kMaxToolReachM, "m");
}

ToolSphere sphere(const Vec3& centre, double radius_m) { return {centre.unaryExpr(&rounded), rounded(radius_m)}; }

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
  for (std::size_t i = 0; i < in.spheres.size(); ++i) {
    const std::string here = at(path + ".spheres", i);
    shape.push_back(
        sphere(place(text, here + ".center_m", in.spheres[i]->center_m), radius(text, here, in.spheres[i]->radius_m)));
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
    for (int k = 0; k < count; ++k) shape.push_back(sphere(from + (to - from) * k / (count - 1), radius_m));
  }
  if (shape.empty()) text.refuse(path, "the body of the tool has no spheres", "spheres or capsules");
  if (shape.size() > kMaxToolSpheres)
    text.refuse(path, fmt::format("the body of the tool has {} spheres, those of its capsules included", shape.size()),
                fmt::format("at most {}", kMaxToolSpheres));
  return shape;
}

ToolShape drawn_shape(const ToolSpec& tool) {
  if (!tool.needle) return tool.shape;
  ToolShape shape;
  const double radius_m = std::max(0.5 * tool.needle->diameter_m, kMinRadiusM);
  for (std::size_t k = 0; k < kMaxToolSpheres; ++k) {
    const double along_m = tool.needle->length_m * static_cast<double>(k) / (kMaxToolSpheres - 1);
    shape.push_back(sphere(Vec3(0, 0, std::min(along_m, kMaxToolReachM)), radius_m));
  }
  return shape;
}

std::string list_of_tools() {
  std::string list;
  for (const NamedTool& tool : named_tools())
    list += fmt::format("{:<14} {} ({} spheres)\n", tool.name, tool.what, tool.shape.size());
  return list;
}

}  // namespace palpate
