#include "bench/tissue/advice.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "bench/measure/pushed_cube.hpp"
#include "bench/tissue/advice_text.hpp"
#include "bench/tissue/advised_body.hpp"
#include "bench/tissue/touch_compliance.hpp"
#include "common/base/error.hpp"
#include "server/body/surface_stiffness.hpp"
#include "server/body/touch_places.hpp"
#include "server/core/frame_budget.hpp"
#include "server/room/room.hpp"

namespace palpate {
namespace {

constexpr double kNodes[] = {250, 400, 650, 1000, 1500};  // coarse to fine
constexpr double kStepsS[] = {0.050, 0.025, 0.010, 0.005};
constexpr double kStepShare = 0.25;  // share of the allowed error
constexpr double kNever = std::numeric_limits<double>::infinity();

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Returns the message about a scene in memory without the place in the scene's text.
std::string without_place(const std::string& message, const std::string& file) {
  const auto end = message.find(": ", file.size());
  return message.starts_with(file + ':') && end != std::string::npos ? message.substr(end + 2) : message;
}

class Adviser {
 public:
  Adviser(const AdviceRequest& request, const Stopwatch& stopwatch, const AdviceHearer& hearer)
      : request_(request), stopwatch_(stopwatch), says_(hearer.says) {
    advice_.body = advised_body(request);
    hearer.body(advice_.body);
  }

  Advice run() {
    add_meshes();
    take_mesh_errors();
    choose_step();
    choose_mesh();
    refuse_unsolved();
    press_deep();
    return std::move(advice_);
  }

 private:
  Scene scene_of(double spacing_m) const {
    const auto file = std::filesystem::absolute(request_.surface);
    return read_scene(advised_scene(request_, advice_.body, file.filename().string(), spacing_m, advice_.step_s), file.string(),
                      {file.parent_path()});
  }

  void add_meshes() {
    std::string refused;
    const auto refuse = [&](double spacing_m, const std::string& reason) {
      refused = reason;
      says_(fmt::format("{:.3g} mm: {}", 1e3 * spacing_m, reason));
    };
    double before_m = kNever;
    for (const double nodes : kNodes) {
      const double spacing_m = spacing_for(advice_.body, nodes);
      if (spacing_m > 0.95 * before_m) continue;  // both as coarse as the shape allows
      before_m = spacing_m;
      try {
        add_scene(spacing_m);
      } catch (const InputError& error) {
        refuse(spacing_m, without_place(error.what(), std::filesystem::absolute(request_.surface).string()));
      }
    }
    take_compliances(refuse);
    if (!scenes_.empty()) return;
    const Vec3 mm = 1e3 * advice_.body.size_m;
    throw InputError("--surface " + request_.surface.string(),
                     fmt::format("makes no body of {:.3g} x {:.3g} x {:.3g} mm: {}", mm.x(), mm.y(), mm.z(),
                                 refused.substr(0, refused.find("; expected "))),
                     "a thicker or another surface, --scale or --held");
  }

  void add_scene(double spacing_m) {
    Scene scene = scene_of(spacing_m);
    if (scene.body.nodes.size() > kTimedNodesMost)
      throw InputError(request_.surface.string(),
                       fmt::format("a body as thin as this has {} nodes at the widest spacing, too many for a live room",
                                   scene.body.nodes.size()),
                       fmt::format("at most {}", kTimedNodesMost));
    AdvisedMesh mesh;
    mesh.spacing_m = spacing_m;
    mesh.nodes = scene.body.nodes.size();
    mesh.held = static_cast<std::size_t>(std::ranges::count_if(scene.body.fixed, [](auto f) { return f != 0; }));
    mesh.cells = scene.body.hexahedra.size();
    mesh.filled_share = 1 - scene.body.left_out_share;
    advice_.tried.push_back(mesh);
    scenes_.push_back(std::move(scene));
  }

  /// Takes the compliances of all meshes, at places of the finest; drops meshes without an equilibrium.
  void take_compliances(const std::function<void(double spacing_m, const std::string& reason)>& refuse) {
    if (scenes_.empty()) return;
    const Vec3 home = home_of(scenes_.back());
    places_ = touch_places(scenes_.back().body, home, kPlaces);
    compared_ = compared_places(scenes_.back(), advice_.body.held_below_m, home, kPlaces);
    for (std::size_t i = 0; i < scenes_.size();) {
      AdvisedMesh& mesh = advice_.tried[i];
      mesh.compliances_m_n = touch_compliances(scenes_[i], compared_);
      if (mesh.compliances_m_n.empty()) {
        refuse(mesh.spacing_m,
               fmt::format("the body has no equilibrium, as {} of its {} nodes being held is too few for all of it; "
                           "expected a larger --held",
                           mesh.held, mesh.nodes));
        scenes_.erase(scenes_.begin() + static_cast<std::ptrdiff_t>(i));
        advice_.tried.erase(advice_.tried.begin() + static_cast<std::ptrdiff_t>(i));
        continue;
      }
      says_(fmt::format("{:.3g} mm: {} nodes, {} held, {:.3g} mm/N", 1e3 * mesh.spacing_m, mesh.nodes, mesh.held,
                        1e3 * median(mesh.compliances_m_n)));
      ++i;
    }
  }

