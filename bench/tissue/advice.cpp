#include "bench/tissue/advice.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>

#include "bench/measure/pushed_cube.hpp"
#include "bench/measure/server_load.hpp"
#include "bench/measure/tools_apart.hpp"
#include "bench/tissue/boundary_problem.hpp"
#include "common/base/error.hpp"
#include "common/base/sort_stably.hpp"
#include "server/body/skin.hpp"
#include "server/scene/materials.hpp"
#include "server/scene/mesh_file.hpp"

namespace palpate {
namespace {

constexpr double kCellsOverThinnest[] = {4, 5.5, 7, 9, 11, 14};  // coarse to fine
constexpr std::size_t kFewestMeshes = 3, kMostNodes = 2500;
constexpr double kStepsS[] = {0.050, 0.025, 0.010, 0.005};
constexpr double kStepShare = 0.25;  // of the error asked for

Eigen::AlignedBox3d box_of(const AdviceRequest& request) {
  const MeshSettings mesh{request.surface.string(), request.surface, request.scale, Vec3::Zero(), Vec3::Zero()};
  Eigen::AlignedBox3d box;
  for (const Vec3& x : read_closed_mesh(mesh, "--surface " + request.surface.string()).vertices) box.extend(x);
  return box;
}

class Adviser {
 public:
  Adviser(const AdviceRequest& request, const Stopwatch& stopwatch, const std::function<void(const std::string&)>& says)
      : request_(request), stopwatch_(stopwatch), says_(says), box_(box_of(request)) {
    if (!find_material(request.material))
      throw InputError("--material", "'" + request.material + "' is not known", "one of palpate-server --list-materials");
  }

  Advice run() {
    add_meshes();
    take_mesh_errors();
    choose_step();
    choose_mesh();
    return std::move(advice_);
  }

 private:
  Scene scene_of(SolidElement element, double spacing_m, double step_s) const {
    const auto folder = std::filesystem::absolute(request_.surface).parent_path();
    return read_scene(advised_scene(request_, request_.surface.filename().string(), element, spacing_m, step_s),
                      (folder / "advised.json").string(), {folder});
  }

  double compliance(const Scene& scene) const {
    constexpr double kStrain = 1e-4;
    const double load_n = kStrain * scene.body.materials.front().young_pa * request_.radius_m * request_.radius_m;
    const Skin skin(scene.body, request_.radius_m);
    const std::vector<Vec3>& nodes = scene.body.nodes;
    std::uint32_t top = scene.body.triangles.front()[0];
    for (const Triangle& t : scene.body.triangles)
      for (const std::uint32_t i : t)
        if (nodes[i].z() > nodes[top].z()) top = i;
    BoundaryProblem problem(scene.body);
    for (const auto& [node, weight] : skin.vertex_weights(top)) problem.push(node, Vec3(0, 0, -load_n * weight));
    problem.solve();
    double down_m = 0;
    for (const auto& [node, weight] : skin.vertex_weights(top)) down_m -= weight * problem.displacement(node).z();
    return down_m / load_n;
  }

  /// Lattices of the same spacings of both elements, until they are too large.
  void add_meshes() {
    for (const double cells : kCellsOverThinnest)
      for (const SolidElement element : {SolidElement::hexahedron, SolidElement::tetrahedron}) {
        AdvisedMesh mesh;
        mesh.element = element;
        mesh.spacing_m = std::min(box_.sizes().minCoeff() / cells, request_.radius_m);
        const Scene scene = scene_of(element, mesh.spacing_m, advice_.step_s);
        mesh.nodes = scene.body.nodes.size();
        mesh.cells = element == SolidElement::hexahedron ? scene.body.hexahedra.size() : scene.body.tetrahedra.size();
        const bool again = !advice_.tried.empty() && advice_.tried.size() >= 2 &&
                           advice_.tried[advice_.tried.size() - 2].spacing_m == mesh.spacing_m;
        if (again || (mesh.nodes > kMostNodes && advice_.tried.size() >= 2 * kFewestMeshes)) return;
        mesh.compliance_m_n = compliance(scene);
        says_(fmt::format("{:.3g} mm, {}: {} nodes, {:.3g} mm/N", 1e3 * mesh.spacing_m, mesh.element_name(), mesh.nodes,
                          1e3 * mesh.compliance_m_n));
        advice_.tried.push_back(mesh);
      }
  }

  void take_mesh_errors() {
    std::vector<double> sizes, values;
    for (const AdvisedMesh& mesh : advice_.tried)
      if (mesh.element == SolidElement::hexahedron) {
        sizes.push_back(mesh.spacing_m);
        values.push_back(mesh.compliance_m_n);
      }
    if (sizes.size() < kFewestMeshes)
      throw InputError("--radius-mm", "is too small for this surface: its lattices are all as fine as the tip, or too large",
                       "a wider tip");
    const Continued continuum = continue_to_no_size(sizes, values, kContactOrder);
    advice_.model_error = continuum.model_error;
    for (AdvisedMesh& mesh : advice_.tried) mesh.mesh_error = continuum.value / mesh.compliance_m_n - 1;
  }

