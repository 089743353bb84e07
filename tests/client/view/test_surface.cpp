#include <catch2/catch.hpp>

#include "client/view/camera.hpp"
#include "client/view/cavity.hpp"
#include "client/view/round_125.hpp"
#include "client/view/stage.hpp"
#include "client/viewer/color.hpp"
#include "tests/client/view/demo_body.hpp"

using namespace palpate;

namespace {

struct ShadedShape {
  std::vector<Vec3f> normals;
  std::vector<float> cavity;
};
ShadedShape shape_of(const demo::Body& body, const std::vector<Vec3f>& positions) {
  ShadedShape shape;
  Cavity cavity;
  cavity.prepare(body.triangles, body.rest);
  update_normals(body.triangles, positions, shape.normals);
  cavity.measure(positions, shape.normals, shape.cavity);
  return shape;
}

}  // namespace

TEST_CASE("On a sphere the normals are the positions, and it is equally convex everywhere and in every mesh", "[view]") {
  for (const int levels : {3, 4, 5}) {
    const demo::Body body = demo::unit_sphere(levels);
    const ShadedShape shape = shape_of(body, body.rest);
    const float convex = -0.5F * Cavity::kReach * bounds(body.triangles, body.rest).diagonal();  // R times 1/radius, over 2
    for (std::size_t i = 0; i < body.rest.size(); ++i) {
      REQUIRE((shape.normals[i] - body.rest[i]).norm() < 0.03F);
      REQUIRE(shape.cavity[i] == Approx(convex).epsilon(0.1));
    }
  }
}

TEST_CASE("The bottom of an indentation is as hollow in a coarse mesh as in a fine one, and its surroundings are not", "[view]") {
  for (const int levels : {4, 5, 6}) {
    const demo::Body body = demo::pressed_organ(0.009F, 1, levels);
    const ShadedShape shape = shape_of(body, body.positions);
    const Vec3f tip = body.tools[0].position.cast<float>();
    for (std::size_t i = 0; i < body.positions.size(); ++i) {
      if ((body.positions[i] - tip).norm() < 0.002F) CHECK(shape.cavity[i] == Approx(0.33).margin(0.06));
      if (body.positions[i].z() < 0.01F) REQUIRE(shape.cavity[i] < 0);
    }
  }
}

TEST_CASE("A surface is closed when every edge has two sides", "[view]") {
  demo::Body body = demo::unit_sphere(2);
  CHECK(is_closed(body.triangles));
  std::swap(body.triangles[3][0], body.triangles[3][1]);
  CHECK_FALSE(is_closed(body.triangles));
  body.triangles.erase(body.triangles.begin() + 3);
  CHECK_FALSE(is_closed(body.triangles));
  CHECK_FALSE(is_closed({}));
}

TEST_CASE("Vertices without a triangle and empty surfaces do no harm", "[view]") {
  demo::Body alone_body;
  alone_body.rest = {Vec3f(1, 2, 3)};
  const ShadedShape shape = shape_of(alone_body, alone_body.rest);
  const auto& alone = alone_body.rest;
  REQUIRE(shape.normals[0] == Vec3f::UnitZ());
  REQUIRE(shape.cavity[0] == 0);
  REQUIRE(bounds({}, alone).center() == alone[0]);
  REQUIRE(bounds({}, {}).diagonal() > 0);
}

TEST_CASE("A fitted camera sees every vertex, from every side and in every format", "[view]") {
  const demo::Body body = demo::pressed_organ(0, 0);
  for (const float aspect : {0.5F, 1.0F, 1.6F, 3.0F}) {
    for (const auto side : {Camera::Side::three_quarter, Camera::Side::top, Camera::Side::front, Camera::Side::side}) {
      Camera camera;
      camera.look_from(side);
      camera.fit(body.triangles, body.rest, aspect);
      const Eigen::Matrix4f m = camera.projection(aspect) * camera.view();
      float reach = 0;
      for (const Vec3f& p : body.rest) {
        const Vec3f at = to_pixels(m, p, 100 * aspect, 100);
        REQUIRE(at.z() < 1);
        REQUIRE(at.z() > -1);
        reach = std::max({reach, std::abs(at.x() / (100 * aspect) - 0.5F), std::abs(at.y() / 100 - 0.5F)});
      }
      REQUIRE(reach < 0.5F);
      REQUIRE(reach > 0.2F);
    }
  }
}

