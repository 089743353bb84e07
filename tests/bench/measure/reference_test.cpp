// The reference force against an independent explicit integrator, and the figures of fidelity for constructed signals.
#include "bench/fidelity/reference.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "bench/fidelity/metrics.hpp"
#include "common/motion/motion.hpp"

using namespace palpate;

namespace {

const std::string kSource = PALPATE_SOURCE_DIR;

std::vector<Vec3> path(int ms) {
  const Motion motion = read_motion(kSource + "/scenes/motions/base-excursion.csv");
  std::vector<Vec3> positions;
  for (int i = 0; i <= ms; ++i) positions.push_back(motion.position(i * 1e-3));
  return positions;
}

/// Velocity Verlet with linear springs and dampers, coded independently; the tool's node follows the path.
std::vector<Vec3> explicit_force(const Scene& scene, const std::vector<Vec3>& path) {
  constexpr int kSubSteps = 50;
  constexpr double kStepS = 1e-3 / kSubSteps;
  const LumpedBody& body = scene.body;
  std::vector<Vec3> x = body.nodes, v(x.size(), Vec3::Zero()), f(x.size());
  const auto compute = [&] {
    for (Vec3& force : f) force.setZero();
    for (const Element& e : body.elements) {
      const Vec3 d = x[e.b] - x[e.a];
      const double length = d.norm();
      const Vec3 n = d / length;
      const double pull = e.stiffness_n_m * (length - e.rest_length_m) + e.damping_n_s_m * n.dot(v[e.b] - v[e.a]);
      f[e.a] += pull * n;
      f[e.b] -= pull * n;
    }
  };
  std::vector<Vec3> felt{Vec3::Zero()};
  compute();
  for (std::size_t ms = 1; ms < path.size(); ++ms) {
    const Vec3 speed = (path[ms] - path[ms - 1]) / 1e-3;
    for (int step = 1; step <= kSubSteps; ++step) {
      for (std::size_t i = 0; i < x.size(); ++i) {
        if (body.fixed[i] || i == scene.tool.node) continue;
        v[i] += 0.5 * kStepS / body.masses_kg[i] * f[i];
        x[i] += kStepS * v[i];
      }
      x[scene.tool.node] = path[ms - 1] + (step * kStepS) * speed;
      v[scene.tool.node] = speed;
      compute();
      for (std::size_t i = 0; i < x.size(); ++i)
        if (!body.fixed[i] && i != scene.tool.node) v[i] += 0.5 * kStepS / body.masses_kg[i] * f[i];
    }
    compute();
    felt.push_back(f[scene.tool.node]);
  }
  return felt;
}

std::vector<Vec3> wave(double amplitude, int delay_ms) {
  std::vector<Vec3> signal;
  for (int i = 0; i < 3000; ++i) {
    const double t = 1e-3 * (i - delay_ms);
    signal.push_back(amplitude * Vec3(std::sin(9 * t), std::cos(5 * t), std::sin(3 * t + 1)));
  }
  return signal;
}

}  // namespace

TEST_CASE("The reference force is that of an explicit integration at a fiftieth of its step") {
  const Scene scene = load_scene(kSource + "/scenes/cube6.json");
  const auto positions = path(500);
  const ReferenceForce reference = reference_force(scene, positions);
  const std::vector<Vec3> own = explicit_force(scene, positions);
  REQUIRE(reference.force.size() == own.size());
  const Fidelity fidelity = compare(reference.force, own, 0);
  INFO(fidelity.snr_db << " dB, relative " << fidelity.rel_rms);
  CHECK(fidelity.rel_rms < 0.01);
  CHECK(fidelity.lag_ms == 0);
  CHECK(reference.force.back().norm() > 0.5);
}

TEST_CASE("A touch that never meets the body is no force and no contact") {
  const Scene scene = load_scene(kSource + "/scenes/touch-cube.json");
  const ReferenceForce reference = reference_force(scene, std::vector<Vec3>(20, Vec3(0.05, 0.05, 0.2)));
  for (std::size_t i = 0; i < reference.force.size(); ++i) CHECK((reference.force[i].norm() == 0 && !reference.contact[i]));
  CHECK(reference_force(scene, {}).force.empty());
}

TEST_CASE("Fidelity is what its formulas say") {
  const auto reference = wave(1, 0);
  CHECK(compare(reference, reference, 100).snr_db == kSnrCeilingDb);
  const Fidelity scaled = compare(wave(1.1, 0), reference, 0);
  CHECK(scaled.rel_rms == Approx(0.1));
  CHECK(scaled.p95_rel_error == Approx(0.1));
  CHECK(scaled.lag_ms == 0);
  const auto late = wave(1, 37);
  CHECK(compare(late, reference, 0).lag_ms == 37);
  auto jump = reference;
  for (std::size_t i = 1500; i < jump.size(); ++i) jump[i].x() += 2;
  CHECK(compare(jump, reference, 0).force_step_max_n == Approx(2).margin(0.02));
  // Zero mean, and an error of a tenth in one of two samples of the same size.
  const std::vector<Vec3> r{Vec3(1, 0, 0), Vec3(-1, 0, 0)}, f{Vec3(1.1, 0, 0), Vec3(-1, 0, 0)};
  CHECK(compare(f, r, 0).snr_db == Approx(10 * std::log10(2 / 0.01)));
  CHECK(percentile({3, 1, 2}, 0.5) == 2);
  CHECK(percentile({3, 1, 2}, 1) == 3);
  CHECK(percentile({}, 0.5) == 0);
}
