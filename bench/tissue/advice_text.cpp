#include "bench/tissue/advice_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "server/io/core_share.hpp"

namespace palpate {
namespace {

constexpr double kAlike = 1.05;  // ratio of sides that are called equal
constexpr double kFar = 3;       // times the requested error
constexpr std::size_t kBodiesNamed = 8;

/// Frames a second that the machine keeps: a longer frame has more steps and the same patch.
std::string rate_that_helps(const AdviceRequest& request, const AdvisedMesh& mesh) {
  const double rate_hz = std::floor((1e3 * kShareOfFrame - mesh.step_ms * request.rate_hz) / mesh.patch_ms);
  return rate_hz >= 1 ? fmt::format("--rate-hz {:g} would do", rate_hz)
                      : "no lower --rate-hz helps, as the steps alone are too slow";
}

double missed(const AdvisedMesh& mesh) { return std::abs(mesh.filled_share - 1); }

class Misfits {
 public:
  Misfits(const AdviceRequest& request, const Advice& advice)
      : request_(request), advice_(advice), mesh_(advice.tried[advice.chosen]) {}

  std::vector<std::string> lines() {
    add_cost();
    add_deep();
    add_bodies();
    add_volume();
    if (mesh_.spacing_m > advice_.body.radius_m)
      add("Does not fit: a tip of {:.3g} mm is narrower than the spacing of the nodes and pokes single ones; --radius-mm {:.0f} "
          "would do.",
          1e3 * advice_.body.radius_m, std::ceil(2e3 * mesh_.spacing_m));
    if (advice_.error_known())
      add_error();
    else
      add("The error is not known: it takes {} meshes, and the surface has {}.", kFewestMeshes, advice_.tried.size());
    if (!advice_.step_known) add("The error of the step is not known; no step follows a node that is pulled down by 10 mm.");
    return std::move(lines_);
  }

 private:
  template <typename... Values>
  void add(fmt::format_string<Values...> text, Values&&... values) {
    lines_.push_back(fmt::format(text, std::forward<Values>(values)...));
  }

  void add_cost() {
    const double frame_ms = 1e3 / request_.rate_hz, on_clock_ms = mesh_.frame_ms() / mesh_.core_share;
    if (!advice_.fast_enough)
      add("Does not fit: {:.1f} ms a frame with a hand at {}, more than {:.0f} % of its {:.0f} ms; {}.", mesh_.frame_ms(),
          in_mm(mesh_.worst_place), 100 * kShareOfFrame, frame_ms, rate_that_helps(request_, mesh_));
    if (mesh_.core_share < CoreShare::kStarvedBelow)
      add("The machine is busy: the measurement got {:.0f} % of a core. While that lasts, a frame takes {:.0f} ms on the "
          "clock{}.",
          100 * mesh_.core_share, on_clock_ms, on_clock_ms > frame_ms ? ", and the server skips frames" : "");
  }

  void add_deep() {
    if (mesh_.deep_ms <= 1e3 / request_.rate_hz) return;
    const std::string hand = fmt::format("a hand {:.3g} mm deep at {}", 1e3 * advice_.deep_m, in_mm(mesh_.deep_place));
    if (std::isfinite(mesh_.deep_ms))
      add("Does not fit deep presses: a frame takes up to {:.0f} ms with {}, and the server skips frames.", mesh_.deep_ms, hand);
    else
      add("Does not fit deep presses: no step finds a solution with {}, and the server lets go of it.", hand);
  }

  void add_bodies() {
    const std::vector<double>& bodies_m3 = advice_.body.bodies_m3;
    if (bodies_m3.size() < 2) return;
    std::vector<std::string> volumes;
    for (const double volume_m3 : std::span(bodies_m3).first(std::min(kBodiesNamed, bodies_m3.size())))
      volumes.push_back(fmt::format("{:.3g}", 1e6 * volume_m3));
    if (bodies_m3.size() > kBodiesNamed) volumes.emplace_back("...");
    add("Does not fit: the surface bounds {} bodies that do not meet, of {} ml; a lattice keeps the largest. With a file each "
        "they "
        "can be \"bodies\" of one scene.",
        bodies_m3.size(), fmt::join(volumes, ", "));
  }

  void add_error() {
    if (!advice_.true_enough)
      add("Does not fit: the force is {:.3g} % from the continuum's, {:.3g} % was requested; {}.", 100 * advice_.error(),
          100 * request_.error, what_helps());
    const double worst = mesh_.worst_error + advice_.step_error;
    if (worst > kFar * request_.error)
      add("Does not fit everywhere: the force at {} is {:.0f} % from the continuum's.", in_mm(mesh_.worst_error_place),
          100 * worst);
    if (advice_.model_error > request_.error)
      add("Do not trust the errors: the meshes lie up to {:.0f} % off the model of the error, and {:.3g} % was requested.",
          100 * advice_.model_error, 100 * request_.error);
  }

  std::string what_helps() const {
    std::string help = "no mesh that was tried does; a wider tip (--radius-mm) needs a less fine one";
    for (const AdvisedMesh& mesh : advice_.tried) {
      if (mesh.mesh_error + advice_.step_error > request_.error) continue;
      const std::string spacing = fmt::format("a spacing of {:.2f} mm keeps it", 1e3 * mesh.spacing_m);
      if (missed(mesh) <= missed(mesh_)) return spacing + ", but takes longer";
      help = fmt::format("{}, but has {:.0f} % of the volume", spacing, 100 * mesh.filled_share);
    }
    return help;
  }

  void add_volume() {
    if (mesh_.keeps_volume()) return;
    const auto closest = std::min_element(advice_.tried.begin(), advice_.tried.end(),
                                          [&](const auto& a, const auto& b) { return missed(a) < missed(b); });
    add("Does not fit: the body has {:.0f} % of the volume that the surface encloses; {}the spacing is too coarse for it{}.",
        100 * mesh_.filled_share, mesh_.filled_share < 1 ? "parts that do not hang together with the rest are left out, or " : "",
        missed(*closest) < missed(mesh_)
            ? fmt::format("; {:.2f} mm has {:.0f} %, but takes longer", 1e3 * closest->spacing_m, 100 * closest->filled_share)
            : "");
  }

  const AdviceRequest& request_;
  const Advice& advice_;
  const AdvisedMesh& mesh_;
  std::vector<std::string> lines_;
};

}  // namespace

std::string orientation_in_words(const Vec3& size_m) {
  std::array<int, 3> axes{0, 1, 2};
  std::ranges::sort(axes, [&](int a, int b) { return size_m[a] < size_m[b]; });
  const auto differ = [&](int short_one, int long_one) { return size_m[long_one] > kAlike * size_m[short_one]; };
  std::string text = "z is up";
  if (differ(axes[1], axes[2])) text += fmt::format("; longest along {}", "xyz"[axes[2]]);
  if (!differ(axes[0], axes[1])) return text;
  text += fmt::format("; thinnest along {}", "xyz"[axes[0]]);
  return axes[0] == 2 ? text : text + fmt::format(" (--up {} lays it on its broad side)", "xyz"[axes[0]]);
}

std::string in_mm(const Vec3& place) {
  return fmt::format("({:.0f}, {:.0f}, {:.0f}) mm", 1e3 * place.x(), 1e3 * place.y(), 1e3 * place.z());
}

std::vector<std::string> misfits(const AdviceRequest& request, const Advice& advice) { return Misfits(request, advice).lines(); }

}  // namespace palpate
