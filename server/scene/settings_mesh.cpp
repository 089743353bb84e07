// Settings of finite elements: their materials, and bodies given as meshes.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/mechanics/ogden.hpp"
#include "server/scene/settings_fields.hpp"

namespace palpate {
namespace {

const std::string kMesh = "body.mesh";
constexpr double kMaxMassDamping = 1e4;

void take_numbers(const SceneText& text, const std::string& path, const SolidFields& fields, SolidMaterial& out) {
  if (fields.young_pa) out.young_pa = required(text, path + ".young_pa", fields.young_pa, kMinYoungPa, kMaxYoungPa, "Pa");
  if (fields.poisson) out.poisson = required(text, path + ".poisson", fields.poisson, 0, kMaxPoisson, "");
  if (fields.damping_s) out.damping_s = required(text, path + ".damping_s", fields.damping_s, 0, kMaxDampingS, "s");
}

/// Reads the exponents of Ogden's law: one, or two and the share of the second.
void take_exponents(const SceneText& text, const std::string& path, const std::vector<double>& in, SolidMaterial& out) {
  const std::string where = path + ".exponents";
  if (in.empty() || in.size() > out.exponents.size()) text.refuse(where, "one number or two");
  for (std::size_t p = 0; p < in.size(); ++p) {
    if (!(std::abs(in[p]) >= kMinOgdenExponent && std::abs(in[p]) <= kMaxOgdenExponent))
      text.refuse(at(where, p), fmt::format("{} is {:g}", at(where, p), in[p]),
                  fmt::format("{:g} to {:g} or {:g} to {:g}", -kMaxOgdenExponent, -kMinOgdenExponent, kMinOgdenExponent,
                              kMaxOgdenExponent));
    out.exponents[p] = in[p];
  }
  if (in.size() == 1) out.exponents[1] = in[0];
}

/// Reads the parameters of a law beyond its moduli: from the scene, else from the material if that has the same law.
void take_shape(const SceneText& text, const std::string& path, const schema::SolidT& in, SolidMaterial& out) {
  const bool named = !in.material.empty() && find_material(in.material)->solid.law == out.law;
  if (!named) out.shape = 0, out.exponents = {};
  const bool exponents = text.has(path + ".exponents"), of_ogden = out.law == SolidLaw::ogden;
  const bool of_mooney = out.law == SolidLaw::mooney_rivlin, of_veronda = out.law == SolidLaw::veronda_westmann,
             of_gent = out.law == SolidLaw::gent;
  const auto only_with = [&](const char* field, bool given, bool fits, const char* expected) {
    const std::string where = path + "." + field;
    if (given && !fits) text.refuse(where, where + " is given", expected);
  };
  only_with("exponents", exponents, of_ogden, "it with \"law\": \"ogden\" alone");
  only_with("exponent", in.exponent.has_value(), of_veronda,
            of_ogden ? "exponents, one or two, of \"ogden\"" : "it with \"law\": \"veronda-westmann\" alone");
  only_with("limit", in.limit.has_value(), of_gent, "it with \"law\": \"gent\" alone");
  if (of_ogden && (exponents || !named)) {
    take_exponents(text, path, in.exponents, out);
    out.shape = 0;
  }
  only_with("second_share", in.second_share.has_value(), of_mooney || (of_ogden && (!exponents || in.exponents.size() == 2)),
            "it with \"law\": \"mooney-rivlin\", or with two exponents of \"ogden\"");
  const bool two = of_mooney ? !named : of_ogden && exponents && in.exponents.size() == 2;
  if (in.second_share || two) out.shape = required(text, path + ".second_share", in.second_share, 0, kMaxSecondShare, "");
  if (of_veronda && (in.exponent || !named)) out.shape = required(text, path + ".exponent", in.exponent, 0, kMaxExponent, "");
  if (of_gent && (in.limit || !named)) out.shape = required(text, path + ".limit", in.limit, kMinGentLimit, kMaxGentLimit, "");
  const LameParameters lame = lame_parameters(out.law, out.young_pa, out.poisson);
  if (of_ogden && !(lame.lambda + Ogden(out.parameters()).modulus_sum() * lame.mu > 0))
    text.refuse(path + ".poisson",
                fmt::format("{}.poisson is {:g}, at which these exponents have a volume without an end", path, out.poisson),
                "a larger one, or exponents above 0");
}

void take_fibres(const SceneText& text, const std::string& path, const schema::FibresT& in, Fibres& out) {
  const Vec3 direction = vector(text, path + ".direction", in.direction, -1e6, 1e6, "of a direction", Vec3::Zero());
  const double length = direction.norm();
  if (!(length > 0)) text.refuse(path + ".direction", "three numbers, not all 0");
  constexpr double kUnit = 1e-12;
  const Vec3 unit = std::abs(length - 1) < kUnit ? direction : Vec3(direction / length);
  out.direction = {unit.x(), unit.y(), unit.z()};
  out.share = required(text, path + ".stiffness_ratio", in.stiffness_ratio, 0, kMaxFibreShare, "");
  text.in_range(path + ".exponent", in.exponent, 0, kMaxExponent, "");
  out.exponent = in.exponent;
}

CapsuleSettings read_capsule(const SceneText& text, const std::string& path, const schema::CapsuleT& in) {
  constexpr double kMinThicknessM = 1e-6, kMaxThicknessM = 0.01, kMostPoisson = 0.5;
  CapsuleSettings out;
  out.young_pa = required(text, path + ".young_pa", in.young_pa, kMinYoungPa, kMaxYoungPa, "Pa");
  out.thickness_m = required(text, path + ".thickness_m", in.thickness_m, kMinThicknessM, kMaxThicknessM, "m");
  text.in_range(path + ".poisson", in.poisson, 0, kMostPoisson, "");
  text.in_range(path + ".damping_s", in.damping_s, 0, kMaxDampingS, "s");
  out.poisson = in.poisson;
  out.damping_s = in.damping_s;
  return out;
}

/// Reads the Prony series from the scene, else from the material.
std::vector<PronyBranch> read_relaxation(const SceneText& text, const std::string& path, const schema::SolidT& in) {
  if (!text.has(path))
    return in.material.empty() ? std::vector<PronyBranch>() : named_material(text, path, in.material).relaxation;
  if (in.relaxation.size() > kMaxPronyBranches) text.refuse(path, "at most " + std::to_string(kMaxPronyBranches) + " branches");
  std::vector<PronyBranch> out;
  double fading = 0;
  for (std::size_t i = 0; i < in.relaxation.size(); ++i) {
    const std::string branch = at(path, i);
    out.push_back({required(text, branch + ".share", in.relaxation[i]->share, 0, kMaxFadingShare, ""),
                   required(text, branch + ".time_s", in.relaxation[i]->time_s, kMinFadingS, kMaxFadingS, "s")});
    fading += out.back().share;
  }
  if (fading > kMaxFadingShare)
    text.refuse(path, path + " has shares of " + fmt::format("{:.4g}", fading) + " together",
                fmt::format("at most {:.4g}", kMaxFadingShare));
  return out;
}

}  // namespace

const NamedMaterial& named_material(const SceneText& text, const std::string& path, const std::string& name) {
  if (const NamedMaterial* const material = find_material(name)) return *material;
  std::string all;
  for (const NamedMaterial& m : named_materials()) all += (all.empty() ? "" : ", ") + m.name;
  text.refuse(path, "one of " + all);
}

double read_density(const SceneText& text, const std::string& path, double usual_or_given, const std::string& material) {
  if (!text.has(path) && !material.empty()) return find_material(material)->density_kg_m3;
  text.in_range(path, usual_or_given, 1, 30000, "kg/m^3");
  return usual_or_given;
}

SolidMaterial read_part(const SceneText& text, const std::string& path, const SolidMaterial& whole,
                        const std::vector<PronyBranch>& relaxation, const SolidFields& fields) {
  if (fields.empty()) text.refuse(path, path + " changes nothing", "material, young_pa, poisson or damping_s");
  SolidMaterial out = whole;
  if (!fields.material.empty()) {
    const NamedMaterial& named = named_material(text, path + ".material", fields.material);
    const bool fades_alike =
        std::equal(relaxation.begin(), relaxation.end(), named.relaxation.begin(), named.relaxation.end(),
                   [](const PronyBranch& a, const PronyBranch& b) { return a.share == b.share && a.time_s == b.time_s; });
    out = named.solid;
    if (out.law == whole.law && !fades_alike)
      text.refuse(path + ".material", path + ".material fades otherwise than the body",
                  "one relaxation for all of a body: a material that has it, or young_pa");
  }
  out.fibres = whole.fibres;
  if (out.parameters() != whole.parameters())
    text.refuse(path + ".material", path + ".material is of another law than the body", "one law for all of a body");
  take_numbers(text, path, fields, out);
  return out;
}

SolidSettings read_solid(const SceneText& text, const std::string& path, const schema::SolidT& in) {
  SolidSettings out;
  out.element = static_cast<SolidElement>(
      choice(text, path + ".element", in.element, kSolidElementNames, static_cast<std::size_t>(kUsualElement)));
  if (in.material.empty() && !in.young_pa) text.refuse(path + ".young_pa", "a number of Pa, or a material");
  if (!in.material.empty()) out.material = named_material(text, path + ".material", in.material).solid;
  out.material.law =
      static_cast<SolidLaw>(choice(text, path + ".law", in.law, kSolidLawNames, static_cast<std::size_t>(out.material.law)));
  take_numbers(text, path, {in.material, in.young_pa, in.poisson, in.damping_s}, out.material);
  take_shape(text, path, in, out.material);
  if (in.fibres) take_fibres(text, path + ".fibres", *in.fibres, out.material.fibres);
  text.in_range(path + ".mass_damping_1_s", in.mass_damping_1_s, 0, kMaxMassDamping, "1/s");
  out.mass_damping_1_s = in.mass_damping_1_s;
  out.relaxation = read_relaxation(text, path + ".relaxation", in);
  if (in.capsule) out.capsule = read_capsule(text, path + ".capsule", *in.capsule);
  return out;
}

FixedSettings read_fixing(const SceneText& text, const std::string& where, const std::vector<std::string>& faces,
                          const flatbuffers::Optional<double>& below, const flatbuffers::Optional<double>& above, bool planar) {
  FixedSettings out;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const std::string path = at(where + ".fixed_faces", i);
    const auto face = choice(text, path, faces[i], kFaceNames, 0);
    if (planar && face >= 4) text.refuse(path, "\"x-\", \"x+\", \"y-\" or \"y+\" for a sheet");
    out.faces.emplace_back(kFaceNames[face]);
  }
  const auto plane = [&](const char* field, const flatbuffers::Optional<double>& value) -> std::optional<double> {
    const std::string path = where + "." + field;
    if (!value) return std::nullopt;
    if (planar) text.refuse(path, path + " is given for a sheet", "fixed_faces");
    return required(text, path, value, -2 * kMaxCoordinateM, 2 * kMaxCoordinateM, "m");
  };
  out.below_z_m = plane("fixed_below_z_m", below);
  out.above_z_m = plane("fixed_above_z_m", above);
  return out;
}

