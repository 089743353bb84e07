// Models without omissions: where they are exact, they equal the reference.
#include "bench/measure/local_model.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "bench/fidelity/replay.hpp"

using namespace palpate;

namespace {

Scene scene_named(const std::string& name) { return load_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/" + name + ".json"); }

/// In and out and sideways at 2 Hz, at most `deep_m` deep, from `above_m` above the place where the tool is coupled.
Motion wave(const Vec3& from, double deep_m, double above_m, double until_s) {
  std::vector<MotionPoint> points;
  for (int ms = 0; ms <= std::lround(1e3 * until_s); ++ms) {
    const double phase = 2 * std::numbers::pi * 2 * 1e-3 * ms, in = 0.5 * (1 - std::cos(phase));
    points.push_back({1e-3 * ms, from + Vec3(0.2 * deep_m * in * std::sin(phase), 0, above_m - (deep_m + above_m) * in)});
  }
  return Motion(std::move(points));
}

ReplayResult with_starts(Scene scene, const Motion& motion, int round_trip_ms) {
  scene.solver.step_s = 0.0005;
  ReplayOptions options;
  options.scheme = Scheme::hyper;
  options.link.latency = Micros{500 * round_trip_ms};
  options.keep_starts = true;
  return replay(scene, motion, options, [] { return std::int64_t{0}; });
}

double db_of(ReplayResult run, const Scene& scene, LocalModel model) {
  replace_patches(run, scene, model);
  return run.fidelity.snr_db;
}

}  // namespace

TEST_CASE("Over small motions a body linearised where it was is the body, grasped and touched") {
  const Scene grasped = scene_named("cube6");
  const ReplayResult grasp = with_starts(grasped, wave(home_of(grasped), 5e-5, 0, 0.7), 100);
  CHECK(db_of(grasp, grasped, LocalModel::whole_linear) > 45);
  const Scene touched = scene_named("touch-cube");
  const Vec3 surface = home_of(touched) - Vec3(0, 0, 0.020);
  const ReplayResult touch = with_starts(touched, wave(surface, 2e-4, 1e-4, 0.7), 100);
  CHECK(db_of(touch, touched, LocalModel::whole_linear) > 35);
}

TEST_CASE("Where hyper fell back there are no modes to put full forces on, and what was felt stays") {
  Scene scene = scene_named("cube6");
  scene.body.law = SpringLaw::thigh_skin;  // a law without a series
  ReplayResult run = with_starts(scene, wave(home_of(scene), 0.004, 0, 0.4), 50);
  REQUIRE(run.last_patch.scheme == Scheme::port);
  REQUIRE(!run.starts.empty());
  const ReplayResult before = run;
  replace_patches(run, scene, LocalModel::full_forces);
  CHECK(run.fidelity.snr_db == before.fidelity.snr_db);
  for (std::size_t i = 0; i < run.ticks.size(); ++i) CHECK(run.ticks[i].felt == before.ticks[i].felt);
}

TEST_CASE("Over large motions the body's own forces on all of its modes are the body, and its linearisation is not") {
  Scene scene = scene_named("cube6");
  const double damping = GENERATE(1.0, 3.0);  // in the second case rotating dampers need more steps than springs
  for (Element& e : scene.body.elements) e.damping_n_s_m *= damping;
  ReplayResult run = with_starts(scene, wave(home_of(scene), 0.008, 0, 0.7), 100);
  const double few = db_of(run, scene, LocalModel::full_forces), linear = db_of(run, scene, LocalModel::whole_linear);
  const auto n = static_cast<Eigen::Index>(scene.body.nodes.size());
  for (LocalStart& start : run.starts) {
    start.modes = Matrix::Zero(3 * n, 3 * n);
    for (Eigen::Index i = 0; i < n; ++i)
      if (!scene.body.fixed[static_cast<std::size_t>(i)] && i != static_cast<Eigen::Index>(scene.tool.node))
        for (Eigen::Index axis = 0; axis < 3; ++axis)
          start.modes(3 * i + axis, 3 * i + axis) = 1 / std::sqrt(scene.body.masses_kg[static_cast<std::size_t>(i)]);
  }
  const double all = db_of(run, scene, LocalModel::full_forces);
  INFO(all << " dB on all modes, " << few << " on those of the patches, " << linear << " linear");
  CHECK(all > 50);
  CHECK(few < all + 1);
  CHECK(linear < few - 10);
}

TEST_CASE("Dampers that brake faster than any step turn with the body in full forces") {
  Scene scene = scene_named("cube6");
  for (Element& e : scene.body.elements) e.damping_n_s_m *= 40;
  const ReplayResult run = with_starts(scene, wave(home_of(scene), 0.008, 0, 0.7), 100);
  CHECK(db_of(run, scene, LocalModel::full_forces) > 50);  // 35 with dampers as at the stamp
}