  void take_mesh_errors() {
    std::vector<std::vector<double>> errors(advice_.tried.size());
    std::vector<double> model_errors;
    for (std::size_t place = 0; place < advice_.tried.front().compliances_m_n.size(); ++place) {
      std::vector<double> sizes, values;
      for (const AdvisedMesh& mesh : advice_.tried) {
        sizes.push_back(mesh.spacing_m);
        values.push_back(mesh.compliances_m_n[place]);
      }
      // With too few meshes there is no extrapolation: the finest stands for the continuum, with unknown error.
      Continued continuum{values.back(), 1};
      if (sizes.size() >= kFewestMeshes) continuum = continue_to_no_size(sizes, values, kContactOrder);
      model_errors.push_back(continuum.model_error);
      for (std::size_t i = 0; i < errors.size(); ++i) errors[i].push_back(std::abs(continuum.value / values[i] - 1));
    }
    advice_.model_error = model_errors.front();
    for (std::size_t i = 0; i < errors.size(); ++i) {
      advice_.tried[i].mesh_error = errors[i].front();
      const auto worst = std::ranges::max_element(errors[i]);
      advice_.tried[i].worst_error = *worst;
      advice_.tried[i].worst_error_place = compared_[static_cast<std::size_t>(worst - errors[i].begin())].place;
    }
  }

  /// Chooses the longest step that is accurate enough, on the coarsest mesh.
  void choose_step() {
    const auto pushed = [&](double step_s) -> std::vector<Vec3> {
      try {
        return push_body(gripped_at_top(scenes_.front(), IntegratorKind::automatic, step_s), stopwatch_).force;
      } catch (const std::runtime_error&) {  // no solution was found
        return {};
      }
    };
    const std::vector<Vec3> reference = pushed(kStepsS[std::size(kStepsS) - 1] / 4);
    if (reference.empty()) return;
    for (const double step_s : kStepsS) {
      if (step_s > 1 / request_.rate_hz) continue;
      const std::vector<Vec3> force = pushed(step_s);
      if (force.empty()) continue;
      advice_.step_known = true;
      advice_.step_s = step_s;
      advice_.step_error = relative_rms(force, reference);
      says_(fmt::format("steps of {:g} ms: {:.2g} %", 1e3 * step_s, 100 * advice_.step_error));
      if (advice_.step_error <= kStepShare * request_.error) return;
    }
  }

  bool is_true(const AdvisedMesh& mesh) const {
    return advice_.error_known() && mesh.mesh_error + advice_.step_error <= request_.error;
  }
  /// A tip narrower than the spacing presses on single nodes.
  bool tip_fits(const AdvisedMesh& mesh) const { return mesh.spacing_m <= advice_.body.radius_m; }
  double most_ms() const { return 1e3 * kShareOfFrame / request_.rate_hz; }
  bool is_fast(const AdvisedMesh& mesh) const { return mesh.frame_ms() <= most_ms(); }

  /// A fast mesh is better than a slow one; of fast ones, that with the smaller `off`, the larger of its error and its missed
  /// volume; of slow ones, the fastest.
  bool is_better(const AdvisedMesh& a, const AdvisedMesh& b) const {
    if (is_fast(a) != is_fast(b)) return is_fast(a);
    if (!is_fast(a)) return a.frame_ms() < b.frame_ms();
    const auto off = [](const AdvisedMesh& mesh) { return std::max(mesh.mesh_error, std::abs(mesh.filled_share - 1)); };
    return off(a) < off(b);
  }

  /// Measures with a hand at each of these places, up to one at which a frame takes longer than it lasts; the slowest counts,
  /// together with earlier measurements.
  void measure(std::size_t i, const std::vector<Vec3>& places) {
    AdvisedMesh& mesh = advice_.tried[i];
    Scene& scene = scenes_[i];
    scene.solver.step_s = advice_.step_s;
    for (const SurfaceStiffness& place : finger_stiffnesses(scene, places)) {
      if (mesh.frame_ms() > 1e3 / request_.rate_hz) break;
      const std::optional<FrameCost> cost = frame_cost(scene, place, request_.rate_hz, stopwatch_);
      const Scheme scheme = cost ? served_scheme(*cost, request_.rate_hz) : Scheme::port;
      const double frame_ms = cost ? cost->ms(scheme, 1) : kNever;
      if (frame_ms <= mesh.frame_ms()) continue;
      mesh.scheme = scheme;
      mesh.step_ms = cost ? cost->step_ms : kNever;
      mesh.patch_ms = cost ? frame_ms - cost->step_ms : 0;
      mesh.core_share = cost ? cost->core_share : 1;
      mesh.worst_place = place.place;
    }
    says_(fmt::format("{:.3g} mm, {}: {:.1f} ms a frame", 1e3 * mesh.spacing_m, name_of(mesh.scheme), mesh.frame_ms()));
  }

