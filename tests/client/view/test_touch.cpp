// A mouse that touches a body, without a window: a scripted pointer, the mouse's device, the real client and server cores and a
// real body, in virtual time.
#include <array>
#include <catch2/catch.hpp>

#include "client/core/client_core.hpp"
#include "client/device/mouse_device.hpp"
#include "client/view/pointer_tool.hpp"
#include "server/core/server_core.hpp"
#include "server/room/room.hpp"

using namespace palpate;

namespace {

constexpr float kTouchWidth = 1280, kTouchHeight = 800;
constexpr Micros kPicture{16'667};

struct Hand {
  Micros now{1'000'000}, next_picture{now};
  Scene scene;
  Room room;
  ServerCore server;
  ClientCore client;
  MouseDevice mouse;
  std::vector<Vec3f> rest;
  Camera camera;
  PointerTool tool;
  Pointer pointer{kTouchWidth / 2, kTouchHeight / 2, kTouchWidth, kTouchHeight, false};
  TickOutput felt;
  Vec3 place = Vec3::Zero();
  double step_max_m = 0;

  static ClientOptions options() {
    ClientOptions o;
    o.hello.station = "mouse";
    return o;
  }
  static std::vector<Vec3f> rest_of(const RoomInfo& facts) {
    std::vector<Vec3f> rest;
    for (const MeshVertex& v : facts.mesh.vertices) rest.push_back(v.rest.cast<float>());
    return rest;
  }

  explicit Hand(const std::string& name)
      : scene(load_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/" + name)),
        room(scene),
        server(facts_of(scene, home_of(scene)), {.draw = repeatable(5), .rate_hz = 20}),
        client(options(), now),
        mouse(home_of(scene)),
        rest(rest_of(server.facts())),
        tool(server.facts().mesh.triangles, rest, scene.tool.contact, home_of(scene)),
        place(home_of(scene)) {
    camera.fit(server.facts().mesh.triangles, rest, kTouchWidth / kTouchHeight);
    server.tick(now);
    room.start(server.body_time());
  }

  void step() {
    if (now >= next_picture) {
      mouse.aim(tool.target(camera, pointer, kPicture));
      next_picture += kPicture;
    }
    const Vec3 next = mouse.read(now).position;
    step_max_m = std::max(step_max_m, (next - place).norm());
    place = next;
    felt = client.haptic().tick({now, place});
    mouse.write(felt.force);
    std::array<std::byte, kMaxDatagramBytes> out;
    client.tick(now);
    while (const auto size = client.emit(out, now)) server.take({out.data(), size}, 1, now);
    server.tick(now);
    if (const auto job = server.next_job(now)) server.finish(room.run(*job), now);
    PeerId to = 0;
    while (const auto size = server.emit(out, to, now)) client.take({out.data(), size}, now);
    now += kTick;
  }
  void run(Micros time) {
    for (const auto end = now + time; now < end;) step();
  }
};

}  // namespace

TEST_CASE("A mouse over a body hovers, pressed it pushes in and is pushed back, let go it is free", "[view][touch]") {
  Hand hand("touch-cube.json");
  hand.run(Micros{600'000});
  CHECK(hand.felt.force.norm() == 0);
  hand.pointer.held = true;
  hand.run(Micros{500'000});
  const double pressed = hand.felt.force.norm();
  CHECK(pressed > 0.05);
  hand.tool.deepen(3);
  hand.run(Micros{400'000});
  CHECK(hand.felt.force.norm() > pressed);
  for (int i = 0; i < 12; ++i) {  // a stroke
    hand.pointer.x += 4;
    hand.run(Micros{33'000});
    CHECK(hand.felt.force.norm() > 0.02);
  }
  hand.pointer.held = false;
  hand.run(Micros{500'000});
  CHECK(hand.felt.force.norm() == 0);
  CHECK(hand.step_max_m <= 1e-3 * MouseDevice::kSpeedMaxMS);
}

TEST_CASE("A pointer that jumps to another side of the body leads the tool around it", "[view][touch]") {
  Hand hand("touch-cube.json");
  const Box box = bounds(hand.server.facts().mesh.triangles, hand.rest);
  const auto show = [&](const Vec3f& point) {
    const Eigen::Matrix4f m = hand.camera.projection(kTouchWidth / kTouchHeight) * hand.camera.view();
    const Vec3f at = to_pixels(m, point, kTouchWidth, kTouchHeight);
    hand.pointer.x = at.x();
    hand.pointer.y = at.y();
  };
  const Vec3f center = box.center(), half = 0.5F * (box.high - box.low);
  const std::array<Vec3f, 3> sides{center + Vec3f(0, 0, half.z()), center + Vec3f(half.x(), 0, 0),
                                   center - Vec3f(0, half.y(), 0)};
  for (const auto& [from, to] : {std::pair{0, 1}, {1, 2}, {2, 0}, {0, 2}}) {
    show(sides[static_cast<std::size_t>(from)]);
    hand.run(Micros{1'000'000});
    show(sides[static_cast<std::size_t>(to)]);
    for (int k = 0; k < 1000; ++k) {
      hand.step();
      CHECK(hand.felt.force.norm() == 0);
      const Vec3f inside = half - (hand.place.cast<float>() - center).cwiseAbs();
      CHECK(inside.minCoeff() < 0);
    }
  }
}

TEST_CASE("A mouse takes the node of a grasp, pulls it and lets it go home", "[view][touch]") {
  Hand hand("cube6.json");
  const Vec3 home = home_of(hand.scene);
  hand.run(Micros{600'000});
  CHECK((hand.place - home).norm() < 1e-6);
  hand.pointer.held = true;
  hand.run(Micros{100'000});
  for (int i = 0; i < 10; ++i) {
    hand.pointer.y -= 6;
    hand.run(Micros{33'000});
  }
  hand.run(Micros{200'000});
  const Vec3 pulled = hand.place - home;
  CHECK(pulled.norm() > 0.005);
  CHECK(pulled.dot(hand.camera.axes().col(1).cast<double>()) > 0.99 * pulled.norm());  // up in the picture
  CHECK(hand.felt.force.dot(pulled) < 0);                                              // pulled back
  hand.pointer.held = false;
  hand.run(Micros{800'000});
  CHECK((hand.place - home).norm() < 1e-5);
}

TEST_CASE("Rays meet the near side of a surface, and miss beside it", "[view][touch]") {
  const std::vector<Vec3f> x{{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}, {-1, -1, -1}, {1, -1, -1}, {0, 1, -1}};
  const std::vector<Triangle> triangles{{3, 4, 5}, {0, 1, 2}};
  const auto hit = first_hit(triangles, x, Vec3f(0.1F, 0, 5), Vec3f(0, 0, -1));
  REQUIRE(hit);
  CHECK((hit->point - Vec3f(0.1F, 0, 0)).norm() < 1e-6F);
  CHECK((hit->normal - Vec3f(0, 0, 1)).norm() < 1e-6F);
  CHECK_FALSE(first_hit(triangles, x, Vec3f(3, 0, 5), Vec3f(0, 0, -1)));
  CHECK_FALSE(first_hit(triangles, x, Vec3f(0, 0, 5), Vec3f(0, 0, 1)));  // behind
}
