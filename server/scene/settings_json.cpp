#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/json/json.hpp"
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

void add_places(Json& out, const std::vector<Vec3>& places) {
  for (const Vec3& at : places) {
    Json item = Json::object();
    item.add("at_m", list(at));
    out.items.push_back(std::move(item));
  }
}

void add_mesh_file(Json& out, const MeshSettings& mesh) {
  out.add("file", Json::string(mesh.file));
  out.add("scale", Json::number(mesh.scale));
  out.add("rotation_deg", list(mesh.rotation_deg));
  out.add("offset_m", list(mesh.offset_m));
}

Json to_json(const ClipSettings& clip) {
  Json out = Json::object();
  if (const auto& mesh = clip.mesh) {
    add_mesh_file(out.add("mesh", Json::object()), *mesh);
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

void add_material(Json& out, const SolidMaterial& material) {
  out.add("young_pa", Json::number(material.young_pa));
  out.add("poisson", Json::number(material.poisson));
  out.add("damping_s", Json::number(material.damping_s));
}

void add_shape(Json& out, const SolidMaterial& material) {
  const SolidLaw law = material.law;
  if (law == SolidLaw::ogden) {
    Json& exponents = out.add("exponents", Json::array());
    for (const double exponent : material.exponents) exponents.items.push_back(Json::number(exponent));
  }
  if (law == SolidLaw::mooney_rivlin || law == SolidLaw::ogden) out.add("second_share", Json::number(material.shape));
  if (law == SolidLaw::veronda_westmann) out.add("exponent", Json::number(material.shape));
  if (law == SolidLaw::gent) out.add("limit", Json::number(material.shape));
  const Fibres& fibres = material.fibres;
  if (fibres.share == 0) return;
  Json item = Json::object();
  Json& direction = item.add("direction", Json::array());
  for (const double axis : fibres.direction) direction.items.push_back(Json::number(axis));
  item.add("stiffness_ratio", Json::number(fibres.share));
  item.add("exponent", Json::number(fibres.exponent));
  out.add("fibres", std::move(item));
}

Json to_json(const SolidSettings& solid) {
  Json out = Json::object();
  out.add("element", Json::string(kSolidElementNames[static_cast<std::size_t>(solid.element)]));
  out.add("law", Json::string(kSolidLawNames[static_cast<std::size_t>(solid.material.law)]));
  add_material(out, solid.material);
  add_shape(out, solid.material);
  out.add("mass_damping_1_s", Json::number(solid.mass_damping_1_s));
  if (solid.capsule) {
    Json capsule = Json::object();
    capsule.add("young_pa", Json::number(solid.capsule->young_pa));
    capsule.add("thickness_m", Json::number(solid.capsule->thickness_m));
    capsule.add("poisson", Json::number(solid.capsule->poisson));
    capsule.add("damping_s", Json::number(solid.capsule->damping_s));
    out.add("capsule", std::move(capsule));
  }
  Json& branches = out.add("relaxation", Json::array());
  for (const PronyBranch& branch : solid.relaxation) {
    Json item = Json::object();
    item.add("share", Json::number(branch.share));
    item.add("time_s", Json::number(branch.time_s));
    branches.items.push_back(std::move(item));
  }
  return out;
}

void add_fixing(Json& out, const FixedSettings& fixed) {
  Json& faces = out.add("fixed_faces", Json::array());
  for (const auto& face : fixed.faces) faces.items.push_back(Json::string(face));
  if (fixed.below_z_m) out.add("fixed_below_z_m", Json::number(*fixed.below_z_m));
  if (fixed.above_z_m) out.add("fixed_above_z_m", Json::number(*fixed.above_z_m));
}

void add_springs(Json& out, const SpringsOfSolid& springs) {
  out.add("young_pa", Json::number(springs.young_pa));
  out.add("damping_s", Json::number(springs.damping_s));
}

Json to_json(const LayerSettings& layer, const LatticeSettings& lattice) {
  Json out = Json::object();
  for (int axis = 0; axis < 3; ++axis) {
    const std::string suffix = std::string("_") + "xyz"[axis] + "_m";
    if (std::isfinite(layer.below_m[axis])) out.add("below" + suffix, Json::number(layer.below_m[axis]));
    if (std::isfinite(layer.above_m[axis])) out.add("above" + suffix, Json::number(layer.above_m[axis]));
  }
  if (lattice.solid) {
    add_material(out, layer.material);
    return out;
  }
  if (lattice.springs_of_solid) {
    add_springs(out, {layer.material.young_pa, layer.material.damping_s});
    return out;
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
  if (lattice.solid) {
    out.add("solid", to_json(*lattice.solid));
  } else {
    if (lattice.springs_of_solid) {
      add_springs(out, *lattice.springs_of_solid);
    } else {
      out.add("stiffness_n_m", Json::number(lattice.stiffness_n_m));
      out.add("damping_n_s_m", Json::number(lattice.damping_n_s_m));
    }
    out.add("spring_law", Json::string(kSpringLawNames[static_cast<std::size_t>(lattice.law)]));
    if (lattice.law == SpringLaw::stiffening) out.add("stiffening", Json::number(lattice.stiffening));
  }
  Json& layers = out.add("layers", Json::array());
  for (const auto& layer : lattice.layers) layers.items.push_back(to_json(layer, lattice));
  add_fixing(out, lattice.fixed);
  out.add("gravity_m_s2", list(lattice.gravity_m_s2));
  return out;
}

Json to_json(const MeshBodySettings& body) {
  Json out = Json::object();
  add_mesh_file(out, body.mesh);
  out.add("density_kg_m3", Json::number(body.density_kg_m3));
  out.add("solid", to_json(body.solid));
  Json& regions = out.add("regions", Json::array());
  for (const RegionSettings& region : body.regions) {
    Json item = Json::object();
    item.add("id", Json::number(region.id));
    add_material(item, region.material);
    regions.items.push_back(std::move(item));
  }
  add_fixing(out, body.fixed);
  out.add("gravity_m_s2", list(body.gravity_m_s2));
  return out;
}

Json to_json(const LumpSettings& lump) {
  Json out = Json::object();
  out.add("center_m", list(lump.center_m));
  out.add("radius_m", Json::number(lump.radius_m));
  out.add("stiffness_ratio", Json::number(lump.stiffness_ratio));
  return out;
}

Json to_json(const FindSettings& find) {
  Json out = Json::object();
  out.add("within_m", Json::number(find.within_m));
  return out;
}
Json to_json(const PressTask& press) {
  Json out = Json::object();
  out.add("min_n", Json::number(press.min_n));
  out.add("max_n", Json::number(press.max_n));
  out.add("time_s", Json::number(press.time_s));
  return out;
}
Json to_json(const TraceSettings& trace) {
  Json out = Json::object();
  add_places(out.add("line", Json::array()), trace.line_m);
  out.add("tolerance_m", Json::number(trace.tolerance_m));
  return out;
}

Json to_json(const TaskSettings& task) {
  constexpr const char* kGoals[] = {"find", "press", "trace"};
  Json out = Json::object();
  out.add("text", Json::string(task.text));
  out.add(kGoals[task.goal.index()], std::visit([](const auto& goal) { return to_json(goal); }, task.goal));
  return out;
}

void add_shape_of_body(Json& body, const std::optional<MeshBodySettings>& mesh, const LatticeSettings& lattice,
                       const std::vector<LigamentSettings>& springs) {
  mesh ? body.add("mesh", to_json(*mesh)) : body.add("lattice", to_json(lattice));
  if (!springs.empty()) {
    Json& ligaments = body.add("ligaments", Json::array());
    for (const LigamentSettings& ligament : springs) {
      Json item = Json::object();
      item.add("from_m", list(ligament.from_m));
      item.add("radius_m", Json::number(ligament.radius_m));
      item.add("to_m", list(ligament.to_m));
      item.add("stiffness_n_m", Json::number(ligament.stiffness_n_m));
      item.add("damping_n_s_m", Json::number(ligament.damping_n_s_m));
      ligaments.items.push_back(std::move(item));
    }
  }
}

void add_body(Json& body, const SceneSettings& settings) {
  add_shape_of_body(body, settings.mesh, settings.lattice, settings.ligaments);
  body.add("reference_configuration", Json::string(kGivenShapeNames[settings.is_loaded ? 1 : 0]));
  if (settings.lump) body.add("lump", to_json(*settings.lump));
  if (!settings.cuts.empty()) {
    Json& cuts = body.add("cuts", Json::array());
    for (const CutSettings& cut : settings.cuts) {
      Json item = Json::object();
      add_places(item.add("path", Json::array()), cut.path_m);
      item.add("direction", list(cut.direction));
      item.add("depth_m", Json::number(cut.depth_m));
      cuts.items.push_back(std::move(item));
    }
  }
  if (settings.tears) body.add("tears", Json::of(Json::Kind::boolean, "true"));
  if (!settings.clips.empty()) {
    Json& clips = body.add("clips", Json::array());
    for (const TissueClipSettings& clip : settings.clips) {
      Json item = Json::object();
      item.add("at_m", list(clip.at_m));
      item.add("radius_m", Json::number(clip.radius_m));
      item.add("stiffness_n_m", Json::number(clip.stiffness_n_m));
      item.add("damping_n_s_m", Json::number(clip.damping_n_s_m));
      clips.items.push_back(std::move(item));
    }
  }
  if (!settings.sutures.empty()) {
    Json& sutures = body.add("sutures", Json::array());
    for (const SutureSettings& suture : settings.sutures) {
      Json item = Json::object();
      item.add("name", Json::string(suture.name));
      item.add("radius_m", Json::number(suture.radius_m));
      add_places(item.add("bites", Json::array()), suture.bites_m);
      item.add("slack_m", Json::number(suture.slack_m));
      item.add("first_tail_m", Json::number(suture.first_tail_m));
      item.add("tail_m", Json::number(suture.tail_m));
      const std::size_t tied = suture.first_tied ? (suture.last_tied ? 2 : 0) : (suture.last_tied ? 1 : 3);
      item.add("tied", Json::string(kTiedNames[tied]));
      item.add("barbed", Json::of(Json::Kind::boolean, suture.barbed ? "true" : "false"));
      item.add("stiffness_n_m", Json::number(suture.stiffness_n_m));
      item.add("mu", Json::number(suture.friction));
      item.add("drag_n", Json::number(suture.drag_n));
      sutures.items.push_back(std::move(item));
    }
  }
  if (!settings.tissue.empty()) {
    Json& tissue = body.add("tissue", Json::array());
    for (const TissueLayer& layer : settings.tissue) {
      Json item = Json::object();
      if (&layer != &settings.tissue.back()) item.add("thickness_m", Json::number(layer.thickness_m));
      item.add("toughness_j_m2", Json::number(layer.toughness_j_m2));
      item.add("puncture_n", Json::number(layer.puncture_n));
      item.add("friction_n_m", Json::number(layer.friction_n_m));
      tissue.items.push_back(std::move(item));
    }
  }
}

void add_tool(Json& tool, const SceneSettings& settings, const ToolSpec& spec) {
  if (!spec.name.empty()) tool.add("name", Json::string(spec.name));
  tool.add("contact", Json::string(kContactNames[static_cast<std::size_t>(spec.contact)]));
  tool.add("mu", Json::number(spec.friction));
  tool.add("contact_stiffness_n_m", Json::number(spec.contact_stiffness_n_m));
  tool.add("radius_m", Json::number(spec.radius_m));
  if (!spec.shape.empty()) {
    Json& shape = tool.add("body", Json::object());
    const auto on_jaw = std::ranges::find_if(spec.shape, &ToolSphere::on_jaw);
    if (on_jaw != spec.shape.end()) {
      Json& jaws = shape.add("jaws", Json::object());
      jaws.add("hinge_z_m", Json::number(on_jaw->hinge_m));
      jaws.add("open_deg", Json::number(2 * std::abs(on_jaw->swing_rad) * 180 / std::numbers::pi));
    }
    Json& spheres = shape.add("spheres", Json::array());
    for (const ToolSphere& sphere : spec.shape) {
      Json part = Json::object();
      part.add("center_m", list(sphere.centre));
      part.add("radius_m", Json::number(sphere.radius_m));
      if (sphere.on_jaw()) part.add("jaw", Json::number(sphere.swing_rad > 0 ? 1 : -1));
      spheres.items.push_back(std::move(part));
    }
  }
  if (spec.needle) {
    const NeedleSpec& of = *spec.needle;
    Json& needle = tool.add(of.stroke_m > 0 ? "scissors" : of.is_blade ? "blade" : "needle", Json::object());
    needle.add("length_m", Json::number(of.length_m));
    needle.add(of.is_blade ? "width_m" : "diameter_m", Json::number(of.width_m));
    if (of.stroke_m > 0) needle.add("stroke_m", Json::number(of.stroke_m));
  }
  if (!spec.holds.empty()) {
    Json& holds = tool.add("holds", Json::array());
    for (const std::uint32_t suture : spec.holds) holds.items.push_back(Json::string(settings.sutures[suture].name));
  }
}

}  // namespace

Json to_json(const SceneSettings& settings) {
  Json out = Json::object();
  out.add("name", Json::string(settings.name));
  if (!settings.members.empty()) {
    Json& bodies = out.add("bodies", Json::array());
    for (const MemberSettings& member : settings.members) {
      Json item = Json::object();
      item.add("name", Json::string(member.name));
      item.add("colour", Json::string(fmt::format("#{:06x}", member.colour)));
      item.add("mu", Json::number(member.friction));
      item.add("self_contact", Json::of(Json::Kind::boolean, member.touches_itself ? "true" : "false"));
      add_shape_of_body(item, member.mesh, member.lattice, member.ligaments);
      bodies.items.push_back(std::move(item));
    }
  } else {
    add_body(out.add("body", Json::object()), settings);
  }
  if (!settings.parts.empty()) {
    Json& parts = out.add("parts", Json::array());
    for (const PartSettings& part : settings.parts) {
      Json item = Json::object();
      item.add("name", Json::string(part.name));
      add_mesh_file(item.add("mesh", Json::object()), part.mesh);
      item.add("colour", Json::string(fmt::format("#{:06x}", part.colour)));
      item.add("mu", Json::number(part.friction));
      item.add("stiffness_ratio", Json::number(part.stiffness_ratio));
      parts.items.push_back(std::move(item));
    }
  }
  add_tool(out.add("tool", Json::object()), settings, settings.tool);
  if (settings.tool_node) out.items.back().add("node", list(*settings.tool_node, 3));
  if (!settings.tools.empty()) {
    Json& tools = out.add("tools", Json::array());
    for (const ToolSpec& tool : settings.tools) add_tool(tools.items.emplace_back(Json::object()), settings, tool);
  }
  Json& solver = out.add("solver", Json::object());
  solver.add("step_ms", Json::number(settings.step_ms));
  solver.add("integrator", Json::string(kIntegratorNames[static_cast<std::size_t>(settings.integrator)]));
  if (settings.task) out.add("task", to_json(*settings.task));
  return out;
}

}  // namespace palpate