  /// Measures the coarsest mesh at all places; finer ones, while they are fast and not yet good enough, where that one took
  /// longest. The best of those is measured at all places before it is chosen.
  void choose_mesh() {
    std::vector<AdvisedMesh>& tried = advice_.tried;
    const auto fits = [&](const AdvisedMesh& mesh) { return is_true(mesh) && tip_fits(mesh) && mesh.keeps_volume(); };
    measure(0, places_);
    std::size_t last = 0;
    while (last + 1 < tried.size() && is_fast(tried[last]) && !fits(tried[last])) measure(++last, {tried.front().worst_place});
    const auto end = tried.begin() + static_cast<std::ptrdiff_t>(last) + 1;
    while (true) {
      const auto best = std::min_element(tried.begin(), end, [&](const auto& a, const auto& b) { return is_better(a, b); });
      advice_.chosen = static_cast<std::size_t>(best - tried.begin());
      if (advice_.chosen == 0 || !is_fast(*best)) break;
      measure(advice_.chosen, places_);
      if (is_fast(*best)) break;
    }
    advice_.true_enough = is_true(tried[advice_.chosen]);
    advice_.fast_enough = is_fast(tried[advice_.chosen]);
  }

  void refuse_unsolved() const {
    const AdvisedMesh& mesh = advice_.tried[advice_.chosen];
    if (std::isfinite(mesh.frame_ms())) return;
    throw InputError("--surface " + request_.surface.string(),
                     fmt::format("makes a body of {} nodes for which no step finds a solution with a hand at {}", mesh.nodes,
                                 in_mm(mesh.worst_place)),
                     "a thicker surface, a stiffer --material or a larger --held");
  }

  /// Measures deep presses into the chosen mesh, if it keeps the rate.
  void press_deep() {
    AdvisedMesh& mesh = advice_.tried[advice_.chosen];
    if (!is_fast(mesh)) return;
    const Scene& scene = scenes_[advice_.chosen];
    advice_.deep_m = std::min(kDeepestM, 0.5 * advice_.body.size_m.minCoeff());
    for (const SurfaceStiffness& place : finger_stiffnesses(scene, places_)) {
      const std::optional<FrameCost> cost = frame_cost(scene, place, request_.rate_hz, stopwatch_, advice_.deep_m);
      const double frame_ms = cost ? cost->ms(mesh.scheme, 1) - cost->step_ms + cost->step_most_ms : kNever;
      if (frame_ms <= mesh.deep_ms) continue;
      mesh.deep_ms = frame_ms;
      mesh.deep_place = place.place;
    }
    says_(fmt::format("{:.3g} mm, {:.3g} mm deep: {:.1f} ms a frame", 1e3 * mesh.spacing_m, 1e3 * advice_.deep_m, mesh.deep_ms));
  }

  AdviceRequest request_;
  Stopwatch stopwatch_;
  std::function<void(const std::string&)> says_;
  std::vector<Scene> scenes_;          ///< of the meshes in advice_.tried
  std::vector<PushedPlace> compared_;  ///< places at which the meshes are compared
  std::vector<Vec3> places_;           ///< of hands whose cost is measured
  Advice advice_;
};

}  // namespace

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

Scheme served_scheme(const FrameCost& cost, double rate_hz) {
  return cost.ms(Scheme::hyper, 1) <= 1e3 * FrameBudget::kSchemesMayTake / rate_hz ? Scheme::hyper : Scheme::port;
}

std::string advised_scene(const AdviceRequest& request, const AdvisedBody& body, const std::string& file, double spacing_m,
                          double step_s) {
  return fmt::format(R"({{
  "name": "{}",
  "body": {{
    "lattice": {{
      "spacing_m": {:.6g},
      "clip": {{
        "mesh": {{ "file": "{}", "scale": {:g}, "rotation_deg": [{:g}, {:g}, {:g}], "offset_m": [{:.6g}, {:.6g}, {:.6g}] }}
      }},
      "solid": {{ "material": "{}" }},
      "fixed_below_z_m": {:.6g}
    }}
  }},
  "solver": {{ "step_ms": {:g} }},
  "tool": {{ "contact": "touch", "radius_m": {:g} }}
}}
)",
                     request.surface.stem().string(), spacing_m, file, request.scale, body.rotation_deg.x(),
                     body.rotation_deg.y(), body.rotation_deg.z(), body.offset_m.x(), body.offset_m.y(), body.offset_m.z(),
                     request.material, body.held_below_m, 1e3 * step_s, body.radius_m);
}

Advice advise(const AdviceRequest& request, const Stopwatch& stopwatch, const AdviceHearer& hearer) {
  return Adviser(request, stopwatch, hearer).run();
}

}  // namespace palpate
