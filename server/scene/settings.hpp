// Settings of a scene file, with every default filled in and every value in range: all that is needed to build a body.
// docs/reference/scenes.md lists the fields; names here are theirs.
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "server/scene/scene.hpp"

namespace palpate {

class SceneText;
struct Json;

/// Default element of a solid's cells.
inline constexpr SolidElement kUsualElement = SolidElement::hexahedron;

/// A membrane on the surface of a solid.
struct CapsuleSettings {
  double young_pa = 0, thickness_m = 0, poisson = 0, damping_s = 0;
};

struct SolidSettings {
  SolidElement element = kUsualElement;
  SolidMaterial material;
  double mass_damping_1_s = 0;
  std::vector<PronyBranch> relaxation = {};  ///< shares of the stress of fast motions; `material` is for slow ones
  std::optional<CapsuleSettings> capsule = {};
};

/// Springs that together resist as an isotropic solid does (cauchy_lattice.hpp), instead of one stiffness for all.
struct SpringsOfSolid {
  double young_pa = 0, damping_s = 0;
};

/// Elements whose midpoint m satisfies above <= m < below on every axis get this stiffness and damping, or this material.
struct LayerSettings {
  Vec3 below_m = Vec3::Constant(std::numeric_limits<double>::infinity());
  Vec3 above_m = Vec3::Constant(-std::numeric_limits<double>::infinity());
  double stiffness_n_m = 0, damping_n_s_m = 0;
  SolidMaterial material = {};
};

/// Nodes that never move.
struct FixedSettings {
  std::vector<std::string> faces;
  std::optional<double> below_z_m, above_z_m;
};

struct EllipsoidSettings {
  Vec3 center_m, radii_m, rotation_deg = Vec3::Zero();
};

struct MeshSettings {
  std::string file;  ///< as in the scene file
  std::filesystem::path path;
  double scale = 1;
  Vec3 rotation_deg = Vec3::Zero(), offset_m = Vec3::Zero();
};

struct ClipSettings {
  std::vector<EllipsoidSettings> ellipsoids;
  double blend_m = 0;
  std::optional<MeshSettings> mesh;
};

struct LatticeSettings {
  bool planar = false;
  std::array<int, 3> nodes{};  ///< all 0 if spacing_m is used
  Vec3 size_m = Vec3::Zero();  ///< a sheet: z is the thickness
  Vec3 origin_m = Vec3::Zero();
  double spacing_m = 0;  ///< 0 if nodes are given
  std::optional<ClipSettings> clip;
  double density_kg_m3 = 1000, stiffness_n_m = 0, damping_n_s_m = 0;
  SpringLaw law = SpringLaw::linear;
  double stiffening = 10;
  std::optional<SolidSettings> solid;              ///< finite elements instead of springs
  std::optional<SpringsOfSolid> springs_of_solid;  ///< replaces stiffness_n_m and damping_n_s_m, and `material` those of a layer
  std::vector<LayerSettings> layers;
  FixedSettings fixed;
  Vec3 gravity_m_s2 = Vec3::Zero();
};

/// Cells with this number in the mesh get this material.
struct RegionSettings {
  int id = 0;
  SolidMaterial material;
};

struct MeshBodySettings {
  MeshSettings mesh;
  double density_kg_m3 = 1000;
  SolidSettings solid;
  std::vector<RegionSettings> regions;
  FixedSettings fixed;
  Vec3 gravity_m_s2 = Vec3::Zero();
};

/// Springs from all nodes within `radius_m` of `from_m` to a fixed point; the stiffness is their total.
struct LigamentSettings {
  Vec3 from_m = Vec3::Zero(), to_m = Vec3::Zero();
  double radius_m = 0, stiffness_n_m = 0, damping_n_s_m = 0;
};

/// A ball of another stiffness (lump.hpp).
struct LumpSettings {
  Vec3 center_m = Vec3::Zero();
  double radius_m = 0, stiffness_ratio = 1;
};

/// A training task as the scene file states it: one of these goals.
struct FindSettings {
  double within_m = 0;
};
struct TraceSettings {
  std::vector<Vec3> line_m;
  double tolerance_m = 0;
};
struct TaskSettings {
  std::string text;
  std::variant<FindSettings, PressTask, TraceSettings> goal;
};

/// A rigid part beside the body (parts.hpp).
struct PartSettings {
  std::string name;
  MeshSettings mesh;
  std::uint32_t colour = 0;  ///< 0xrrggbb
  double friction = 0, stiffness_ratio = 0;
};

/// One of several bodies (members.hpp).
struct MemberSettings {
  std::string name;
  std::uint32_t colour = 0;  ///< 0xrrggbb
  double friction = 0;
  bool touches_itself = false;
  LatticeSettings lattice;
  std::optional<MeshBodySettings> mesh;  ///< replaces the lattice
  std::vector<LigamentSettings> ligaments;
};

/// Springs that hold tissue together (tissue_clips.hpp).
struct TissueClipSettings {
  Vec3 at_m = Vec3::Zero();
  double radius_m = 0, stiffness_n_m = 0, damping_n_s_m = 0;
};

/// A thread through the body (sutures.hpp).
struct SutureSettings {
  std::string name;
  double radius_m = 0;
  std::vector<Vec3> bites_m;
  double slack_m = 0, first_tail_m = 0, tail_m = 0;
  bool first_tied = true, last_tied = false, barbed = false;
  double stiffness_n_m = 0, friction = 0, drag_n = 0;
};

struct SceneSettings {
  std::string name;
  std::vector<MemberSettings> members = {};  ///< replace the lattice, the mesh and the ligaments below
  LatticeSettings lattice;
  std::optional<MeshBodySettings> mesh;  ///< replaces the lattice
  std::vector<LigamentSettings> ligaments;
  bool is_loaded = false;  ///< true: the shape is given as loaded by gravity
  std::vector<TissueLayer> tissue;
  ToolSpec tool;                                ///< tool.node is not set yet
  std::vector<ToolSpec> tools = {};             ///< further ones
  std::optional<std::array<int, 3>> tool_node;  ///< lattice indices
  double step_ms = 10;                          ///< step of the solver
  IntegratorKind integrator = IntegratorKind::automatic;
  std::optional<LumpSettings> lump = {};
  std::vector<CutSettings> cuts = {};
  bool tears = false;  ///< true: the cuts tear on
  std::vector<TissueClipSettings> clips = {};
  std::vector<SutureSettings> sutures = {};
  std::optional<TaskSettings> task = {};
  std::vector<PartSettings> parts = {};
};

/// Checks ranges and fills in defaults. Throws InputError.
SceneSettings read_settings(const SceneText& text);

/// Returns the settings as a scene file that reads back to the same settings.
Json to_json(const SceneSettings& settings);

inline constexpr std::uint32_t kUsualBodyColour = 0xc86464;
inline constexpr double kMaxCoordinateM = 5;  ///< keeps every node well inside kWorldExtentM

inline constexpr std::array<const char*, 6> kFaceNames = {"x-", "x+", "y-", "y+", "z-", "z+"};
inline constexpr std::array<const char*, 3> kSpringLawNames = {"linear", "stiffening", "thigh-skin"};
inline constexpr std::array<const char*, 4> kIntegratorNames = {"automatic", "tr-bdf2", "explicit", "stabilised"};
inline constexpr std::array<const char*, 6> kSolidLawNames = {"corotational",     "neo-hookean", "mooney-rivlin",
                                                              "veronda-westmann", "ogden",       "gent"};
inline constexpr std::array<const char*, 2> kSolidElementNames = {"hexahedron", "tetrahedron"};
inline constexpr std::array<const char*, 2> kGivenShapeNames = {"stress-free", "loaded"};
inline constexpr std::array<const char*, 4> kTiedNames = {"first", "last", "both", "none"};
inline constexpr std::array<const char*, 2> kContactNames = {"attach", "touch"};

}  // namespace palpate
