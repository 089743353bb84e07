// Patches of bodies with relaxation, against the bodies themselves.
#include <catch2/catch.hpp>
#include <cmath>

#include "common/player/player.hpp"
#include "server/reduction/patch_build.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr double kTickS = 1e-3;

/// A tool moves to and fro on a block of hexahedra for a while; then a patch is made, and the body and its player continue with
/// the same tool.
struct Played {
  double off_n = 0, felt_n = 0;  ///< largest difference, and change of force, while the patch is played
};

Played play(double share, double time_s, double reach_m, Scheme scheme, bool with_fading = true) {
  LumpedBody body = hexa_box(5, 5, 4, {SolidLaw::neo_hookean, 6e3, 0.45, 0.01});
  if (share > 0) body.relaxation = {{share, time_s}};
  constexpr std::uint32_t kNode = 2 + 5 * (2 + 5 * 3);  // middle of the top
  const Dynamics dynamics(body);
  const Skin skin(body);
  Integrator integrator(dynamics, skin, {kTickS, 1e-11});
  std::vector<ToolPort> ports(1);
  ports[0].kind = ContactKind::attach;
  ports[0].node = kNode;
  const Vec3 home = body.nodes[kNode];
  const auto tool_at = [&](std::size_t, double t) {
    constexpr double kOmega = 9;
    const Vec3 way = reach_m * Vec3(0.5, 0.2, 1);
    return ToolAt{home + std::sin(kOmega * t) * way, kOmega * std::cos(kOmega * t) * way};
  };
  BodyState state = dynamics.rest_state();
  constexpr int kBefore = 500, kPlayed = 200;
  for (int k = 1; k <= kBefore; ++k) REQUIRE(integrator.advance(state, ports, k * kTickS, tool_at).converged);
  FrameModel frame(dynamics, skin, softest_stiffness(dynamics));
  ToolAt tool = tool_at(0, kBefore * kTickS);
  tool.velocity = node_of(state.v, kNode);
  PatchRequest request;
  request.scheme = scheme;
  request.horizon = Micros{200'000};
  frame.begin(state, ports, std::span(&tool, 1), request.horizon);
  auto built = build_patch(frame, 0, request);
  REQUIRE(built);
  built->patch.stamp = Micros{1000 * kBefore};
  REQUIRE(check(built->patch) == PatchFault::none);
  if (!with_fading) built->patch.fading.count = 0;
  PatchPlayer player(built->patch, built->terms);
  Played played;
  const Vec3 begin = -ports[0].lambda;
  for (int k = kBefore + 1; k <= kBefore + kPlayed; ++k) {
    REQUIRE(integrator.advance(state, ports, k * kTickS, tool_at).converged);
    const Vec3 felt = player.advance({Micros{1000 * k}, tool_at(0, k * kTickS).position}).force;
    played.off_n = std::max(played.off_n, (felt + ports[0].lambda).norm());
    played.felt_n = std::max(played.felt_n, (begin + ports[0].lambda).norm());
  }
  return played;
}

}  // namespace

TEST_CASE("A grasp of a body whose stress fades is felt as truly as one of a body whose stress stays", "[fading]") {
  // Small: only the error of a truncated basis remains. Large: the relaxed stress rotates with a body that has moved on, which a
  // patch does not represent.
  struct Case {
    Scheme scheme;
    double reach_m, more;
  };
  for (const Case& c : {Case{Scheme::port, 1e-4, 0.0002}, Case{Scheme::hyper, 1e-4, 0.0002}, Case{Scheme::hyper, 8e-3, 0.002}}) {
    const Played stays = play(0, 1, c.reach_m, c.scheme), fades = play(0.5, 0.1, c.reach_m, c.scheme);
    INFO("reach " << c.reach_m << ", off " << fades.off_n << " of " << fades.felt_n << ", elastic " << stays.off_n << " of "
                  << stays.felt_n);
    CHECK(fades.off_n / fades.felt_n < stays.off_n / stays.felt_n + c.more);
  }
}

TEST_CASE("Without what fades a grasp is felt wrong by far more", "[fading]") {
  const Played played = play(0.5, 0.1, 1e-4, Scheme::port, false);
  CHECK(played.off_n > 0.1 * played.felt_n);
}
