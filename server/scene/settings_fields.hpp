// Helpers shared by the readers of settings: fields of a scene by their path, each checked against its range.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/scene/materials.hpp"
#include "server/scene/scene_text.hpp"
#include "server/scene/settings.hpp"

namespace palpate {

inline constexpr double kMinSizeM = 1e-3, kMaxSizeM = 5;

inline std::string at(const std::string& path, std::size_t i) { return path + "[" + std::to_string(i) + "]"; }

/// Returns a number for which the schema has no default.
inline double required(const SceneText& text, const std::string& path, const flatbuffers::Optional<double>& value, double low,
                       double high, const char* unit) {
  if (!value) text.refuse(path, *unit ? "a number of " + std::string(unit) : "a number");
  text.in_range(path, *value, low, high, unit);
  return *value;
}

inline Vec3 vector(const SceneText& text, const std::string& path, const std::vector<double>& values, double low, double high,
                   const char* unit, std::optional<Vec3> fallback = std::nullopt) {
  if (!text.has(path) && fallback) return *fallback;
  if (values.size() != 3) text.refuse(path, "a list of 3 numbers [x, y, z]");
  for (std::size_t i = 0; i < 3; ++i) text.in_range(at(path, i), values[i], low, high, unit);
  return Vec3(values[0], values[1], values[2]);
}

/// Returns the places of a list at `path`.
inline std::vector<Vec3> places(const SceneText& text, const std::string& path,
                                const std::vector<std::unique_ptr<schema::PlaceT>>& in) {
  std::vector<Vec3> out;
  for (std::size_t i = 0; i < in.size(); ++i)
    out.push_back(vector(text, at(path, i) + ".at_m", in[i]->at_m, -kMaxCoordinateM, kMaxCoordinateM, "m"));
  return out;
}

/// Returns the index of `value` in `names`, or throws an error that lists them.
template <std::size_t n>
std::size_t choice(const SceneText& text, const std::string& path, const std::string& value,
                   const std::array<const char*, n>& names, std::size_t fallback) {
  if (!text.has(path)) return fallback;
  std::string all;
  for (std::size_t i = 0; i < n; ++i) {
    if (value == names[i]) return i;
    all += std::string(i == 0 ? "" : i + 1 == n ? " or " : ", ") + "\"" + names[i] + "\"";
  }
  text.refuse(path, all);
}

/// Defined in settings_mesh.cpp.
SolidSettings read_solid(const SceneText& text, const std::string& path, const schema::SolidT& in);
/// Fields of a solid as given at one place of a scene.
struct SolidFields {
  const std::string& material;
  const flatbuffers::Optional<double>&young_pa, &poisson, &damping_s;
  bool empty() const { return material.empty() && !young_pa && !poisson && !damping_s; }
};
/// Reads a part with its own stiffness; `path` is that of the part. Fields that it omits, the law and the Prony series are those
/// of `whole`.
SolidMaterial read_part(const SceneText& text, const std::string& path, const SolidMaterial& whole,
                        const std::vector<PronyBranch>& relaxation, const SolidFields& fields);
/// Returns the material that `path` names. Refuses an unknown name.
const NamedMaterial& named_material(const SceneText& text, const std::string& path, const std::string& name);
/// Returns the density at `path` if given, else that of the material, else the default.
double read_density(const SceneText& text, const std::string& path, double usual_or_given, const std::string& material);
/// Defined in tools.cpp. Reads the spheres of a tool's body at `path`, those of a capsule evenly spread over its axis; lengths
/// are rounded to kToolStepM, the swing of jaws to kSwingStepRad. Refuses a body without spheres, or with more than
/// kMaxToolSpheres.
ToolShape read_tool_body(const SceneText& text, const std::string& path, const schema::ToolBodyT& in);
/// Returns true for 1 to 64 bytes that may go into logs and onto screens.
bool is_name(const std::string& name);
/// Reads "#rrggbb" at `path`.
std::uint32_t read_colour(const SceneText& text, const std::string& path, const std::string& given, std::uint32_t usual);
/// Reads a surface at `path`.
MeshSettings read_mesh_file(const SceneText& text, const std::string& path, const schema::MeshFileT& in);
/// Defined in settings_tissue.cpp, as the four after it.
std::vector<TissueLayer> read_tissue(const SceneText& text, const schema::BodyT& in);
std::vector<LigamentSettings> read_ligaments(const SceneText& text, const schema::BodyT& body, bool planar);
void read_cuts(const SceneText& text, const schema::BodyT& body, SceneSettings& out);
/// Requires the cuts and the tissue in `out`.
void read_tears(const SceneText& text, const schema::BodyT& body, SceneSettings& out);
void read_clips(const SceneText& text, const schema::BodyT& body, SceneSettings& out);
/// Requires the tool and the cuts in `out`.
void read_sutures(const SceneText& text, SceneSettings& out);
/// Defined in parts.cpp.
std::vector<PartSettings> read_parts(const SceneText& text, const SceneSettings& scene);
MeshBodySettings read_mesh_body(const SceneText& text, const schema::BodyT& body);
FixedSettings read_fixing(const SceneText& text, const std::string& path, const std::vector<std::string>& faces,
                          const flatbuffers::Optional<double>& below, const flatbuffers::Optional<double>& above, bool planar);

}  // namespace palpate