MeshBodySettings read_mesh_body(const SceneText& text, const schema::BodyT& body) {
  if (body.lattice) text.refuse("body", "body holds both", "a lattice or a mesh");
  for (const char* field : {"body.spring_law", "body.stiffening"})
    if (text.has(field)) text.refuse(field, std::string(field) + " is given with a mesh", "a lattice for it");
  if (text.has("body.gravity_m_s2"))
    text.refuse("body.gravity_m_s2", "body.gravity_m_s2 is given with a mesh", "it in body.mesh");
  const auto& in = *body.mesh;
  MeshBodySettings out;
  if (in.file.empty()) text.refuse(kMesh + ".file", "the name of a .msh or .vtk file");
  text.in_range(kMesh + ".scale", in.scale, 1e-6, 1e3, "m per unit of the file");
  out.mesh = MeshSettings{in.file, text.mesh_path(kMesh + ".file", in.file), in.scale,
                          vector(text, kMesh + ".rotation_deg", in.rotation_deg, -360, 360, "degrees", Vec3(0, 0, 0)),
                          vector(text, kMesh + ".offset_m", in.offset_m, -kMaxCoordinateM, kMaxCoordinateM, "m", Vec3(0, 0, 0))};
  if (!in.solid) text.refuse(kMesh + ".solid", "an object with young_pa or a material");
  out.solid = read_solid(text, kMesh + ".solid", *in.solid);
  out.density_kg_m3 = read_density(text, kMesh + ".density_kg_m3", in.density_kg_m3, in.solid->material);
  if (text.has(kMesh + ".solid.element") && out.solid.element != SolidElement::tetrahedron)
    text.refuse(kMesh + ".solid.element",
                "\"tetrahedron\": that is what the file's cells are; a lattice with a clip has hexahedra");
  out.solid.element = SolidElement::tetrahedron;
  for (std::size_t i = 0; i < in.regions.size(); ++i) {
    const auto& region = *in.regions[i];
    const std::string path = at(kMesh + ".regions", i);
    if (!region.id) text.refuse(path + ".id", "the number of a region of the mesh");
    out.regions.push_back({*region.id, read_part(text, path, out.solid.material, out.solid.relaxation,
                                                 {region.material, region.young_pa, region.poisson, region.damping_s})});
  }
  out.fixed = read_fixing(text, kMesh, in.fixed_faces, in.fixed_below_z_m, in.fixed_above_z_m, false);
  out.gravity_m_s2 = vector(text, kMesh + ".gravity_m_s2", in.gravity_m_s2, -100, 100, "m/s^2", Vec3(0, 0, 0));
  return out;
}

}  // namespace palpate
