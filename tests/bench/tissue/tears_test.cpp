// Tears on bodies that are pulled as told: what a row of cells gives, where a tear does not go. Closed forms: surgery_test.cpp.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "bench/tissue/pulled_body.hpp"
#include "server/room/tool_coupling.hpp"
#include "server/scene/grid.hpp"

using namespace palpate;

namespace {

constexpr double kBroadM = DoubleCantilever::kBroadM;

}  // namespace

TEST_CASE("A row gives energy where its arms are pulled apart, and none where they are pressed together", "[tears]") {
  const double spacing_m = GENERATE(0.01, 0.005);
  constexpr double kCutM = 0.08, kForceN = 1e-5;
  CAPTURE(spacing_m);
  const Scene scene = double_cantilever(spacing_m, kCutM);
  const Dynamics now(scene.body);
  const Skin skin(scene.body, 0);
  const auto row = TearRow::ahead(*scene.tearing, {0, CutEnd::last});
  REQUIRE(row);
  CHECK(row->area_m2() == Approx(spacing_m * kBroadM).epsilon(1e-9));
  BodyState state = now.rest_state();
  const Vector opening = opened_arms(now, kForceN).u;
  state.x += opening;
  CHECK(row->release_j_m2(now, skin, state, {}) > 0);
  state.x -= 2 * opening;
  CHECK(row->release_j_m2(now, skin, state, {}) == 0);
}

TEST_CASE("Tissue that is held does not tear below its toughness", "[tears]") {
  constexpr double kLoadedS = 1.5;
  double most_m = 0;
  PulledBody until = pulled_arms(0.01, 0.06, [](double t) { return 0.01 * t; });
  while (!until.frame(0.0125)) most_m = 0.01 * until.time_s();
  PulledBody bar = pulled_arms(0.01, 0.06, [&](double t) { return 0.96 * most_m * std::min(t / kLoadedS, 1.0); });
  while (bar.time_s() < kLoadedS + 3) CHECK_FALSE(bar.frame(0.0125));
  PulledBody beyond = pulled_arms(0.01, 0.06, [&](double t) { return 1.04 * most_m * std::min(t / kLoadedS, 1.0); });
  while (beyond.time_s() < kLoadedS + 3) beyond.frame(0.0125);
  CHECK(beyond.cells() == 2);
}

TEST_CASE("A clip on a cut keeps it closed, and stops a tear", "[tears]") {
  const std::string clip = R"(, "clips": [{"at_m": [0.1, 0.01, 0.02], "radius_m": 0.021, "stiffness_n_m": 1e6}])";
  const auto apart = [](double t) { return 0.01 * std::min(t, 4.0); };
  PulledBody bare = pulled_arms(0.01, 0.06, apart), held = pulled_arms(0.01, 0.06, apart, clip);
  while (bare.time_s() < 4.2) bare.frame(0.05), held.frame(0.05);
  CHECK(bare.cells() >= 12);
  CHECK(held.cells() <= 8);  // to its middle, 100 mm from the end
  CHECK(held.cells() >= 2);
}

/// Legs of a sheet that stands on its edge; jaws pinch one from both sides and pull it from the other.
PulledBody pinched(double friction) {
  constexpr double kSpacing = 0.01;
  Scene scene =
      read_scene(fmt::format(R"({{"body": {{"lattice": {{"nodes": [3, 9, 9], "size_m": [{}, 0.08, 0.08], "fixed_faces": ["z-"],
        "solid": {{"young_pa": 40000, "poisson": 0.4, "damping_s": 0.01}}}},
        "cuts": [{{"path": [{{"at_m": [-0.01, 0.04, 0.09]}}, {{"at_m": [-0.01, 0.04, 0.033]}}], "direction": [1, 0, 0], "depth_m": 0.04}}],
        "tissue": [{{"toughness_j_m2": 10}}], "tears": true}},
        "tool": {{"contact": "touch", "mu": {}, "body": {{"jaws": {{"hinge_z_m": 0.2, "open_deg": 11.5}}, "spheres": [
          {{"center_m": [0.01, 0, 0.004], "radius_m": 0.004, "jaw": 1}}, {{"center_m": [0.01, 0, 0.016], "radius_m": 0.004, "jaw": 1}},
          {{"center_m": [-0.01, 0, 0.004], "radius_m": 0.004, "jaw": -1}}, {{"center_m": [-0.01, 0, 0.016], "radius_m": 0.004, "jaw": -1}}]}}}}}})",
                             2 * kSpacing, friction),
                 "strip");
  ToolPort port;
  port.parameters = {scene.tool.contact_stiffness_n_m, friction};
  std::vector<ToolPort> ports = parts_of(scene.tool, nullptr, port);
  return PulledBody(std::move(scene), std::move(ports), [](const ToolPort& of, double t) {
    TurningTool at;
    at.at.position = Vec3(0.01, 0.03 - 0.01 * std::clamp(t - 0.6, 0.0, 2.0), 0.08 - 0.02);
    at.opening = std::max(0.0, 0.4 - t);
    return at.centre_of(of.sphere);
  });
}

TEST_CASE("Jaws slip off a leg before it tears where their friction bears less than the tear", "[tears]") {
  const auto pull = [](PulledBody& sheet) {
    double most_n = 0;
    while (sheet.time_s() < 2.6) {
      sheet.frame(0.025);
      double sum = 0;
      for (const ToolPort& port : sheet.ports()) sum -= port.lambda.y();
      most_n = std::max(most_n, sum);
    }
    return most_n;
  };
  PulledBody loose = pinched(0.05), firm = pinched(1.0);
  const double slips_n = pull(loose), tears_n = pull(firm);
  CAPTURE(slips_n, tears_n, loose.cells(), firm.cells());
  CHECK(loose.cells() == 0);
  CHECK(firm.cells() >= 2);
  CHECK(slips_n < 0.5 * tears_n);
}

TEST_CASE("The energy that a row of tetrahedra gives is what its body becomes softer by", "[tears]") {
  constexpr double kForceN = 1e-5;
  Scene scene = double_cantilever(0.01, 0.08, "", "tetrahedron");
  const auto row = TearRow::ahead(*scene.tearing, {0, CutEnd::last});
  REQUIRE(row);
  const Dynamics now(scene.body), parted(row->body().body());
  BodyState state = now.rest_state();
  const OpenedArms before = opened_arms(now, kForceN), after = opened_arms(parted, kForceN);
  state.x += before.u;
  CHECK(row->release_j_m2(now, Skin(scene.body, 0), state, {}) * row->area_m2() ==
        Approx(0.5 * kForceN * (after.apart_m - before.apart_m)).epsilon(1e-3));
  // Rows that part one after another cover the cut once.
  double area_m2 = row->area_m2();
  CutBody body = row->body();
  while (const auto next = TearRow::ahead(body, {0, CutEnd::last})) {
    area_m2 += next->area_m2();
    body = next->body();
    if (body.cuts()[0].path_m.back().x() > 0.12) break;
  }
  CHECK(area_m2 == Approx(kBroadM * (body.cuts()[0].path_m.back().x() - 0.083)).margin(0.01 * kBroadM));
}
