#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "common/base/limits.hpp"
#include "common/base/plain_text.hpp"
#include "server/scene/settings_fields.hpp"
#include "server/scene/task.hpp"
#include "server/scene/tools.hpp"

namespace palpate {

namespace {

constexpr int kMinNodes = 2, kMaxNodes = 200;
constexpr double kMaxLatticeNodes = 1e6;
constexpr double kMaxStiffness = 1e7, kMaxDamping = 1e5;

const std::string kLattice = "body.lattice";

/// Returns the path of a field that may stand in the lattice or in the body around it.
std::string either_place(const SceneText& text, const std::string& field) {
  const std::string inner = kLattice + "." + field, outer = "body." + field;
  if (text.has(inner) && text.has(outer)) text.refuse(inner, inner + " and " + outer + " are both given", "one of them");
  return text.has(outer) ? outer : inner;
}

void read_grid(const SceneText& text, const schema::LatticeT& in, LatticeSettings& out) {
  const std::string nodes = kLattice + ".nodes", size = kLattice + ".size_m", thickness = kLattice + ".thickness_m";
  const auto n = in.nodes.size();
  if (n != 2 && n != 3) text.refuse(nodes, "a list of 3 whole numbers [nx, ny, nz], or [nx, ny] for a sheet");
  out.planar = n == 2 || in.nodes[2] == 1;
  double total = 1;
  for (std::size_t i = 0; i < n; ++i) {
    const bool sheet = i == 2 && out.planar;
    text.in_range(at(nodes, i), in.nodes[i], sheet ? 1 : kMinNodes, sheet ? 1 : kMaxNodes, "");
    out.nodes[i] = in.nodes[i];
    total *= in.nodes[i];
  }
  if (n == 2) out.nodes[2] = 1;
  if (total > kMaxLatticeNodes) text.refuse(nodes, "at most 1000000 nodes in all");

  const auto m = in.size_m.size();
  if (m != 3 && !(out.planar && m == 2))
    text.refuse(size, out.planar ? "a list of 2 numbers [sx, sy]" : "a list of 3 numbers [sx, sy, sz]");
  for (std::size_t i = 0; i < m; ++i) {
    text.in_range(at(size, i), in.size_m[i], i == 2 && out.planar ? 1e-5 : kMinSizeM, kMaxSizeM, "m");
    out.size_m[static_cast<int>(i)] = in.size_m[i];
  }
  if (in.thickness_m) {
    if (!out.planar) text.refuse(thickness, thickness + " is given for a 3-D lattice", "it only with nodes [nx, ny]");
    if (m == 3) text.refuse(thickness, thickness + " and size_m[2] are both given", "one of them");
    text.in_range(thickness, *in.thickness_m, 1e-5, 1, "m");
    out.size_m[2] = *in.thickness_m;
  } else if (m == 2) {
    out.size_m[2] = 0.01;
  }
  if (out.planar && in.origin_m.size() == 2) text.refuse(kLattice + ".origin_m", "a list of 3 numbers [x, y, z]");
  out.origin_m = vector(text, kLattice + ".origin_m", in.origin_m, -kMaxCoordinateM, kMaxCoordinateM, "m", Vec3(0, 0, 0));
}

ClipSettings read_clip(const SceneText& text, const schema::ClipT& in) {
  const std::string path = kLattice + ".clip";
  ClipSettings out;
  if (in.ellipsoids.empty() == (in.mesh == nullptr))
    text.refuse(path, path + " holds " + (in.mesh ? "both" : "neither"), "ellipsoids or a mesh");
  for (std::size_t i = 0; i < in.ellipsoids.size(); ++i) {
    const auto& e = *in.ellipsoids[i];
    const std::string p = at(path + ".ellipsoids", i) + ".";
    out.ellipsoids.push_back({vector(text, p + "center_m", e.center_m, -kMaxCoordinateM, kMaxCoordinateM, "m"),
                              vector(text, p + "radii_m", e.radii_m, kMinSizeM, kMaxSizeM / 2, "m"),
                              vector(text, p + "rotation_deg", e.rotation_deg, -360, 360, "degrees", Vec3(0, 0, 0))});
  }
  text.in_range(path + ".blend_m", in.blend_m, 0, 1, "m");
  out.blend_m = in.blend_m;
  if (!in.mesh) return out;
  if (text.has(path + ".blend_m"))
    text.refuse(path + ".blend_m", path + ".blend_m is given with a mesh", "it only with ellipsoids");
  out.mesh = read_mesh_file(text, path + ".mesh", *in.mesh);
  return out;
}

/// Reads the grid: nodes and size_m, or spacing_m around a clip.
void read_place(const SceneText& text, const schema::LatticeT& in, LatticeSettings& out) {
  if (in.clip) out.clip = read_clip(text, *in.clip);
  if (!in.spacing_m) {
    read_grid(text, in, out);
    if (out.clip && out.planar) text.refuse(kLattice + ".clip", kLattice + ".clip is given for a sheet", "it only in 3-D");
    return;
  }
  const std::string spacing = kLattice + ".spacing_m";
  if (!out.clip) text.refuse(spacing, spacing + " is given without clip", "nodes and size_m for a box, or a clip");
  for (const char* other : {".nodes", ".size_m", ".origin_m", ".thickness_m"}) {
    if (text.has(kLattice + other))
      text.refuse(kLattice + other, kLattice + other + " and spacing_m are both given", "one of them");
  }
  text.in_range(spacing, *in.spacing_m, 2e-4, 1, "m");
  out.spacing_m = *in.spacing_m;
}

LayerSettings read_layer(const SceneText& text, const schema::LayerT& in, const std::string& path, const LatticeSettings& base) {
  LayerSettings out;
  const std::array below{in.below_x_m, in.below_y_m, in.below_z_m}, above{in.above_x_m, in.above_y_m, in.above_z_m};
  const SolidFields solid{in.material, in.young_pa, in.poisson, in.damping_s};
  bool bounded = false;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    const std::string suffix = std::string("_") + "xyz"[i] + "_m";
    if (below[i])
      out.below_m[axis] = required(text, path + ".below" + suffix, below[i], -2 * kMaxCoordinateM, 2 * kMaxCoordinateM, "m");
    if (above[i])
      out.above_m[axis] = required(text, path + ".above" + suffix, above[i], -2 * kMaxCoordinateM, 2 * kMaxCoordinateM, "m");
    bounded = bounded || below[i] || above[i];
  }
  if (!bounded) text.refuse(path, path + " has no bound", "below_z_m or another of below_/above_ x, y, z");
  if (base.solid) {
    if (in.stiffness_n_m || in.damping_n_s_m)
      text.refuse(path, path + " has springs in a solid", "material, young_pa, poisson or damping_s");
    out.material = read_part(text, path, base.solid->material, base.solid->relaxation, solid);
    return out;
  }
  if (base.springs_of_solid) {
    if (in.stiffness_n_m || in.damping_n_s_m)
      text.refuse(path, path + " has springs where the lattice has young_pa", "material, young_pa or damping_s");
    if (in.poisson)
      text.refuse(path + ".poisson", path + ".poisson is given for springs", "it only with solid; springs have 1/4");
    SolidMaterial whole;
    whole.young_pa = base.springs_of_solid->young_pa;
    whole.damping_s = base.springs_of_solid->damping_s;
    out.material = read_part(text, path, whole, {}, solid);
    return out;
  }
  if (!solid.empty()) text.refuse(path, path + " has a solid among springs", "stiffness_n_m or damping_n_s_m");
  if (!in.stiffness_n_m && !in.damping_n_s_m) text.refuse(path, path + " changes nothing", "stiffness_n_m or damping_n_s_m");
  out.stiffness_n_m = base.stiffness_n_m;
  out.damping_n_s_m = base.damping_n_s_m;
  if (in.stiffness_n_m) out.stiffness_n_m = required(text, path + ".stiffness_n_m", in.stiffness_n_m, 1e-3, kMaxStiffness, "N/m");
  if (in.damping_n_s_m) out.damping_n_s_m = required(text, path + ".damping_n_s_m", in.damping_n_s_m, 0, kMaxDamping, "N s/m");
  return out;
}

SpringsOfSolid read_springs_of_solid(const SceneText& text, const schema::LatticeT& in) {
  for (const char* field : {"stiffness_n_m", "damping_n_s_m"})
    if (text.has(kLattice + "." + field))
      text.refuse(kLattice + "." + field, kLattice + "." + field + " is given with young_pa or a material", "one of them");
  const SolidMaterial m = read_part(text, kLattice, {}, {}, {in.material, in.young_pa, {}, in.damping_s});
  return {m.young_pa, m.damping_s};
}

void read_springs(const SceneText& text, const schema::BodyT& body, LatticeSettings& out) {
  const auto& in = *body.lattice;
  if (in.young_pa || !in.material.empty()) {
    out.springs_of_solid = read_springs_of_solid(text, in);
  } else {
    if (in.damping_s)
      text.refuse(kLattice + ".damping_s", kLattice + ".damping_s is given", "it only with young_pa or a material");
    if (!in.stiffness_n_m) text.refuse(kLattice + ".stiffness_n_m", "a number of N/m, or young_pa, or a material");
    out.stiffness_n_m = required(text, kLattice + ".stiffness_n_m", in.stiffness_n_m, 1e-3, kMaxStiffness, "N/m");
    out.damping_n_s_m = required(text, kLattice + ".damping_n_s_m", in.damping_n_s_m, 0, kMaxDamping, "N s/m");
  }
  const std::string law = either_place(text, "spring_law"), stiffening = either_place(text, "stiffening");
  const std::string& law_name = in.spring_law.empty() ? body.spring_law : in.spring_law;
  out.law = static_cast<SpringLaw>(choice(text, law, law_name, kSpringLawNames, 0));
  if (text.has(stiffening)) {
    if (out.law != SpringLaw::stiffening)
      text.refuse(stiffening, stiffening + " is given", "it only with spring_law \"stiffening\"");
    out.stiffening = required(text, stiffening, in.stiffening ? in.stiffening : body.stiffening, 0, 1e4, "");
  }
}

void read_finite_elements(const SceneText& text, const schema::BodyT& body, LatticeSettings& out) {
  const std::string path = kLattice + ".solid";
  if (out.planar) text.refuse(path, path + " is given for a sheet", "it only in 3-D");
  for (const char* field : {"stiffness_n_m", "damping_n_s_m", "material", "young_pa", "damping_s"})
    if (text.has(kLattice + "." + field))
      text.refuse(kLattice + "." + field, kLattice + "." + field + " is given with solid", "it in one of them");
  for (const char* field : {"spring_law", "stiffening"})
    if (const auto place = either_place(text, field); text.has(place))
      text.refuse(place, place + " is given with solid", "springs for it");
  out.solid = read_solid(text, path, *body.lattice->solid);
}

void read_material(const SceneText& text, const schema::BodyT& body, LatticeSettings& out) {
  const auto& in = *body.lattice;
  const std::string gravity = either_place(text, "gravity_m_s2");
  const auto& g = in.gravity_m_s2.empty() ? body.gravity_m_s2 : in.gravity_m_s2;
  out.gravity_m_s2 = vector(text, gravity, g, -100, 100, "m/s^2", Vec3(0, 0, 0));
  in.solid ? read_finite_elements(text, body, out) : read_springs(text, body, out);
  out.density_kg_m3 =
      read_density(text, kLattice + ".density_kg_m3", in.density_kg_m3, in.solid ? in.solid->material : in.material);
  for (std::size_t i = 0; i < in.layers.size(); ++i) {
    out.layers.push_back(read_layer(text, *in.layers[i], at(kLattice + ".layers", i), out));
  }
}

NeedleSpec read_needle(const SceneText& text, const schema::NeedleT& in, const SceneSettings& out) {
  const std::string needle = "tool.needle";
  if (!out.tool.shape.empty()) text.refuse(needle, "tool.needle is given with a body of the tool", "one of them");
  if (out.tool.contact == ContactKind::attach)
    text.refuse(needle, "a grasp has a needle", "a needle only where tool.contact is \"touch\"");
  if (out.tissue.empty()) text.refuse("body.tissue", "the tool is a needle, but there is no body.tissue", "its layers");
  return {required(text, needle + ".length_m", in.length_m, kMinNeedleLengthM, kMaxNeedleLengthM, "m"),
          required(text, needle + ".diameter_m", in.diameter_m, 1e-4, 0.01, "m")};
}

/// Reads what a blade and scissors have, `tool.` + `blade`, a `what`.
template <class Table>
NeedleSpec read_edge(const SceneText& text, const std::string& blade, const std::string& what, const Table& in,
                     const schema::BodyT& body, const SceneSettings& out) {
  const std::optional<SolidSettings>& solid = out.mesh ? out.mesh->solid : out.lattice.solid;
  if (!out.tool.shape.empty() || out.tool.needle)
    text.refuse(blade, blade + " is given with another edge, a needle or a body of the tool", "one of them");
  if (out.tool.contact == ContactKind::attach)
    text.refuse(blade, "a grasp has " + what, what + " only where tool.contact is \"touch\"");
  if (out.tissue.empty()) text.refuse("body.tissue", "the tool is " + what + ", but there is no body.tissue", "its layers");
  if (!solid) text.refuse(blade, "springs are to be cut by " + what, "a solid for it: finite elements");
  if (solid->capsule) text.refuse(blade, "a body with a capsule is to be cut by " + what, "a body without one for it");
  if (!body.cuts.empty()) text.refuse(blade, blade + " is given with body.cuts", "one of them");
  return {required(text, blade + ".length_m", in.length_m, kMinNeedleLengthM, kMaxNeedleLengthM, "m"),
          required(text, blade + ".width_m", in.width_m, 1e-3, 0.1, "m"), true};
}

/// Reads what every tool has, at `path`.
ToolSpec read_any_tool(const SceneText& text, const std::string& path, const schema::ToolT& in, bool on_sheet) {
  ToolSpec out;
  const std::string named = path + ".named", body = path + ".body";
  const auto usual = on_sheet ? ContactKind::attach : ContactKind::touch;
  out.contact =
      static_cast<ContactKind>(choice(text, path + ".contact", in.contact, kContactNames, static_cast<std::size_t>(usual)));
  if (on_sheet && out.contact == ContactKind::touch)
    text.refuse(path + ".contact", "the tool touches a sheet, which has no surface", "\"attach\"");
  text.in_range(path + ".mu", in.mu, 0, 2, "");
  text.in_range(path + ".contact_stiffness_n_m", in.contact_stiffness_n_m, 1, 1e6, "N/m");
  text.in_range(path + ".radius_m", in.radius_m, 0, 0.5, "m");
  if (text.has(path + ".name") && !is_name(in.name))
    text.refuse(path + ".name", std::string("1 to 64 bytes of ") + kNameCharacters);
  out.name = in.name;
  out.friction = in.mu;
  out.contact_stiffness_n_m = in.contact_stiffness_n_m;
  out.radius_m = in.radius_m;
  if (text.has(named) && text.has(body)) text.refuse(named, named + " and " + body + " are both given", "one of them");
  if (text.has(named)) {
    const NamedTool* known = find_tool(in.named);
    std::string names;
    for (const NamedTool& tool : named_tools()) names += (names.empty() ? "\"" : ", \"") + tool.name + "\"";
    if (!known) text.refuse(named, names);
    out.shape = known->shape;
  }
  if (in.body) out.shape = read_tool_body(text, body, *in.body);
  if (!out.shape.empty() && out.contact == ContactKind::attach)
    text.refuse(in.body ? body : named, "a grasp has a tool with a body", "a body only where " + path + ".contact is \"touch\"");
  return out;
}

void read_tool(const SceneText& text, const schema::ToolT& in, const schema::BodyT& body, SceneSettings& out) {
  const std::string node = "tool.node";
  out.tool = read_any_tool(text, "tool", in, out.lattice.planar);
  if (in.needle) out.tool.needle = read_needle(text, *in.needle, out);
  if (in.blade) out.tool.needle = read_edge(text, "tool.blade", "a blade", *in.blade, body, out);
  if (in.scissors) {
    const std::string scissors = "tool.scissors";
    out.tool.needle = read_edge(text, scissors, "scissors", *in.scissors, body, out);
    const double stroke_m = required(text, scissors + ".stroke_m", in.scissors->stroke_m, 0.002, 0.2, "m");
    out.tool.needle->stroke_m = in_tool_steps(stroke_m);
  }
  if (!text.has(node)) return;
  if (out.mesh) text.refuse(node, node + " is given with a mesh", "it only with a lattice of nodes and size_m");
  if (out.lattice.spacing_m > 0) text.refuse(node, node + " is given with spacing_m", "it only with nodes and size_m");
  if (in.node.size() != 3 && !(out.lattice.planar && in.node.size() == 2))
    text.refuse(node, "a list of 3 whole numbers [i, j, k]");
  out.tool_node = std::array{0, 0, 0};
  for (std::size_t i = 0; i < in.node.size(); ++i) {
    text.in_range(at(node, i), in.node[i], 0, out.lattice.nodes[i] - 1, "");
    (*out.tool_node)[i] = in.node[i];
  }
}

/// Reads the tools beside the first.
void read_tools(const SceneText& text, SceneSettings& out) {
  const auto& in = text.values().tools;
  if (in.empty()) return;
  if (in.size() + 1 > kMaxTools)
    text.refuse("tools", fmt::format("tools has {} of them", in.size()), fmt::format("at most {} beside tool", kMaxTools - 1));
  if (out.tool.contact == ContactKind::attach)
    text.refuse("tools", "tools is given beside a tool that grasps a node", "a tool.contact of \"touch\"");
  for (std::size_t i = 0; i < in.size(); ++i) {
    const std::string path = at("tools", i), name = path + ".name";
    for (const char* field : {".node", ".needle", ".blade", ".scissors", ".holds"})
      if (text.has(path + field))
        text.refuse(path + field, path + field + " is given", "it only in tool: the others are points or have a body");
    ToolSpec tool = read_any_tool(text, path, *in[i], false);
    if (tool.contact == ContactKind::attach)
      text.refuse(path + ".contact", path + ".contact is \"attach\"", "\"touch\": only tool may grasp a node");
    if (tool.name.empty()) text.refuse(name, std::string("1 to 64 bytes of ") + kNameCharacters);
    const auto same = [&](const ToolSpec& other) { return other.name == tool.name; };
    if (same(out.tool) || std::ranges::any_of(out.tools, same))
      text.refuse(name, name + " is \"" + tool.name + "\", as that of a tool before", "a name of its own");
    out.tools.push_back(std::move(tool));
  }
}

void read_solver(const SceneText& text, const schema::SolverT& in, SceneSettings& out) {
  text.in_range("solver.step_ms", in.step_ms, 0.1, 50, "ms");
  out.step_ms = in.step_ms;
  out.integrator = static_cast<IntegratorKind>(choice(text, "solver.integrator", in.integrator, kIntegratorNames, 0));
}

void read_lattice(const SceneText& text, const schema::BodyT& body, LatticeSettings& out) {
  if (!body.lattice) text.refuse(kLattice, "an object with nodes and size_m");
  const auto& in = *body.lattice;
  read_place(text, in, out);
  read_material(text, body, out);
  out.fixed = read_fixing(text, kLattice, in.fixed_faces, in.fixed_below_z_m, in.fixed_above_z_m, out.planar);
}

MemberSettings read_member(const SceneText& text, const schema::BodyT& in) {
  MemberSettings out;
  if (!is_name(in.name)) text.refuse("body.name", std::string("1 to 64 bytes of ") + kNameCharacters);
  out.name = in.name;
  out.colour = read_colour(text, "body.colour", in.colour, kUsualBodyColour);
  text.in_range("body.mu", in.mu, 0, 2, "");
  out.friction = in.mu;
  out.touches_itself = in.self_contact;
  for (const char* field : {"body.lump", "body.cuts", "body.tissue", "body.tears", "body.clips", "body.sutures"})
    if (text.has(field)) text.refuse(field, std::string(field) + " is given among several bodies", "it in a scene with one body");
  if (choice(text, "body.reference_configuration", in.reference_configuration, kGivenShapeNames, 0) == 1)
    text.refuse("body.reference_configuration", "body.reference_configuration is \"loaded\" among several bodies",
                "\"stress-free\"");
  if (in.mesh)
    out.mesh = read_mesh_body(text, in);
  else
    read_lattice(text, in, out.lattice);
  if (!out.mesh && !out.lattice.solid)
    text.refuse("body.lattice", "body.lattice is of springs among several bodies", "a solid: finite elements");
  out.ligaments = read_ligaments(text, in, false);
  return out;
}

void read_body(const SceneText& text, SceneSettings& out) {
  const auto& in = text.values();
  if (!in.body) text.refuse("body", "an object with a lattice or a mesh");
  for (const char* field : {"body.name", "body.colour", "body.mu", "body.self_contact"})
    if (text.has(field)) text.refuse(field, std::string(field) + " is given for the only body", "it in a list of bodies");
  if (in.body->mesh)
    out.mesh = read_mesh_body(text, *in.body);
  else
    read_lattice(text, *in.body, out.lattice);
  out.ligaments = read_ligaments(text, *in.body, out.lattice.planar);
  out.is_loaded = choice(text, "body.reference_configuration", in.body->reference_configuration, kGivenShapeNames, 0) == 1;
  const Vec3& gravity = out.mesh ? out.mesh->gravity_m_s2 : out.lattice.gravity_m_s2;
  if (out.is_loaded && gravity.squaredNorm() == 0)
    text.refuse("body.reference_configuration", "body.reference_configuration is \"loaded\", but nothing loads the body",
                "gravity_m_s2");
  out.tissue = read_tissue(text, *in.body);
  read_tool(text, in.tool ? *in.tool : schema::ToolT(), *in.body, out);
  out.lump = read_lump(text, out.lattice.planar);
  read_cuts(text, *in.body, out);
  read_tears(text, *in.body, out);
  read_clips(text, *in.body, out);
  read_sutures(text, out);
}

std::vector<MemberSettings> read_members(const SceneText& text) {
  const auto& in = text.values().bodies;
  std::vector<MemberSettings> out;
  if (text.has("body")) text.refuse("bodies", "body and bodies are both given", "one of them");
  if (in.empty() || in.size() > kMostBodies)
    text.refuse("bodies", fmt::format("bodies has {} of them", in.size()), fmt::format("1 to {}", kMostBodies));
  for (std::size_t i = 0; i < in.size(); ++i) {
    const SceneText one = text.of_member(i);
    out.push_back(read_member(one, *in[i]));
    for (std::size_t k = 0; k < i; ++k)
      if (out[k].name == out[i].name)
        one.refuse("body.name", "body.name is \"" + out[i].name + "\", as that of a body before", "a name of its own");
  }
  for (const char* field : {"tool.node", "tool.needle", "tool.blade", "tool.scissors", "tool.holds"})
    if (text.has(field)) text.refuse(field, std::string(field) + " is given with bodies", "it in a scene with one body");
  return out;
}

}  // namespace

