#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <string>

#include "server/body/settle.hpp"
#include "server/dynamics/integrator.hpp"
#include "server/dynamics/needle_ports.hpp"
#include "server/scene/scene.hpp"

namespace palpate {
namespace {

constexpr double kToughness = 164, kDiameterM = 0.00127, kTopM = 0.06;

Scene block(double spacing_m, double friction_n_m, double puncture_n = 0.6) {
  const auto nodes = [&](double extent_m) { return std::to_string(1 + static_cast<int>(std::lround(extent_m / spacing_m))); };
  const std::string text = R"({"body": {"lattice": {"nodes": [)" + nodes(0.08) + "," + nodes(0.08) + "," + nodes(kTopM) +
                           R"(], "size_m": [0.08, 0.08, 0.06], "fixed_faces": ["z-"],
      "solid": {"element": "hexahedron", "young_pa": 8000, "poisson": 0.45, "law": "neo-hookean", "damping_s": 0.01}},
      "tissue": [{"toughness_j_m2": 164, "puncture_n": )" +
                           std::to_string(puncture_n) + R"(, "friction_n_m": )" + std::to_string(friction_n_m) + R"(}]},
      "tool": {"contact": "touch", "radius_m": 0.02, "needle": {"length_m": 0.04, "diameter_m": 0.00127}}})";
  return read_scene(text, "block");
}

struct NeedleBench {
  Scene scene;
  Skin skin{scene.body, scene.tool.radius_m};
  NeedleTissue tissue{scene, skin};
  Dynamics dynamics{scene.body};
  Integrator integrator{dynamics, skin, {.step_s = 0.005, .tolerance_m = 1e-8, .event_step_s = 0.001}};
  BodyState state = settled_state(dynamics, "block");
  std::vector<ToolPort> ports;
  double x_m = 0.041, y_m = 0.039;

  explicit NeedleBench(Scene s) : scene(std::move(s)) {
    ToolPort port;
    port.parameters = {scene.tool.contact_stiffness_n_m, scene.tool.friction};
    ports = needle_ports(port, tissue);
  }
  void move_to(double from_z_m, double to_z_m, double until_s) {
    const double begin_s = state.time_s;
    const auto tool = [&](std::size_t, double t) {
      const double part = (t - begin_s) / (until_s - begin_s);
      return ToolAt{Vec3(x_m, y_m, from_z_m + part * (to_z_m - from_z_m)), Vec3(0, 0, (to_z_m - from_z_m) / (until_s - begin_s))};
    };
    REQUIRE(integrator.advance(state, ports, until_s, tool).converged);
  }
  double force_n() const {
    double sum = 0;
    for (const ToolPort& port : ports)
      if (port.touching) sum -= port.lambda.z();
    return sum;
  }
  const NeedleTip& tip() const { return ports.front().needle.tip; }
};

TEST_CASE("try", "[.]") {
  for (const double spacing_m : {0.01, 0.005}) {
    NeedleBench bench(block(spacing_m, 4));
    double z = kTopM + 0.001, work_j = 0, before_n = 0;
    const double speed = 0.02;
    for (int k = 1; k <= 220; ++k) {
      const double next = z - speed * 0.01 * (k <= 130 ? 1 : -1);
      bench.move_to(z, next, k * 0.01);
      work_j += 0.5 * (bench.force_n() + before_n) * (z - next);
      before_n = bench.force_n();
      z = next;
      if (k % 10 == 0)
        std::printf("%4d ms z %6.2f mm f %6.3f N inside %d s %5.2f c %5.2f mm work %.3f mJ J w c %.3f\n", 10 * k, 1e3 * (z - kTopM),
                    bench.force_n(), bench.tip().inside, 1e3 * bench.tip().depth_m, 1e3 * bench.tip().front_m, 1e3 * work_j,
                    1e3 * kToughness * kDiameterM * bench.tip().front_m);
    }
  }
}

}  // namespace
}  // namespace palpate
