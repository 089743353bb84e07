#include <cmath>

#include "server/scene/json.hpp"
#include "server/scene/settings.hpp"

namespace palpate {

namespace {

template <class Values>
Json list(const Values& values, std::ptrdiff_t n) {
  Json out = Json::array();
  for (std::ptrdiff_t i = 0; i < n; ++i)
    out.items.push_back(Json::number(static_cast<double>(values[static_cast<decltype(values.size())>(i)])));
  return out;
}

Json list(const Vec3& v) { return list(v, 3); }

Json to_json(const ClipSettings& clip) {
  Json out = Json::object();
  if (const auto& mesh = clip.mesh) {
    Json& m = out.add("mesh", Json::object());
    m.add("file", Json::string(mesh->file));
    m.add("scale", Json::number(mesh->scale));
    m.add("rotation_deg", list(mesh->rotation_deg));
    m.add("offset_m", list(mesh->offset_m));
    return out;
  }
  Json& ellipsoids = out.add("ellipsoids", Json::array());
  for (const auto& e : clip.ellipsoids) {
    Json item = Json::object();
    item.add("center_m", list(e.center_m));
    item.add("radii_m", list(e.radii_m));
    item.add("rotation_deg", list(e.rotation_deg));
    ellipsoids.items.push_back(std::move(item));
  }
  out.add("blend_m", Json::number(clip.blend_m));
  return out;
}

Json to_json(const LayerSettings& layer) {
  Json out = Json::object();
  for (int axis = 0; axis < 3; ++axis) {
    const std::string suffix = std::string("_") + "xyz"[axis] + "_m";
    if (std::isfinite(layer.below_m[axis])) out.add("below" + suffix, Json::number(layer.below_m[axis]));
    if (std::isfinite(layer.above_m[axis])) out.add("above" + suffix, Json::number(layer.above_m[axis]));
  }
  out.add("stiffness_n_m", Json::number(layer.stiffness_n_m));
  out.add("damping_n_s_m", Json::number(layer.damping_n_s_m));
  return out;
}

void add_place(Json& out, const LatticeSettings& lattice) {
  if (lattice.spacing_m > 0) {
    out.add("spacing_m", Json::number(lattice.spacing_m));
  } else {
    const int n = lattice.planar ? 2 : 3;
    out.add("nodes", list(lattice.nodes, n));
    out.add("size_m", list(lattice.size_m, n));
    if (lattice.planar) out.add("thickness_m", Json::number(lattice.size_m[2]));
    out.add("origin_m", list(lattice.origin_m));
  }
  if (lattice.clip) out.add("clip", to_json(*lattice.clip));
}

Json to_json(const LatticeSettings& lattice) {
  Json out = Json::object();
  add_place(out, lattice);
  out.add("density_kg_m3", Json::number(lattice.density_kg_m3));
  out.add("stiffness_n_m", Json::number(lattice.stiffness_n_m));
  out.add("damping_n_s_m", Json::number(lattice.damping_n_s_m));
  out.add("spring_law", Json::string(kSpringLawNames[static_cast<std::size_t>(lattice.law)]));
  if (lattice.law == SpringLaw::stiffening) out.add("stiffening", Json::number(lattice.stiffening));
  Json& layers = out.add("layers", Json::array());
  for (const auto& layer : lattice.layers) layers.items.push_back(to_json(layer));
  Json& faces = out.add("fixed_faces", Json::array());
  for (const auto& face : lattice.fixed_faces) faces.items.push_back(Json::string(face));
  if (lattice.fixed_below_z_m) out.add("fixed_below_z_m", Json::number(*lattice.fixed_below_z_m));
  if (lattice.fixed_above_z_m) out.add("fixed_above_z_m", Json::number(*lattice.fixed_above_z_m));
  out.add("gravity_m_s2", list(lattice.gravity_m_s2));
  return out;
}

}  // namespace

Json to_json(const SceneSettings& settings) {
  Json out = Json::object();
  out.add("name", Json::string(settings.name));
  out.add("body", Json::object()).add("lattice", to_json(settings.lattice));
  Json& tool = out.add("tool", Json::object());
  tool.add("contact", Json::string(kContactNames[static_cast<std::size_t>(settings.tool.contact)]));
  if (settings.tool_node) tool.add("node", list(*settings.tool_node, 3));
  tool.add("mu", Json::number(settings.tool.friction));
  tool.add("coupling_n_m", Json::number(settings.tool.coupling_n_m));
  tool.add("radius_m", Json::number(settings.tool.radius_m));
  Json& solver = out.add("solver", Json::object());
  solver.add("step_ms", Json::number(settings.step_ms));
  return out;
}

}  // namespace palpate