TEST_CASE("A fitted camera keeps the body out from under the panels", "[view]") {
  const demo::Body body = demo::pressed_organ(0, 0);
  constexpr float kWidth = 1280, kHeight = 800, kCovered = 0.33F;
  Camera camera;
  camera.fit(body.triangles, body.rest, kWidth / kHeight, kCovered);
  const Eigen::Matrix4f m = camera.projection(kWidth / kHeight) * camera.view();
  float left = kWidth, right = 0;
  for (const Vec3f& p : body.rest) {
    const float x = to_pixels(m, p, kWidth, kHeight).x();
    left = std::min(left, x);
    right = std::max(right, x);
  }
  const float free = (1 - kCovered) * kWidth;
  CHECK(left > 0);
  CHECK(right < free);
  CHECK(right - left > 0.5F * free);
  CHECK(0.5F * (left + right) == Approx(0.5F * free).margin(0.05 * free));
}

TEST_CASE("From the top, right is x and up is y, and dragging right turns the body with the mouse", "[view]") {
  Camera camera;
  camera.look_from(Camera::Side::top);
  REQUIRE((camera.axes().col(0) - Vec3f::UnitX()).norm() < 1e-6F);
  REQUIRE((camera.axes().col(1) - Vec3f::UnitY()).norm() < 1e-6F);
  camera.look_from(Camera::Side::front);
  const Vec3f front = -Vec3f::UnitY();
  const float before = camera.axes().col(0).dot(front);
  camera.orbit(0.1F, 0);
  REQUIRE(camera.axes().col(0).dot(front) > before);
}

TEST_CASE("Equal steps of displacement are equal steps of lightness in OKLab", "[view]") {
  const auto lightness = [](const Vec3f& srgb) {
    const Vec3f c = to_linear(srgb);
    const float l = 0.4122214708F * c.x() + 0.5363325363F * c.y() + 0.0514459929F * c.z();
    const float m = 0.2119034982F * c.x() + 0.6806995451F * c.y() + 0.1073969566F * c.z();
    const float s = 0.0883024619F * c.x() + 0.2817188376F * c.y() + 0.6299787005F * c.z();
    return 0.2104542553F * std::cbrt(l) + 0.7936177850F * std::cbrt(m) - 0.0040720468F * std::cbrt(s);
  };
  const float first = lightness(displacement_color(0)), last = lightness(displacement_color(1));
  REQUIRE(last - first > 0.4F);
  for (int i = 1; i < 20; ++i) {
    const float s = static_cast<float>(i) / 20;
    REQUIRE(lightness(displacement_color(s)) == Approx(first + s * (last - first)).margin(0.004));
  }
}

TEST_CASE("Scales are round numbers that cover what is seen and never shrink", "[view]") {
  REQUIRE(round_up_125(0.003F) == Approx(0.005F));
  REQUIRE(round_up_125(0.005F) == Approx(0.005F));
  REQUIRE(round_up_125(0.0051F) == Approx(0.01F));
  REQUIRE(round_down_125(0.049F) == Approx(0.02F));
  REQUIRE(round_down_125(0.011F) == Approx(0.01F));
  Scales scales;
  const demo::Body deep = demo::pressed_organ(0.009F, 2), flat = demo::pressed_organ(0.0005F, 0.1);
  scales.see(deep.triangles, deep.positions, deep.rest, deep.tools);
  const float displacement = scales.color_max(ShapeChannel::position), arrow = scales.arrow_m_per_n();
  REQUIRE(displacement == Approx(0.01F));
  scales.see(flat.triangles, flat.positions, flat.rest, flat.tools);
  REQUIRE(scales.color_max(ShapeChannel::position) == displacement);
  REQUIRE(scales.arrow_m_per_n() == arrow);
  const std::vector<float> reach{0.2F, 0.9F}, tension{0.1F, 0.18F};
  scales.see(flat.triangles, flat.positions, flat.rest, flat.tools, ShapeChannel::support, reach);
  scales.see(flat.triangles, flat.positions, flat.rest, flat.tools, ShapeChannel::tension, tension);
  CHECK(scales.color_max(ShapeChannel::tension) == Approx(0.2F));  // separate ranges, as they have different units
  CHECK(scales.color_max(ShapeChannel::support) == Approx(1));
}

TEST_CASE("A depth is the way to the surface from inside, nothing outside, and nothing of a surface that is not closed",
          "[view]") {
  const std::vector<Vec3f> corners{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  std::vector<Triangle> faces{{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  const DepthGauge closed(faces, corners);
  CHECK(closed.at(Vec3(0.3, 0.3, 0.1)) == Approx(0.1));
  CHECK(closed.at(Vec3(0.3, 0.3, -0.1)) == 0);
  CHECK(closed.at(Vec3(1, 1, 1)) == 0);
  faces.pop_back();
  CHECK(DepthGauge(faces, corners).at(Vec3(0.3, 0.3, 0.1)) == 0);
}