std::uint32_t read_colour(const SceneText& text, const std::string& path, const std::string& given, std::uint32_t usual) {
  if (!text.has(path)) return usual;
  constexpr std::size_t kDigits = 6;
  std::uint32_t colour = 0;
  const char* const end = given.data() + given.size();
  const bool is_colour =
      given.size() == 1 + kDigits && given[0] == '#' && std::from_chars(given.data() + 1, end, colour, 16).ptr == end;
  if (!is_colour) text.refuse(path, "a colour \"#rrggbb\" in hexadecimal digits");
  return colour;
}

MeshSettings read_mesh_file(const SceneText& text, const std::string& path, const schema::MeshFileT& in) {
  if (in.file.empty()) text.refuse(path + ".file", "the name of an OBJ or STL file");
  text.in_range(path + ".scale", in.scale, 1e-6, 1e3, "m per unit of the file");
  return {in.file, text.mesh_path(path + ".file", in.file), in.scale,
          vector(text, path + ".rotation_deg", in.rotation_deg, -360, 360, "degrees", Vec3(0, 0, 0)),
          vector(text, path + ".offset_m", in.offset_m, -kMaxCoordinateM, kMaxCoordinateM, "m", Vec3(0, 0, 0))};
}

/// Same rule as on the wire, as names go into logs and onto screens.
bool is_name(const std::string& name) { return !name.empty() && name.size() <= kMaxNameBytes && is_plain_name(name); }

SceneSettings read_settings(const SceneText& text) {
  const auto& in = text.values();
  SceneSettings out;
  out.name = text.has("name") ? in.name : text.file().stem().string();
  if (text.has("name") && !is_name(in.name)) text.refuse("name", std::string("1 to 64 bytes of ") + kNameCharacters);
  if (!text.has("name")) out.name = is_plain_name(out.name) ? cut_text(out.name, kMaxNameBytes) : "scene";
  if (text.has("bodies")) {
    out.members = read_members(text);
    read_tool(text, in.tool ? *in.tool : schema::ToolT(), schema::BodyT(), out);
  } else {
    read_body(text, out);
  }
  read_tools(text, out);
  read_solver(text, in.solver ? *in.solver : schema::SolverT(), out);
  out.task = read_task_settings(text, out.lump);
  out.parts = read_parts(text, out);
  return out;
}

}  // namespace palpate
