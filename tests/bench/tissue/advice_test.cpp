// Proposals of palpate-lab advise: a scene that loads, costs as measured, errors against a finer mesh.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "bench/tissue/advice_text.hpp"
#include "bench/tissue/advised_body.hpp"
#include "bench/tissue/touch_compliance.hpp"
#include "common/base/error.hpp"
#include "server/body/surface_stiffness.hpp"
#include "server/room/room.hpp"

using namespace palpate;
using Catch::Matchers::Contains;

namespace {

/// A box in millimetres, as OBJ, in its own folder.
std::filesystem::path box_surface(const std::string& folder, const Vec3& size_mm = {60, 50, 40}) {
  const auto place = std::filesystem::temp_directory_path() / ("palpate-advice-" + folder);
  std::filesystem::create_directories(place);
  std::ofstream file(place / "box.obj");
  for (int i = 0; i < 8; ++i)
    file << fmt::format("v {} {} {}\n", i & 1 ? size_mm.x() : 0, i & 2 ? size_mm.y() : 0, i & 4 ? size_mm.z() : 0);
  file << "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
  return place / "box.obj";
}

AdviceRequest for_box(const std::string& folder) {
  AdviceRequest request;
  request.surface = box_surface(folder);
  request.scale = 1e-3;
  request.material = "liver";
  request.rate_hz = 2;
  request.error = 0.2;
  return request;
}

/// Advice of three meshes, the second of which is chosen and meets a request of 5 % at 20 Hz.
Advice good_advice() {
  Advice advice;
  advice.body.radius_m = 0.02;
  for (const double spacing_m : {0.012, 0.010, 0.008}) {
    AdvisedMesh mesh;
    mesh.spacing_m = spacing_m;
    mesh.mesh_error = 4 * spacing_m;
    mesh.worst_error = 0.1;
    mesh.step_ms = 10;
    mesh.patch_ms = 10;
    advice.tried.push_back(mesh);
  }
  advice.chosen = 1;
  advice.step_known = advice.true_enough = advice.fast_enough = true;
  return advice;
}

/// All lines of misfits() for a request of 5 % at 20 Hz.
std::string misfits_of(const Advice& advice) { return fmt::format("{}", fmt::join(misfits(AdviceRequest{}, advice), "\n")); }

}  // namespace

TEST_CASE("Advice for a surface is a scene that loads, with the mesh, step and material that were promised") {
  AdviceRequest request = for_box("scene");
  request.material = "ecoflex-00-10";  // ten times as stiff as the tissue of the other tests, and so is the rounding of forces
  std::int64_t now = 0;
  const Advice advice = advise(request, [&] { return now += 1000; });
  const AdvisedMesh& mesh = advice.tried[advice.chosen];
  CHECK(advice.true_enough);
  CHECK(advice.error() <= request.error);
  const std::string text = advised_scene(request, advice.body, "box.obj", mesh.spacing_m, advice.step_s);
  const auto file = request.surface.parent_path() / "box.json";
  std::ofstream(file) << text;
  const Scene scene = load_scene(file);
  CHECK(scene.body.nodes.size() == mesh.nodes);
  CHECK(scene.body.hexahedra.size() == mesh.cells);
  CHECK(scene.solver.step_s == Approx(advice.step_s));
  CHECK(scene.body.materials.front().young_pa == 55000);
  // At least 79 % for every mesh if each has its own normal, and some places are beside the support.
  for (const AdvisedMesh& tried : advice.tried) CHECK(tried.worst_error < 0.5);
}

TEST_CASE("A place's compliance along its own normal is that of a finger, and along other directions a quadratic form of them") {
  const AdviceRequest request = for_box("compliance");
  const AdvisedBody body = advised_body(request);
  const auto file = request.surface.parent_path() / "compliance.json";
  std::ofstream(file) << advised_scene(request, body, "box.obj", 0.009, 0.01);
  const Scene scene = load_scene(file);
  const std::vector<PushedPlace> places = compared_places(scene, body.held_below_m, home_of(scene), 4);
  REQUIRE(places.size() == 4);
  const Vec3 middle(0, 0, 0.5 * body.size_m.z());
  for (const PushedPlace& at : places) {
    CHECK(at.place.z() > body.held_below_m + body.radius_m);
    CHECK(at.outward.dot(at.place - middle) > 0);
    const auto along = [&](const Vec3& direction) {
      const PushedPlace pushed{at.place, direction};
      return touch_compliances(scene, {&pushed, 1}).at(0);
    };
    const auto finger = finger_stiffness(scene, at.place);
    REQUIRE(finger);
    CHECK(along(finger->outward) * finger->stiffness_n_m == Approx(1).epsilon(1e-6));
    const Vec3 a(0.3, -0.2, 0.9), b(0.5, 0.8, 0.1);
    CHECK(along(a + b) + along(a - b) == Approx(2 * (along(a) + along(b))).epsilon(1e-4));
  }
}

