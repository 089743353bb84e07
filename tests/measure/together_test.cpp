// Two hands on one body: what each feels of the other, against the full model with both tools.
#include <catch2/catch.hpp>

#include "bench/fidelity/reference.hpp"
#include "bench/fidelity/replay.hpp"
#include "bench/measure/tools_apart.hpp"

using namespace palpate;

namespace {

Scene touch_cube() { return load_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/touch-cube.json"); }

}  // namespace

TEST_CASE("Two hands 20 mm apart feel each other through the tissue: the error is small beside what they feel") {
  const Scene scene = touch_cube();
  const std::vector<Motion> motions = tools_apart(scene, 2, 0.020, 1.5);
  ReplayOptions options;
  const auto results = replay_together(scene, motions, options, [] { return std::int64_t{0}; });
  REQUIRE(results.size() == 2);
  for (const ReplayResult& r : results) {
    CHECK(r.ticks.size() == 1501);
    CHECK(r.fidelity.snr_db > 25);                       // about 0 dB when the other tool lets go at the stamp
    CHECK(r.patch_bytes_mean <= 2 * kMaxDatagramBytes);  // one datagram a patch, twice while the link is not known
  }
}

TEST_CASE("The reference with a second tool far above the body is that of the first alone, and a press beside it is felt") {
  const Scene scene = touch_cube();
  const std::vector<Motion> motions = tools_apart(scene, 2, 0.020, 0.6);
  std::vector<ToolPath> paths(2);
  for (int ms = 0; ms <= 600; ++ms)
    for (std::size_t k = 0; k < 2; ++k) paths[k].push_back(motions[k].position(ms * 1e-3));
  const ReferenceForce alone = reference_force(scene, paths[0]);
  std::vector<ToolPath> apart{paths[0], ToolPath(601, Vec3(0.05, 0.05, 0.3))};
  const auto with_idle = reference_forces(scene, apart);
  double most = 0, felt = 0;
  const auto both = reference_forces(scene, paths);
  for (std::size_t i = 0; i < alone.force.size(); ++i) {
    most = std::max(most, (alone.force[i] - with_idle[0].force[i]).norm());
    felt = std::max(felt, (alone.force[i] - both[0].force[i]).norm());
  }
  CHECK(most < 1e-6);
  CHECK(with_idle[1].contact == std::vector<std::uint8_t>(601, 0));
  CHECK(felt > 0.1);
}
