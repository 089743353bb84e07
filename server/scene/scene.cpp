#include "server/scene/scene.hpp"

#include <algorithm>

#include "common/json/json.hpp"
#include "server/scene/capsule.hpp"
#include "server/scene/cuts.hpp"
#include "server/scene/lattice.hpp"
#include "server/scene/ligaments.hpp"
#include "server/scene/lump.hpp"
#include "server/scene/members.hpp"
#include "server/scene/mesh_body.hpp"
#include "server/scene/parts.hpp"
#include "server/scene/scene_text.hpp"
#include "server/scene/sutures.hpp"
#include "server/scene/task.hpp"
#include "server/scene/tissue_clips.hpp"

namespace palpate {

namespace {

std::string in_words(const Index3& n) {
  return "[" + std::to_string(n[0]) + ", " + std::to_string(n[1]) + ", " + std::to_string(n[2]) + "]";
}

/// Free node nearest to the top: highest in z (in a sheet: y), among those nearest to the middle, lower indices first.
std::uint32_t middle_of_top(const LumpedBody& body) {
  const int up = body.planar ? 1 : 2;
  Vec3 low = body.nodes[0], high = body.nodes[0];
  for (const Vec3& x : body.nodes) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  const double tie = 1e-9 * (high - low).norm();
  Vec3 middle = 0.5 * (low + high) - Vec3::Constant(tie);  // biased to lower indices
  std::uint32_t best = 0;
  double best_height = -1e9, best_distance = 0;
  for (std::uint32_t i = 0; i < body.nodes.size(); ++i) {
    if (body.fixed[i]) continue;
    const double height = body.nodes[i][up];
    middle[up] = height;
    const double distance = (body.nodes[i] - middle).norm();
    if (height > best_height + tie || (height > best_height - tie && distance < best_distance - 1e-3 * tie)) {
      best = i;
      best_height = height;
      best_distance = distance;
    }
  }
  return best;
}

void place_tool(const LatticeBody& lattice, const SceneSettings& settings, const SceneText& text, ToolSpec& tool) {
  if (!settings.tool_node) {
    tool.node = middle_of_top(lattice.body);
    return;
  }
  tool.node = lattice.number[lattice.grid.index(*settings.tool_node)];
  if (tool.contact != ContactKind::attach) return;
  const std::string node = "tool.node " + in_words(*settings.tool_node);
  if (tool.node == kNoNode) text.refuse("tool.node", node + " is outside the clip", "a node of the body");
  if (lattice.body.fixed[tool.node]) text.refuse("tool.node", node + " is fixed", "a node that can move");
}

void cut_out(Scene& scene, const SceneSettings& settings, const SceneText& text) {
  CutBody cut = cut_body(std::move(scene.body), settings.cuts, text);
  scene.body = cut.body();
  scene.tool.node = settings.tool_node ? cut.number()[scene.tool.node] : middle_of_top(scene.body);
  if (scene.tool.node == kNoNode) text.refuse("tool.node", "tool.node is in a piece that the cuts take off", "another node");
  if (settings.tears) scene.tearing = std::make_shared<const CutBody>(std::move(cut));
}

LumpedBody build_members(const std::vector<MemberSettings>& members, const SceneText& text) {
  std::vector<LumpedBody> bodies;
  for (std::size_t i = 0; i < members.size(); ++i) {
    const MemberSettings& member = members[i];
    const SceneText one = text.of_member(i);
    LumpedBody& body =
        bodies.emplace_back(member.mesh ? build_mesh_body(*member.mesh, one) : build_lattice(member.lattice, one).body);
    const SolidSettings& solid = member.mesh ? member.mesh->solid : *member.lattice.solid;
    if (solid.capsule) add_capsule(body, *solid.capsule);
  }
  LumpedBody all = join_members(std::move(bodies), members, text);
  for (std::size_t i = 0; i < members.size(); ++i)
    add_ligaments(all, all.members[i].first_node, all.members[i].end_node, members[i].ligaments, text.of_member(i));
  return all;
}

Scene build(const SceneText& text) {
  const SceneSettings settings = read_settings(text);
  Scene scene;
  scene.name = settings.name;
  scene.tool = settings.tool;
  scene.tools = settings.tools;
  scene.solver.step_s = settings.step_ms * 1e-3;
  scene.solver.integrator = settings.integrator;
  if (!settings.members.empty()) {
    scene.body = build_members(settings.members, text);
    scene.tool.node = middle_of_top(scene.body);
  } else if (settings.mesh) {
    scene.body = build_mesh_body(*settings.mesh, text);
    scene.tool.node = middle_of_top(scene.body);
  } else {
    LatticeBody lattice = build_lattice(settings.lattice, text);
    place_tool(lattice, settings, text, scene.tool);
    scene.body = std::move(lattice.body);
  }
  if (settings.lump) add_lump(scene.body, *settings.lump, text);
  if (settings.task) scene.task = fit_task(scene.body, settings, text);
  const std::optional<SolidSettings>& solid = settings.mesh ? settings.mesh->solid : settings.lattice.solid;
  if (solid && solid->capsule) add_capsule(scene.body, *solid->capsule);
  add_ligaments(scene.body, 0, static_cast<std::uint32_t>(scene.body.nodes.size()), settings.ligaments, text);
  add_clips(scene.body, settings.clips, text);
  scene.body.is_loaded = settings.is_loaded;
  scene.body.tissue = settings.tissue;
  if (!settings.cuts.empty()) cut_out(scene, settings, text);
  add_sutures(scene.body, settings.sutures, text);
  add_parts(scene.body, settings.parts, text);
  return scene;
}

}  // namespace

std::optional<std::uint8_t> Scene::tool_named(const std::string& named) const {
  if (named.empty()) return std::uint8_t{0};
  for (std::uint8_t held = 0; held <= tools.size(); ++held)
    if (tool_of(held).name == named) return held;
  return std::nullopt;
}

std::vector<double> Scene::contact_radii() const {
  std::vector<double> radii{tool.radius_m};
  for (const ToolSpec& other : tools)
    if (std::ranges::find(radii, other.radius_m) == radii.end()) radii.push_back(other.radius_m);
  return radii;
}

Scene load_scene(const std::filesystem::path& file, const MeshFolders& besides) { return build(SceneText(file, besides)); }

Scene read_scene(const std::string& json, const std::string& name, const MeshFolders& folders) {
  return build(SceneText(json, name, folders));
}

std::string print_scene(const std::filesystem::path& file, const MeshFolders& besides) {
  const SceneText text(file, besides);
  return write_json(to_json(read_settings(text)));
}

}  // namespace palpate