TEST_CASE("A body of which nothing is held has no compliance") {
  const AdviceRequest request = for_box("loose");
  AdvisedBody body = advised_body(request);
  body.held_below_m = -1;
  const auto file = request.surface.parent_path() / "loose.json";
  std::ofstream(file) << advised_scene(request, body, "box.obj", 0.009, 0.01);
  const PushedPlace top{Vec3(0, 0, 0.04), Vec3::UnitZ()};
  CHECK(touch_compliances(load_scene(file), {&top, 1}).empty());
}

TEST_CASE("A surface is put on the ground with the axis up that was asked for, and is as large and heavy as it is") {
  AdviceRequest request = for_box("placed");
  request.up = "-x";
  request.held_share = 0.2;
  const AdvisedBody body = advised_body(request);
  CHECK((body.size_m - Vec3(0.04, 0.05, 0.06)).norm() < 1e-9);
  CHECK(body.volume_m3 == Approx(0.06 * 0.05 * 0.04));
  CHECK(body.area_m2 == Approx(2 * (0.06 * 0.05 + 0.05 * 0.04 + 0.04 * 0.06)));
  CHECK(body.mass_kg == Approx(body.volume_m3 * 1060).epsilon(0.05));
  CHECK(body.held_below_m == Approx(0.2 * 0.06));
  CHECK(body.held_volume_share == Approx(0.2).margin(0.03));
  const auto file = request.surface.parent_path() / "placed.json";
  std::ofstream(file) << advised_scene(request, body, "box.obj", 0.005, 0.01);
  Vec3 low = Vec3::Constant(1), high = Vec3::Constant(-1);
  for (const Vec3& x : load_scene(file).body.nodes) low = low.cwiseMin(x), high = high.cwiseMax(x);
  CHECK((low - Vec3(-0.02, -0.025, 0)).norm() < 0.001);
  CHECK((high - Vec3(0.02, 0.025, 0.06)).norm() < 0.001);
}

TEST_CASE("A surface of several bodies is said to be one, with their volumes, and shells that overlap or hollow out are none") {
  const auto bodies_ml = [](const std::string& folder, std::initializer_list<std::pair<Vec3, double>> cubes_mm) {
    const auto place = std::filesystem::temp_directory_path() / ("palpate-advice-" + folder);
    std::filesystem::create_directories(place);
    std::ofstream file(place / "cubes.obj");
    int first = 1;
    for (const auto& [low, side] : cubes_mm) {  // a side below zero: faces inwards
      const bool inwards = side < 0;
      for (int i = 0; i < 8; ++i) {
        const Vec3 x = low + std::abs(side) * Vec3(i & 1, i >> 1 & 1, i >> 2 & 1);
        file << fmt::format("v {} {} {}\n", x.x(), x.y(), x.z());
      }
      for (std::array<int, 4> f :
           {std::array{1, 3, 4, 2}, {5, 6, 8, 7}, {1, 2, 6, 5}, {3, 7, 8, 4}, {1, 5, 7, 3}, {2, 4, 8, 6}}) {
        if (inwards) std::swap(f[1], f[3]);
        file << fmt::format("f {} {} {} {}\n", f[0] + first - 1, f[1] + first - 1, f[2] + first - 1, f[3] + first - 1);
      }
      first += 8;
    }
    file.close();
    AdviceRequest request = for_box(folder);
    request.surface = place / "cubes.obj";
    return advised_body(request).bodies_m3;
  };
  const auto ml = [](double of) { return Approx(1e-6 * of).epsilon(1e-3); };
  const Vec3 origin = Vec3::Zero(), beside(100, 0, 0);
  const auto apart = bodies_ml("apart", {{origin, 40}, {beside, 50}});
  REQUIRE(apart.size() == 2);
  CHECK(apart[0] == ml(125));
  CHECK(apart[1] == ml(64));
  const auto overlapping = bodies_ml("overlapping", {{origin, 40}, {Vec3(20, 20, 20), 40}});
  REQUIRE(overlapping.size() == 1);
  CHECK(overlapping[0] == Approx(1e-6 * (2 * 64 - 8)).epsilon(0.05));  // mesh_solid.hpp: in parts where they cross
  const auto hollow = bodies_ml("hollow", {{origin, 40}, {Vec3(10, 10, 10), -20}, {beside, 10}});
  REQUIRE(hollow.size() == 2);
  CHECK(hollow[0] == ml(64 - 8));
  CHECK(hollow[1] == ml(1));
  Advice advice = good_advice();
  advice.body.bodies_m3 = apart;
  CHECK_THAT(misfits_of(advice), Contains("bounds 2 bodies that do not meet, of 125, 64 ml") && Contains("\"bodies\""));
}

