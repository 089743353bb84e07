// Arbitrary text: a scene is refused with an InputError, or its settings, written and read back, are the same, and its body is
// finite and in range.
#include <algorithm>
#include <cstdlib>

#include "common/base/error.hpp"
#include "common/json/json.hpp"
#include "server/scene/scene_text.hpp"
#include "server/scene/settings.hpp"
#include "tests/fuzz/text_mutator.hpp"

using namespace palpate;

namespace {

const std::vector<std::string> kScenes{
    R"({ "name": "cube6", "body": { "lattice": { "nodes": [3, 3, 3], "size_m": [0.1, 0.1, 0.1], "density_kg_m3": 1000,
  "stiffness_n_m": 60, "damping_n_s_m": 0.24, "fixed_faces": ["z-"], "spring_law": "stiffening", "stiffening": 3,
  "layers": [ {"below_z_m": 0.06, "stiffness_n_m": 20, "damping_n_s_m": 0.08} ] } },
  "tool": { "contact": "attach", "node": [1, 1, 2] } })",
    R"({ "body": { "gravity_m_s2": [0, 0, -9.81], "lattice": { "nodes": [4, 3], "size_m": [0.1, 0.1], "thickness_m": 0.01,
  "stiffness_n_m": 60, "damping_n_s_m": 0.24, "fixed_faces": ["x-", "x+"] } }, "solver": { "step_ms": 5, "integrator": "explicit" } })",
    R"({ "body": { "lattice": { "nodes": [4, 4, 4], "size_m": [0.1, 0.1, 0.1], "origin_m": [-0.05, -0.05, -0.05],
  "clip": { "ellipsoids": [ { "center_m": [0, 0, 0], "radii_m": [0.05, 0.04, 0.05], "rotation_deg": [0, 30, 0] } ], "blend_m": 0.01 },
  "solid": { "law": "corotational", "young_pa": 5000, "poisson": 0.4, "damping_s": 0.01, "mass_damping_1_s": 1 },
  "layers": [ { "above_x_m": 0, "young_pa": 9000 } ], "fixed_below_z_m": -0.03 } }, "tool": { "mu": 0.5, "contact_stiffness_n_m": 900, "radius_m": 0.004 } })",
    R"({ "body": { "mesh": { "file": "a.msh", "scale": 0.001, "rotation_deg": [0, 0, 90], "offset_m": [0, 0, 0.1], "density_kg_m3": 1050,
  "solid": { "young_pa": 3000 }, "regions": [ { "id": 2, "poisson": 0.3 } ], "fixed_above_z_m": 0.2 } } })",
    R"({ "body": { "lattice": { "nodes": [3, 3, 3], "size_m": [0.02, 0.02, 0.02], "solid": { "material": "liver" } } },
  "tool": { "body": { "jaws": { "hinge_z_m": 0.03, "open_deg": 50 }, "spheres": [ { "center_m": [0, 0, 0.04], "radius_m": 0.003 } ],
  "capsules": [ { "from_m": [0.003, 0, 0], "to_m": [0.003, 0, 0.02], "radius_m": 0.003, "spheres": 2, "jaw": -1 } ] } } })",
    R"({ "bodies": [ { "name": "a", "lattice": { "nodes": [3, 3, 3], "size_m": [0.02, 0.02, 0.02], "solid": { "young_pa": 3000 } } },
  { "name": "b", "colour": "#102030", "mu": 0.1, "self_contact": true, "lattice": { "nodes": [2, 2, 2], "size_m": [0.01, 0.01, 0.01],
  "origin_m": [0, 0, 0.02], "solid": { "young_pa": 9000 } } } ] })",
    R"({ "body": { "lattice": { "spacing_m": 0.02, "clip": { "mesh": { "file": "../a.obj", "scale": 1 } }, "stiffness_n_m": 20, "damping_n_s_m": 1 } } })"};
const std::vector<std::string_view> kWords{"\"name\": ",
                                           "\"body\": ",
                                           "\"bodies\": ",
                                           "\"lattice\": ",
                                           "\"nodes\": ",
                                           "\"size_m\": ",
                                           "\"spacing_m\": 0.1, ",
                                           "\"clip\": ",
                                           "\"mesh\": ",
                                           "\"ellipsoids\": ",
                                           "\"layers\": ",
                                           "\"solid\": ",
                                           "\"tool\": ",
                                           "\"jaw\": 1, ",
                                           "\"node\": ",
                                           "\"contact\": ",
                                           "\"fixed_faces\": ",
                                           "{",
                                           "}",
                                           "[",
                                           "]",
                                           ", ",
                                           ": ",
                                           "1e308",
                                           "-1",
                                           "0.5",
                                           "1e-320",
                                           "\"touch\"",
                                           "\"attach\"",
                                           "\"thigh-skin\"",
                                           "null",
                                           "true",
                                           "\\u0000",
                                           "\\ud800",
                                           "\xff",
                                           "\"file\": \"/dev/zero\"",
                                           "\"../\"",
                                           "[2, 2, 2]",
                                           "[0.1, 0.1, 0.1]",
                                           "\"young_pa\": 100, ",
                                           "\"poisson\": 0.499, "};

/// Limits bodies to a size of which a fuzzer builds some thousands per minute.
bool is_small(const SceneSettings& settings) {
  constexpr int kMostNodes = 512;
  const auto fits = [](const auto& body) {
    const auto& [x, y, z] = body.lattice.nodes;
    return !body.mesh && body.lattice.spacing_m == 0 && x * y * z <= kMostNodes;
  };
  return fits(settings) && std::ranges::all_of(settings.members, fits);
}

SceneSettings settings_of(const std::string& json) { return read_settings(SceneText(json, "fuzz.json", {"/"})); }

void check(const Scene& scene) {
  for (const Vec3& x : scene.body.nodes)
    if (!x.allFinite() || x.cwiseAbs().maxCoeff() > 2 * kMaxCoordinateM) std::abort();
  for (const double mass : scene.body.masses_kg)
    if (!(mass > 0)) std::abort();
  for (const Element& e : scene.body.elements)
    if (e.a >= scene.body.nodes.size() || e.b >= scene.body.nodes.size() || !(e.rest_length_m > 0)) std::abort();
  for (const Tetrahedron& t : scene.body.tetrahedra)
    if (t.material >= scene.body.materials.size()) std::abort();
  if (scene.tool.node >= scene.body.nodes.size() || scene.body.fixed[scene.tool.node]) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string json(reinterpret_cast<const char*>(data), size);
  try {
    const SceneSettings settings = settings_of(json);
    const std::string written = write_json(to_json(settings));
    if (write_json(to_json(settings_of(written))) != written) std::abort();
    if (is_small(settings)) check(read_scene(json, "fuzz.json"));
  } catch (const InputError&) {
  }
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size, unsigned seed) {
  return test::mutate_text(data, size, max_size, seed, kScenes, kWords);
}