  /// The longest that is true enough, on the coarsest mesh.
  void choose_step() {
    const AdvisedMesh& coarse = advice_.tried.front();
    const auto pushed = [&](double step_s) {
      return push_body(gripped_at_top(scene_of(coarse.element, coarse.spacing_m, step_s), IntegratorKind::automatic, step_s),
                       stopwatch_);
    };
    const std::vector<Vec3> reference = pushed(kStepsS[std::size(kStepsS) - 1] / 4).force;
    for (const double step_s : kStepsS) {
      if (step_s > 1 / request_.rate_hz) continue;
      advice_.step_s = step_s;
      advice_.step_error = relative_rms(pushed(step_s).force, reference);
      says_(fmt::format("steps of {:g} ms: {:.2g} %", 1e3 * step_s, 100 * advice_.step_error));
      if (advice_.step_error <= kStepShare * request_.error) return;
    }
  }

  bool is_true(const AdvisedMesh& mesh) const { return std::abs(mesh.mesh_error) + advice_.step_error <= request_.error; }
  bool is_fast(const AdvisedMesh& mesh) const { return mesh.frame_ms() <= 1e3 * kShareOfFrame / request_.rate_hz; }

  void measure(AdvisedMesh& mesh) const {
    constexpr double kDurationS = 2.5;
    const Scene scene = scene_of(mesh.element, mesh.spacing_m, advice_.step_s);
    for (const Scheme scheme : {Scheme::hyper, Scheme::port}) {
      ReplayOptions options;
      options.scheme = mesh.scheme = scheme;
      options.rate_hz = request_.rate_hz;
      const ServerLoad load = server_load(scene, tools_apart(scene, 1, 0, kDurationS), options, stopwatch_);
      mesh.step_ms = load.step_ms;
      mesh.patch_ms = load.beside_step_ms();
      if (is_fast(mesh)) break;
    }
    says_(fmt::format("{:.3g} mm, {}, {}: {:.1f} ms a frame", 1e3 * mesh.spacing_m, mesh.element_name(), name_of(mesh.scheme),
                      mesh.frame_ms()));
  }

  /// From the fewest nodes on: the first that is true and fast; else, of those that are fast, the truest; else the fastest.
  void choose_mesh() {
    std::vector<std::size_t> order(advice_.tried.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    sort_stably(order.begin(), order.end(),
                [&](std::size_t a, std::size_t b) { return advice_.tried[a].nodes < advice_.tried[b].nodes; });
    std::optional<std::size_t> truest_fast, fastest;
    for (const std::size_t i : order) {
      AdvisedMesh& mesh = advice_.tried[i];
      if (!fastest || is_true(mesh) || is_better(mesh, truest_fast)) measure(mesh);
      if (mesh.frame_ms() == 0) continue;
      if (!fastest || mesh.frame_ms() < advice_.tried[*fastest].frame_ms()) fastest = i;
      if (!is_fast(mesh)) {
        if (mesh.element == SolidElement::hexahedron) break;  // finer ones are slower
        continue;
      }
      if (is_better(mesh, truest_fast)) truest_fast = i;
      if (is_true(mesh)) break;
    }
    advice_.chosen = truest_fast.value_or(fastest.value_or(0));
    advice_.true_enough = is_true(advice_.tried[advice_.chosen]);
    advice_.fast_enough = is_fast(advice_.tried[advice_.chosen]);
  }

  bool is_better(const AdvisedMesh& mesh, const std::optional<std::size_t>& than) const {
    return !than || std::abs(mesh.mesh_error) < std::abs(advice_.tried[*than].mesh_error);
  }

  AdviceRequest request_;
  Stopwatch stopwatch_;
  std::function<void(const std::string&)> says_;
  Eigen::AlignedBox3d box_;
  Advice advice_;
};

}  // namespace

const char* AdvisedMesh::element_name() const { return kSolidElementNames[static_cast<std::size_t>(element)]; }

Continued continue_to_no_size(const std::vector<double>& sizes, const std::vector<double>& values, double order) {
  const auto n = static_cast<Eigen::Index>(sizes.size());
  Eigen::MatrixX2d line(n, 2);
  Eigen::VectorXd y(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    line.row(i) << 1, std::pow(sizes[static_cast<std::size_t>(i)], order);
    y[i] = values[static_cast<std::size_t>(i)];
  }
  const Eigen::Vector2d fit = line.colPivHouseholderQr().solve(y);
  return {fit[0], (line * fit - y).cwiseAbs().maxCoeff() / std::abs(fit[0])};
}

std::string advised_scene(const AdviceRequest& request, const std::string& file, SolidElement element, double spacing_m,
                          double step_s) {
  const Eigen::AlignedBox3d box = box_of(request);
  return fmt::format(R"({{
  "name": "{}",
  "body": {{
    "lattice": {{
      "spacing_m": {:.6g},
      "clip": {{ "mesh": {{ "file": "{}", "scale": {:g} }} }},
      "solid": {{ "element": "{}", "material": "{}" }},
      "fixed_below_z_m": {:.6g}
    }}
  }},
  "solver": {{ "step_ms": {:g} }},
  "tool": {{ "contact": "touch", "radius_m": {:g} }}
}}
)",
                     request.surface.stem().string(), spacing_m, file, request.scale,
                     kSolidElementNames[static_cast<std::size_t>(element)], request.material,
                     box.min().z() + request.held_share * box.sizes().z(), 1e3 * step_s, request.radius_m);
}

Advice advise(const AdviceRequest& request, const Stopwatch& stopwatch, const std::function<void(const std::string&)>& says) {
  return Adviser(request, stopwatch, says).run();
}

}  // namespace palpate
