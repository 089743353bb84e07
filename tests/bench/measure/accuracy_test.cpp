// Parts of `palpate-lab accuracy`: its motion, and the range over which an error stays small.
#include <catch2/catch.hpp>
#include <filesystem>
#include <limits>
#include <utility>

#include "bench/measure/examination.hpp"
#include "bench/measure/gestures.hpp"
#include "bench/measure/reach.hpp"
#include "common/base/error.hpp"
#include "common/patch/surface.hpp"
#include "server/body/unload.hpp"
#include "server/room/stepped_body.hpp"

using namespace palpate;

namespace {

const std::string kScenes = std::string(PALPATE_SOURCE_DIR) + "/scenes/";

/// Depth of the tool below its start, in the pushing direction [mm].
double depth_mm(const Scene& scene, const Motion& motion, double t_s) {
  return 1e3 * (motion.position(t_s) - motion.position(0.0)).dot(into_body(scene));
}

/// Largest force on the tool between each of the times and the one before it [N], with the server's steps.
std::vector<double> peak_forces_n(const Scene& scene, const Motion& motion, std::initializer_list<double> until_s) {
  constexpr Micros kFrame{50'000}, kSample{1000};
  SteppedBody body(scene);
  body.start(Micros{});
  FrameJob job;
  job.frame = kFrame;
  job.stations.emplace_back().id = 1;
  job.stations[0].scheme = Scheme::hold;
  std::vector<double> peaks;
  for (const double end_s : until_s) {
    double& peak = peaks.emplace_back(0);
    while (job.target < from_seconds(end_s)) {
      job.begin = std::exchange(job.target, job.target + kFrame);
      std::vector<ToolSample>& samples = job.stations[0].samples;
      samples.clear();
      for (Micros t = job.begin; t <= job.target; t += kSample) samples.push_back({t, motion.position(t)});
      body.step(job);
      for (const ToolPort& port : body.ports()) peak = std::max(peak, port.lambda.norm());
    }
  }
  return peaks;
}

}  // namespace

TEST_CASE("The examination presses, strokes, taps and lets go: as deep in a grasp as under a touch, without a jump") {
  const auto* const file = GENERATE("cube6.json", "sheet13.json", "touch-cube.json");
  const Scene scene = load_scene(kScenes + file);
  const Motion motion = examination(scene);
  const double gap_mm = scene.tool.contact == ContactKind::touch ? 1e3 * kGapM : 0;
  CHECK(depth_mm(scene, motion, 0.5) == Approx(10 + gap_mm));
  CHECK(depth_mm(scene, motion, 2.0) == Approx(6 + 0.6 * gap_mm));
  CHECK(1e3 * (motion.position(2.0) - motion.position(0.0)).x() == Approx(15));
  for (const double between_s : {1.2, 3.0, 4.0}) CHECK(depth_mm(scene, motion, between_s) == Approx(0).margin(1e-6));
  int taps = 0;
  for (int ms = 3001; ms < 4000; ++ms) {
    const double before = depth_mm(scene, motion, 1e-3 * (ms - 1)), at = depth_mm(scene, motion, 1e-3 * ms),
                 after = depth_mm(scene, motion, 1e-3 * (ms + 1));
    taps += at > before && at >= after && at > 5;
  }
  CHECK(taps == 3);
  CHECK(depth_mm(scene, motion, 4.6) < -3);  // it swings past its start
  for (Micros t{}; t < motion.duration(); t += Micros{1000})
    CHECK((motion.position(t + Micros{1000}) - motion.position(t)).norm() < 0.5e-3);
}

TEST_CASE("Press and stroke of the examination meet every organ, and every scene of the project that has a point for a tool") {
  for (const std::string folder : {"", "organs/", "needles/", "parts/", "cuts/"})
    for (const auto& file : std::filesystem::directory_iterator(kScenes + folder)) {
      if (file.path().extension() != ".json") continue;
      const Scene scene = open_scene(file.path().string());
      if (scene.tool.contact != ContactKind::touch || scene.tool.has_body() || !scene.tool.holds.empty()) continue;
      INFO(file.path().string());
      for (const double peak_n : peak_forces_n(scene, examination(scene), {1.2, 3.0})) CHECK(peak_n > 0.01);
    }
}

TEST_CASE("Places of an examination are drawn on the surface, go straight in, and are the same of the same scene") {
  const Scene scene = load_scene(kScenes + "organ.json");
  const std::vector<ExaminedPlace> places = drawn_places(scene, 6), fewer = drawn_places(scene, 3);
  const Surface surface(scene.body.triangles, scene.body.nodes.size());
  const Positions rest{scene.body.nodes.front().data(), 3 * scene.body.nodes.size()};
  REQUIRE(places.size() == 6);
  for (std::size_t k = 0; k < places.size(); ++k) {
    const ExaminedPlace& place = places[k];
    CHECK(place.into.norm() == Approx(1));
    CHECK(place.aside.norm() == Approx(1));
    CHECK(place.into.dot(place.aside) == Approx(0).margin(1e-12));
    CHECK(nearest_point(surface.view(), rest, place.start).height_m == Approx(kGapM));
    const Motion motion = examination(scene, place);
    const NearestPoint deepest = nearest_point(surface.view(), rest, motion.position(0.5));
    CHECK(deepest.height_m < 0);
    CHECK((motion.position(0.5) - place.start).dot(place.into) == Approx(0.010 * place.scale + kGapM));
    if (k < fewer.size()) CHECK(fewer[k].start == place.start);
  }
}

TEST_CASE("A plate is not examined deeper than a quarter of its thickness, and a scene that is grasped has no places") {
  const Scene plate = read_scene(R"({"name": "plate", "body": {"lattice": {"nodes": [9, 9, 3], "size_m": [0.1, 0.1, 0.012],
    "solid": {"material": "liver"}, "fixed_faces": ["x-"]}}, "tool": {"contact": "touch", "radius_m": 0.012}})",
                                 "plate");
  for (const ExaminedPlace& place : drawn_places(plate, 4))
    if (std::abs(place.into.z()) > 0.99) CHECK(0.010 * place.scale == Approx(0.003));
  CHECK(0.010 * top_of(plate).scale == Approx(0.003));
  CHECK_THROWS_AS(drawn_places(load_scene(kScenes + "cube6.json"), 1), InputError);
}

TEST_CASE("An error's reach ends before the first point that is too large, whatever comes after it") {
  CHECK(reach({{0, 0.01}, {50, 0.02}, {100, 0.2}, {150, 0.03}}, 0.1) == 50);
  CHECK(reach({{150, 0.03}, {0, 0.01}, {50, 0.02}}, 0.1) == 150);
  CHECK(reach({{0, 0.1}, {50, 0.01}}, 0.1) == -1);
  CHECK(reach({{0, 0.01}, {50, std::numeric_limits<double>::quiet_NaN()}}, 0.1) == 0);
  CHECK(reach({}, 0.1) == -1);
}
