// A thin plate that is pressed through itself and left fast: model, server and player all release the tool. Without friction,
// which does pull at a tool that leaves a surface along it.
#include <algorithm>
#include <catch2/catch.hpp>

#include "bench/fidelity/replay.hpp"

using namespace palpate;

TEST_CASE("A touch of a thin plate never pulls in the model, at the server or in what is felt, however fast it is left") {
  const Scene plate = read_scene(R"({"body": {"lattice": {"nodes": [9, 9, 4], "size_m": [0.08, 0.08, 0.015],
      "solid": {"material": "liver"}, "fixed_faces": ["x-", "x+"]}}, "tool": {"contact": "touch", "radius_m": 0.01, "mu": 0}})",
                                 "plate");
  const auto at = [](double z) { return Vec3(0.04, 0.04, z); };
  const Motion motion({{0, at(0.02)}, {0.5, at(-0.035)}, {0.6, at(-0.035)}, {0.71, at(0.02)}, {1.1, at(0.02)}});
  ReplayOptions options;
  options.scheme = GENERATE(Scheme::port, Scheme::hyper);
  options.link.latency = Micros{25'000};
  const ReplayResult result = replay(plate, motion, options, [] { return std::int64_t{0}; });
  double felt_n = 0, reference_n = 0, server_n = 0, push_n = 0;
  for (const ReplayTick& tick : result.ticks) {
    felt_n = std::min(felt_n, tick.felt.z());
    reference_n = std::min(reference_n, tick.reference.z());
    push_n = std::max(push_n, tick.felt.z());
  }
  for (const ReplayFrame& frame : result.frames) server_n = std::min(server_n, frame.force.z());
  CAPTURE(name_of(options.scheme));
  CHECK(push_n > 0.3);
  CHECK(reference_n == 0);
  CHECK(server_n == 0);
  CHECK(felt_n == 0);
  CHECK(result.ticks.back().felt.norm() == 0);
}
