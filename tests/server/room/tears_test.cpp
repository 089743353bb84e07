// Tears in a room: without a jump, closed, taken up again. Closed forms: tests/bench/tissue/surgery_test.cpp.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "common/base/error.hpp"
#include "common/base/random.hpp"
#include "server/room/stepped_body.hpp"
#include "server/scene/surface.hpp"

using namespace palpate;

TEST_CASE("Tissue that is pulled anyhow tears without a jump, and leaves what is held, closed", "[tears]") {
  int torn = 0;
  for (std::uint64_t seed = 1; seed <= 24; ++seed) {
    INFO("seed " << seed);
    Random random(seed);
    const auto in = [&](double low, double high) { return low + (high - low) * random.uniform(); };
    const Vec3 from(in(0, 0.06), in(0, 0.04), 0.05), way(in(-0.05, 0.05), in(-0.05, 0.05), in(-0.02, 0.02));
    const Vec3 down(in(-0.7, 0.7), in(-0.7, 0.7), -1), to = from + way;
    const std::string text = fmt::format(
        R"({{"body": {{"lattice": {{"nodes": [7, 5, 5], "size_m": [0.06, 0.04, 0.04], "fixed_faces": ["z-"],
        "solid": {{"element": "{}", "young_pa": 8000, "poisson": 0.4, "damping_s": 0.01{}}}}},
        "cuts": [{{"path": [{{"at_m": [{}, {}, {}]}}, {{"at_m": [{}, {}, {}]}}], "direction": [{}, {}, {}], "depth_m": 0.025}}],
        "tissue": [{{"toughness_j_m2": 1}}], "tears": true}}, "tool": {{"contact": "attach"}}}})",
        seed % 2 == 0 ? "hexahedron" : "tetrahedron", seed % 3 == 0 ? R"(, "relaxation": [{"share": 0.3, "time_s": 0.2}])" : "",
        from.x(), from.y(), from.z(), to.x(), to.y(), to.z(), down.x(), down.y(), down.z());
    std::optional<Scene> scene;
    try {
      scene = read_scene(text, "drawn");
    } catch (const InputError&) {
      continue;  // it crosses nothing
    }
    SteppedBody body(*scene);
    Micros now{3'000'000};
    const Micros begin = now;
    body.start(now);
    const Vec3 grasped = scene->body.nodes[scene->tool.node], pull(in(-0.05, 0.05), in(-0.05, 0.05), in(0.02, 0.05));
    for (int k = 0; k < 60; ++k) {
      FrameJob job;
      job.target = now + Micros{30'000};
      StationJob hand;
      hand.id = 1;
      for (Micros t = now; t <= job.target + Micros{1000}; t += Micros{1000})
        hand.samples.push_back({t, grasped + std::min(seconds(t - begin), 1.0) * pull});
      job.stations.push_back(hand);
      now = job.target;
      const double mass = body.dynamics().masses().sum();
      body.step(job);
      REQUIRE(body.state().x.allFinite());
      if (!body.parted()) continue;
      ++torn;
      CHECK(body.parted()->loose == 0);
      CHECK(std::abs(body.dynamics().masses().sum() - mass) <= 1e-12 * mass);
      CHECK(check_edges(body.scene().body.triangles).closed());
    }
  }
  CHECK(torn > 20);
}

TEST_CASE("A grasp tears the slab of the scene open, without a step of its force, and others take the tear up", "[tears]") {
  const Scene scene = load_scene(std::filesystem::path(PALPATE_SOURCE_DIR) / "scenes/cuts/tear.json");
  SteppedBody body(scene);
  CHECK(body.integrator().reason.find("a tear is for implicit steps") != std::string::npos);
  Micros now{3'000'000};
  const Micros begin = now;
  body.start(now);
  const Vec3 grasped = scene.body.nodes[scene.tool.node];
  const double mass = body.dynamics().masses().sum();
  std::vector<Vec3> force;
  std::vector<std::size_t> torn;
  for (int k = 0; k < 250; ++k) {
    FrameJob job;
    job.target = now + Micros{20'000};
    StationJob hand;
    hand.id = 1;
    for (Micros t = now; t <= job.target + Micros{1000}; t += Micros{1000})
      hand.samples.push_back({t, grasped + Vec3(0.3, 0, 1) * 0.015 * std::min(seconds(t - begin), 4.0)});
    job.stations.push_back(hand);
    now = job.target;
    const auto report = body.step(job);
    REQUIRE(report);
    REQUIRE(report->converged);
    force.push_back(body.ports().front().lambda);
    if (!body.parted()) continue;
    torn.push_back(force.size() - 1);
    CHECK(body.parted()->loose == 0);
    CHECK(body.dynamics().masses().sum() == Approx(mass).epsilon(1e-12));
    CHECK(check_edges(body.scene().body.triangles).closed());
  }
  REQUIRE(torn.size() >= 3);
  double most_n = 0;
  for (const std::size_t k : torn)
    if (k + 1 < force.size()) most_n = std::max(most_n, (force[k + 1] - force[k]).norm());
  CAPTURE(torn.size(), force.back().norm());
  CHECK(most_n < 0.05);

  SteppedBody other(scene);
  REQUIRE(other.cut_again(*body.cuts()));
  CHECK(other.dynamics().masses() == body.dynamics().masses());
  CHECK(other.scene().body.triangles == body.scene().body.triangles);
  CHECK(other.resume(body.state().x, body.state().v, {}));
  FrameJob job;
  job.target = now + Micros{50'000};
  job.reset = true;
  body.step(job);
  CHECK(body.scene().body.triangles == scene.body.triangles);
  CHECK((body.state().x - body.rest().x).norm() < 1e-9);
}

TEST_CASE("A body that is torn fast tears by several rows in a frame, whose change leads from its nodes before to those after",
          "[tears]") {
  const Scene scene = load_scene(std::filesystem::path(PALPATE_SOURCE_DIR) / "scenes/cuts/tear.json");
  const Vec3 grasped = scene.body.nodes[scene.tool.node];
  SteppedBody body(scene);
  const Micros begin{3'000'000};
  body.start(begin);
  const Micros frame{50'000};
  int most = 0;
  for (Micros now = begin; now < begin + Micros{800'000}; now += frame) {
    FrameJob job;
    job.target = now + frame;
    StationJob hand;
    hand.id = 1;
    for (Micros t = now; t <= job.target + Micros{1000}; t += Micros{1000})
      hand.samples.push_back({t, grasped + Vec3(0.3, 0, 1) * 0.2 * seconds(t - begin)});
    job.stations.push_back(hand);
    const std::uint32_t epoch = body.epoch();
    const std::vector<Vec3> rest = body.scene().body.nodes;
    const double mass = body.dynamics().masses().sum();
    body.step(job);
    if (!body.parted()) continue;
    most = std::max(most, static_cast<int>(body.epoch() - epoch));
    CHECK(body.dynamics().masses().sum() == Approx(mass).epsilon(1e-12));
    REQUIRE(body.parted()->node_before.size() == body.dynamics().nodes());
    for (std::uint32_t k = 0; k < body.dynamics().nodes(); ++k)
      REQUIRE(body.scene().body.nodes[k] == rest[body.parted()->node_before[k]]);
  }
  CHECK(most >= 2);
}
