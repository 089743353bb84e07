// A patch's prediction for the next frame, against its closed form, against a real server, and as drawn.
#include "client/view/foresight.hpp"

#include <catch2/catch.hpp>
#include <unsupported/Eigen/MatrixFunctions>

#include "client/view/patch_overlay.hpp"
#include "client/view/stage.hpp"
#include "server/core/server_core.hpp"
#include "server/room/room.hpp"
#include "tests/client/view/demo_body.hpp"
#include "tests/client/view/offscreen.hpp"
#include "tests/support/patches.hpp"

using namespace palpate;

namespace {

constexpr Micros kStamp{5'000'000}, kFrame{50'000};

/// An oscillating free surface with the tool far above it, and a next patch that begins where the first one ends.
PatchPair swinging() {
  PatchPair pair;
  pair.patch = test::touch_patch(4, 7, kStamp);
  pair.patch.g.setConstant(0.4);
  pair.patch.q_rate.setLinSpaced(-0.02, 0.03);
  pair.patch.tool = Vec3(0, 0, 0.05);
  pair.samples = {{kStamp, pair.patch.tool}, {kStamp + kFrame, pair.patch.tool}};
  pair.next = pair.patch;
  pair.next.stamp = kStamp + kFrame;
  return pair;
}

/// q of an untouched patch, by one dense exponential.
ModeVector swung(const Patch& patch, double t_s) {
  const Eigen::Index r = patch.modes();
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(2 * r + 1, 2 * r + 1);
  a.block(0, r, r, r).setIdentity();
  a.block(r, 0, r, r).diagonal() = -patch.stiffness;
  a.block(r, r, r, r) = -patch.damping;
  a.block(r, 2 * r, r, 1) = patch.g;
  Eigen::VectorXd z = Eigen::VectorXd::Zero(2 * r + 1);
  z.segment(r, r) = patch.q_rate;
  z[2 * r] = 1;
  return ModeVector(((t_s * a).exp() * z).head(r));
}

/// The real cores and body in virtual time at 20 Hz, with a hand that descends from home at 5 cm/s; calls `tell` for every pair
/// of patches.
template <class Tell>
void press(const char* name, Scheme scheme, const Tell& tell) {
  const Scene scene = load_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/" + name);
  Micros now{1'000'000};
  Room room(scene);
  ServerCore server(facts_of(scene, home_of(scene)), {.draw = repeatable(5), .rate_hz = 20});
  ClientOptions options;
  options.hello.station = "hand";
  options.hello.scheme = scheme;
  ClientCore client(options, now);
  PatchPairs pairs;
  PatchPair pair;
  server.tick(now);
  room.start(server.body_time());
  for (const Micros end = now + Micros{900'000}; now < end; now += kTick) {
    const double down_m = 0.05 * std::max(0.0, seconds(now) - 1.2);
    client.haptic().tick({now, home_of(scene) - Vec3(0, 0, down_m)});
    client.tick(now);
    std::array<std::byte, kMaxDatagramBytes> out;
    while (const auto size = client.emit(out, now)) server.take({out.data(), size}, 1, now);
    server.tick(now);
    if (const auto job = server.next_job(now)) server.finish(room.run(*job), now);
    PeerId to = 0;
    while (const auto size = server.emit(out, to, now)) {
      client.take({out.data(), size}, now);
      if (pairs.take(client, pair)) tell(pair);
    }
  }
}

PortVertex& vertex(Patch& patch, int i) { return patch.surface.vertices[static_cast<std::size_t>(i)]; }

}  // namespace

TEST_CASE("A foresight is the patch swung on by itself, and its miss what the next patch has elsewhere", "[view][foresight]") {
  PatchPair pair = swinging();
  const ModeVector q = swung(pair.patch, seconds(kFrame));
  REQUIRE(q.norm() > 1e-4);
  for (int i = 0; i < pair.patch.surface.vertex_count; ++i)
    vertex(pair.next, i).position = vertex(pair.patch, i).position + vertex(pair.patch, i).rows * q;
  const Foresight right = foresee(pair);
  CHECK(right.compared == pair.patch.surface.vertex_count);
  CHECK(right.miss_max_m < 1e-12);
  vertex(pair.next, 2).position += Vec3(0, 0, 3e-4);
  vertex(pair.next, 5).position += Vec3(4e-4, 0, 0);
  const Foresight off = foresee(pair);
  CHECK(off.compared == pair.patch.surface.vertex_count);
  CHECK(off.miss_max_m == Approx(4e-4));
  CHECK(off.miss_rms_m == Approx(5e-4 / std::sqrt(off.compared)));
  CHECK((off.vertices[2].foreseen - off.vertices[2].found + Vec3(0, 0, 3e-4)).norm() < 1e-12);
}

TEST_CASE("A vertex that the next patch does not carry is not compared", "[view][foresight]") {
  PatchPair pair = swinging();
  pair.patch.g.setZero();
  pair.patch.q_rate.setZero();
  pair.next.surface.vertex_count -= 1;  // its triangles stay, for their edges
  const Foresight foresight = foresee(pair);
  CHECK(foresight.compared == pair.patch.surface.vertex_count - 1);
  CHECK_FALSE(foresight.vertices.back().compared);
  CHECK(foresight.miss_max_m == 0);
}

TEST_CASE("A grasp foresees its force and has no surface", "[view][foresight]") {
  PatchPair pair;
  pair.patch = test::attach_patch(3, 1, kStamp);
  pair.next = pair.patch;
  pair.next.stamp = kStamp + kFrame;
  pair.next.force = Vec3(0.1, 0, 0);
  pair.samples = {{kStamp, pair.patch.tool}, {kStamp + kFrame, pair.patch.tool}};
  const Foresight foresight = foresee(pair);
  CHECK(foresight.compared == 0);
  CHECK((foresight.force - pair.patch.force).norm() < 1e-12);  // at rest, and the tool stands still
  CHECK(foresight.force_found == pair.next.force);
}

TEST_CASE("A moment gets the foresight of the frame last passed, and none long after", "[view][foresight]") {
  Foresights kept;
  CHECK(kept.at(Micros{0}) == nullptr);
  for (const int ms : {100, 150, 200}) {
    Foresight foresight;
    foresight.at = Micros{1000 * ms};
    kept.add(foresight);
  }
  CHECK(kept.at(Micros{99'999}) == nullptr);
  CHECK(kept.at(Micros{170'000})->at == Micros{150'000});
  CHECK(kept.at(Micros{600'000})->at == Micros{200'000});
  CHECK(kept.at(Micros{800'000}) == nullptr);
}

TEST_CASE("Under a pressing hand a patch tells the server's next frame better than standing still does", "[view][foresight]") {
  double squares = 0, still_squares = 0;
  int compared = 0;
  press("touch-cube.json", Scheme::port, [&](PatchPair& pair) {
    CHECK(pair.samples.front().t <= pair.patch.stamp);
    CHECK(pair.samples.back().t >= pair.next.stamp);
    if (!pair.patch.touching) return;
    const Foresight foresight = foresee(pair);
    for (int i = 0; i < pair.patch.surface.vertex_count; ++i) {
      const ForeseenVertex& v = foresight.vertices[static_cast<std::size_t>(i)];
      if (!v.compared) continue;
      ++compared;
      squares += (v.foreseen - v.found).squaredNorm();
      still_squares += (vertex(pair.patch, i).position - v.found).squaredNorm();
    }
  });
  REQUIRE(compared > 12);  // a few a patch: the surface of the next ends where its terms begin
  INFO("rms " << 1e3 * std::sqrt(squares / compared) << " mm, standing still " << 1e3 * std::sqrt(still_squares / compared));
  CHECK(std::sqrt(still_squares / compared) > 5e-4);
  CHECK(squares < 0.0025 * still_squares);
}

TEST_CASE("A hyper-reduced patch is played with its terms, and foresees a pressed grasp better than without",
          "[view][foresight]") {
  double squares = 0, linear_squares = 0;
  int nonlinear = 0;
  press("cube6.json", Scheme::hyper, [&](PatchPair& pair) {
    // Before this the hand stands still; after it, 20 mm deep, the lattice snaps.
    if (pair.patch.stamp < Micros{1'300'000} || pair.next.stamp > Micros{1'600'000}) return;
    nonlinear += pair.terms.variables > 0;
    const auto off = [](const PatchPair& p) {
      const Foresight foresight = foresee(p);
      return (foresight.force - foresight.force_found).squaredNorm();
    };
    squares += off(pair);
    pair.terms = {};
    linear_squares += off(pair);
  });
  REQUIRE(nonlinear > 4);
  INFO("off by " << std::sqrt(squares / nonlinear) << " N rms, without terms " << std::sqrt(linear_squares / nonlinear));
  CHECK(squares < 0.01 * linear_squares);
}

TEST_CASE("Pins stand on the vertices that the frame has there, drawn where the body is now", "[view][foresight]") {
  const std::vector<Vec3f> frame{{0, 0, 0}, {0.01F, 0, 0}, {0, 0.01F, 0}}, shown{{0, 0, 1}, {0.01F, 0, 1}, {0, 0.01F, 1}};
  Foresight foresight;
  foresight.vertices = {{Vec3(0.0102, 0, 0), Vec3(0.01, 0, 0), true}, {Vec3(0, 0.009, 0), Vec3::Zero(), false}};
  const auto pins = pins_on(foresight, frame, shown);
  REQUIRE(pins.size() == 2);
  CHECK(pins[0].at == shown[1]);
  CHECK((pins[0].miss - Vec3f(2e-4F, 0, 0)).norm() < 1e-9F);
  CHECK(pins[1].at == shown[2]);
  CHECK_FALSE(pins[1].compared);
}

TEST_CASE("A patch that misses is seen on the body, and a longer miss as a longer line of another colour", "[view][foresight]") {
  const auto gl = context();
  if (!gl) return;
  demo::Body body = demo::pressed_organ(0.006F, 0, 3);
  body.tools.clear();
  const Triangle& on_top =
      *std::max_element(body.triangles.begin(), body.triangles.end(), [&](const Triangle& a, const Triangle& b) {
        return body.positions[a[0]].z() - body.positions[a[0]].y() < body.positions[b[0]].z() - body.positions[b[0]].y();
      });
  std::vector<PatchPin> pins;
  for (const std::uint32_t i : on_top) pins.push_back({body.positions[i], Vec3f(0, 0, 1e-4F), true});
  const std::vector<Triangle> triangle{{0, 1, 2}};
  Sight sight = demo::sight_of(body);
  sight.pin_triangles = triangle;
  const auto blue = [&] {
    Stage stage(640, 400, 1);
    Camera camera;
    camera.fit(body.triangles, body.rest, 1.6F);
    const Picture picture = stage.photograph(sight, {"demo", "a test", ""}, camera, {}, 640, 400);
    int count = 0;
    for (std::size_t i = 0; i < picture.rgb.size(); i += 3) count += picture.rgb[i + 2] > picture.rgb[i] + 60;
    return count;
  };
  const int bare = blue();
  sight.pins = pins;
  sight.miss_max_m = 1e-3F;
  const int small = blue();
  sight.miss_max_m = 1e-4F;
  const int full = blue();
  std::swap(pins[1], pins[2]);  // facing away: only the legend remains
  const int legend = blue();
  CHECK(legend > bare);
  CHECK(small < legend + 40);  // nearly white
  CHECK(full > legend + 150);
}