TEST_CASE("Deep presses that take longer than a frame, or find no solution, are said to") {
  Advice advice = good_advice();
  advice.deep_m = 0.02;
  advice.tried[1].deep_ms = 49;
  CHECK(misfits_of(advice).empty());
  advice.tried[1].deep_ms = 218;
  advice.tried[1].deep_place = Vec3(0.01, 0.02, 0.03);
  CHECK_THAT(misfits_of(advice), Contains("up to 218 ms with a hand 20 mm deep at (10, 20, 30) mm"));
  advice.tried[1].deep_ms = std::numeric_limits<double>::infinity();
  CHECK_THAT(misfits_of(advice), Contains("no step finds a solution with a hand 20 mm deep"));
}

TEST_CASE(
    "The cost that advice says is the stopwatch's, also of a deep press: one ten times as fast makes it ten times as large") {
  const AdviceRequest request = for_box("cost");
  double frame_ms[2] = {};
  std::int64_t tick_ns = 1000;
  for (double& ms : frame_ms) {
    std::int64_t now = 0;
    const Advice advice = advise(request, [&] { return now += tick_ns; });
    const AdvisedMesh& mesh = advice.tried[advice.chosen];
    ms = mesh.frame_ms();
    CHECK(advice.deep_m == Approx(0.02));  // deeper than the press that the rate is measured with
    CHECK(mesh.deep_ms > 0);
    tick_ns *= 10;
  }
  CHECK(frame_ms[0] > 0);
  CHECK(frame_ms[1] == Approx(10 * frame_ms[0]).epsilon(1e-9));
}

