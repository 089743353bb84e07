// A small body with a tool on a path, and the tool's force with different integrators.
#pragma once

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "server/dynamics/integrator.hpp"
#include "tests/support/bodies.hpp"

namespace palpate::test {

struct ToolBench {
  LumpedBody body;
  Dynamics dynamics{body};
  Skin skin{body};
  Integrator fine{dynamics, skin, {0.0005, 1e-11}};  ///< converged at steps of 0.5 ms
  ToolPort port;

  explicit ToolBench(LumpedBody b, ContactKind kind = ContactKind::attach) : body(std::move(b)) {
    port.kind = kind;
    port.node = static_cast<std::uint32_t>(body.nodes.size()) - 1;
    port.parameters = {800, 0.3};
  }
  /// Force on the body every 10 ms while the tool follows its path.
  std::vector<Vec3> felt(Stepper& stepper, double step_s, double until_s, const std::function<Vec3(double)>& way) const {
    BodyState state = dynamics.rest_state();
    std::vector<ToolPort> ports{port};
    const auto tool = [&](std::size_t, double t) { return ToolAt{way(t), (way(t + 1e-6) - way(t - 1e-6)) / 2e-6}; };
    std::vector<Vec3> forces;
    for (int k = 1; k * 0.010 <= until_s + 1e-9; ++k) {
      REQUIRE(stepper.advance(state, ports, k * 0.010, step_s, tool).converged);
      forces.push_back(ports[0].lambda);
    }
    return forces;
  }
  /// Root mean square of the difference, relative to `b`.
  static double apart(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
    double off = 0, all = 0;
    for (std::size_t k = 0; k < a.size(); ++k) {
      off += (a[k] - b[k]).squaredNorm();
      all += b[k].squaredNorm();
    }
    return std::sqrt(off / all);
  }
};

}  // namespace palpate::test