TEST_CASE("A machine that is too slow for every mesh is said to be, and gets the fastest") {
  std::int64_t now = 0;
  const Advice advice = advise(for_box("slow"), [&] { return now += 60'000'000'000; });
  CHECK_FALSE(advice.fast_enough);
  for (const AdvisedMesh& mesh : advice.tried)
    if (mesh.frame_ms() > 0) CHECK(mesh.frame_ms() >= advice.tried[advice.chosen].frame_ms());
}

TEST_CASE("Advice without a surface, a size or a material says what is wrong") {
  const auto refusal = [](AdviceRequest request) {
    try {
      advise(request, [] { return std::int64_t{}; });
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("nothing was refused");
  };
  AdviceRequest request = for_box("refused");
  request.material = "cheese";
  CHECK_THAT(refusal(request), Contains("--material: 'cheese' is not known") && Contains("--list-materials"));
  request = for_box("refused");
  request.scale = 1;
  CHECK_THAT(refusal(request), Contains("--surface") && Contains("scale"));
  request = for_box("refused");
  request.surface = "no-such-file.stl";
  CHECK_THAT(refusal(request), Contains("no-such-file.stl"));
}

TEST_CASE("The chosen mesh has the smallest error, or missed volume where that is larger") {
  AdviceRequest request = for_box("volume");
  request.surface = box_surface("volume", {60, 60, 60});
  request.error = 0.001;
  std::int64_t now = 0;
  const Advice advice = advise(request, [&] { return now += 1000; });
  const auto off = [](const AdvisedMesh& mesh) { return std::max(mesh.mesh_error, std::abs(mesh.filled_share - 1)); };
  const double chosen = off(advice.tried[advice.chosen]);
  CHECK(std::ranges::all_of(advice.tried, [&](const AdvisedMesh& mesh) { return off(mesh) >= chosen; }));
  CHECK(std::ranges::any_of(advice.tried, [](const AdvisedMesh& mesh) { return !mesh.keeps_volume(); }));
}

TEST_CASE("Each requirement that a mesh misses is said, also where others are, with what would help") {
  CHECK(misfits_of(good_advice()).empty());
  Advice advice = good_advice();
  AdvisedMesh& chosen = advice.tried[1];
  advice.body.radius_m = 0.003;
  advice.tried[0].mesh_error = chosen.mesh_error = 0.181;
  advice.true_enough = false;
  CHECK_THAT(misfits_of(advice), Contains("a tip of 3 mm is narrower") && Contains("--radius-mm 20 would do") &&
                                     Contains("the force is 18.1 % from the continuum's, 5 % was requested") &&
                                     Contains("a spacing of 8.00 mm keeps it"));
  advice.tried[2].filled_share = 0.9;
  CHECK_THAT(misfits_of(advice), Contains("a spacing of 8.00 mm keeps it, but has 90 % of the volume"));
  for (AdvisedMesh& mesh : advice.tried) mesh.mesh_error = 0.181;
  CHECK_THAT(misfits_of(advice), Contains("no mesh that was tried does") && Contains("--radius-mm"));
}

TEST_CASE("Advice says that its errors cannot be trusted, and where the force is far from the continuum's") {
  Advice advice = good_advice();
  advice.model_error = 0.343;
  CHECK_THAT(misfits_of(advice), Contains("Do not trust the errors") && Contains("34 %"));
  advice = good_advice();
  advice.tried[1].worst_error = 0.78;
  advice.tried[1].worst_error_place = Vec3(0.082, 0.052, 0.036);
  CHECK_THAT(misfits_of(advice), Contains("Does not fit everywhere") && Contains("(82, 52, 36) mm") && Contains("78 %"));
}

TEST_CASE("Advice says what of the volume a mesh misses, and which mesh has more of it") {
  Advice advice = good_advice();
  advice.tried[0].filled_share = 0.40;
  advice.tried[1].filled_share = 0.52;
  advice.tried[2].filled_share = 0.86;
  CHECK_THAT(misfits_of(advice), Contains("Does not fit: the body has 52 % of the volume") && Contains("8.00 mm has 86 %"));
}

TEST_CASE("A frame that is too long is said with a rate that the machine keeps, and a busy machine is said to be") {
  Advice advice = good_advice();
  advice.fast_enough = false;
  advice.tried[1].step_ms = 15;
  advice.tried[1].patch_ms = 30;  // at 10 Hz 30 ms of steps and one patch: 60 of 100 ms
  CHECK_THAT(misfits_of(advice), Contains("45.0 ms a frame") && Contains("--rate-hz 10 would do"));
  advice.tried[1].step_ms = 40;  // of 50 ms, whatever the rate
  CHECK_THAT(misfits_of(advice), Contains("the steps alone are too slow"));
  advice = good_advice();
  advice.tried[1].core_share = 0.25;
  CHECK_THAT(misfits_of(advice), Contains("25 % of a core") && Contains("80 ms on the clock") && Contains("skips frames"));
}

TEST_CASE("The error of fewer than three meshes is not known, and none is claimed to fit") {
  AdviceRequest request = for_box("flat");
  request.surface = box_surface("flat", {60, 60, 8});
  std::int64_t now = 0;
  const Advice advice = advise(request, [&] { return now += 1000; });
  CHECK_FALSE(advice.error_known());
  CHECK_FALSE(advice.true_enough);
  CHECK_THAT(fmt::format("{}", fmt::join(misfits(request, advice), "\n")), Contains("The error is not known"));
}

TEST_CASE("Only axes that differ by more than a few percent are called longest and thinnest") {
  CHECK(orientation_in_words({0.060, 0.061, 0.059}) == "z is up");
  CHECK(orientation_in_words({0.060, 0.060, 0.020}) == "z is up; thinnest along z");
  CHECK(orientation_in_words({0.060, 0.020, 0.020}) == "z is up; longest along x");
  CHECK(orientation_in_words({0.060, 0.020, 0.040}) ==
        "z is up; longest along x; thinnest along y (--up y lays it on its broad side)");
}

TEST_CASE("A surface that makes no body is refused with its size and without the place in a file that does not exist") {
  AdviceRequest request = for_box("plate");
  request.surface = box_surface("plate", {300, 300, 3});
  std::vector<std::string> said;
  AdviceHearer hearer;
  hearer.says = [&](const std::string& what) { said.push_back(what); };
  CHECK_THROWS_WITH(
      advise(
          request, [] { return std::int64_t{}; }, hearer),
      Contains("makes no body of 300 x 300 x 3 mm") && Contains("--scale") && !Contains("obj:6") && !Contains(".json"));
  REQUIRE(said.size() == 1);
  CHECK_THAT(said.front(), Contains("1.35 mm: the clip keeps"));
}

TEST_CASE("A plate whose widest spacing has more nodes than a room has time for is refused, with their number") {
  AdviceRequest request = for_box("thin");
  request.surface = box_surface("thin", {100, 100, 4});
  CHECK_THROWS_WITH(advise(request, [] { return std::int64_t{}; }),
                    Contains("makes no body of 100 x 100 x 4 mm") && Contains("12996 nodes") && Contains("thicker"));
}

TEST_CASE("A frame costs what the server's choice of patches costs, which is nonlinear while it fits into the frame") {
  FrameCost cost;
  cost.step_ms = 15;
  cost.port_ms = 15;
  cost.hyper_ms = 30;
  CHECK(served_scheme(cost, 20) == Scheme::hyper);  // 45 of 50 ms: more than advise allows, but what the server serves
  cost.hyper_ms = 34;
  CHECK(served_scheme(cost, 20) == Scheme::port);
}
