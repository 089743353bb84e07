// Pictures drawn without a display, compared with an independent projection.
#include <png.h>
#include <sys/stat.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "client/view/stage.hpp"
#include "common/base/error.hpp"
#include "tests/client/view/demo_body.hpp"
#include "tests/client/view/offscreen.hpp"

using namespace palpate;

namespace {

constexpr int kPictureWidth = 640, kPictureHeight = 400;
constexpr float kAspect = static_cast<float>(kPictureWidth) / kPictureHeight;

Picture photograph(const demo::Body& body, const Look& look) {
  Stage stage(kPictureWidth, kPictureHeight, 1);
  Camera camera;
  camera.fit(body.triangles, body.rest, kAspect);
  return stage.photograph(demo::sight_of(body), {"demo", "a test", ""}, camera, look, kPictureWidth, kPictureHeight);
}

template <class Test>
double share(const Picture& picture, const Test& test) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < picture.rgb.size(); i += 3) {
    if (test(int{picture.rgb[i]}, int{picture.rgb[i + 1]}, int{picture.rgb[i + 2]})) ++count;
  }
  return static_cast<double>(count) / (kPictureWidth * kPictureHeight);
}

const auto kTissue = [](int r, int g, int b) { return r > g + 22 && r > b + 12; };
const auto kTeal = [](int r, int g, int b) { return g > r + 30 && b > r + 30; };
const auto kAmber = [](int r, int g, int b) { return r > 150 && g > b + 50; };

/// Share of the picture covered by the projected triangles: point in triangle at every pixel's centre.
double covered(const demo::Body& body) {
  Camera camera;
  camera.fit(body.triangles, body.rest, kAspect);
  const Eigen::Matrix4f m = camera.projection(kAspect) * camera.view();
  std::vector<bool> hit(static_cast<std::size_t>(kPictureWidth) * kPictureHeight, false);
  for (const Triangle& t : body.triangles) {
    std::array<Eigen::Vector2f, 3> p;
    for (std::size_t k = 0; k < 3; ++k) p[k] = to_pixels(m, body.positions[t[k]], kPictureWidth, kPictureHeight).head<2>();
    const auto side = [](const Eigen::Vector2f& a, const Eigen::Vector2f& b, const Eigen::Vector2f& c) {
      return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
    };
    const Eigen::Vector2f low = p[0].cwiseMin(p[1]).cwiseMin(p[2]), high = p[0].cwiseMax(p[1]).cwiseMax(p[2]);
    for (int y = std::max(0, static_cast<int>(low.y())); y < kPictureHeight && static_cast<float>(y) < high.y(); ++y) {
      for (int x = std::max(0, static_cast<int>(low.x())); x < kPictureWidth && static_cast<float>(x) < high.x(); ++x) {
        const Eigen::Vector2f c(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F);
        const float a = side(p[0], p[1], c), b = side(p[1], p[2], c), d = side(p[2], p[0], c);
        if ((a >= 0 && b >= 0 && d >= 0) || (a <= 0 && b <= 0 && d <= 0))
          hit[static_cast<std::size_t>(y * kPictureWidth + x)] = true;
      }
    }
  }
  return static_cast<double>(std::count(hit.begin(), hit.end(), true)) / (kPictureWidth * kPictureHeight);
}

}  // namespace

TEST_CASE("The body covers the part of the picture that its projection says, light and dark", "[view]") {
  const auto gl = context();
  if (!gl) return;
  demo::Body body = demo::pressed_organ(0.006F, 0);
  body.tools.clear();
  const double expected = covered(body);
  REQUIRE(expected > 0.15);
  for (const bool dark : {false, true}) {
    const Picture picture = photograph(body, {.dark = dark});
    CHECK(share(picture, kTissue) == Approx(expected).epsilon(0.06));
    CHECK(share(picture, kTeal) < 1e-3);
  }
}

TEST_CASE("The force arrow appears with contact and grows with the force", "[view]") {
  const auto gl = context();
  if (!gl) return;
  demo::Body body = demo::pressed_organ(0.006F, 0.4);
  const double weak = share(photograph(body, {}), kTeal);
  body.tools[0].force *= 2;
  const double strong = share(photograph(body, {}), kTeal);
  body.tools[0].contact = false;
  const double free = share(photograph(body, {}), kTeal);
  CHECK(free > 0);  // the collar of the instrument and the mark of the station
  CHECK(weak > free + 5e-4);
  CHECK(strong > weak + 5e-4);
}

TEST_CASE("A picture smaller than its words is drawn, with a force and everything else that is written over it", "[view]") {
  const auto gl = context();
  if (!gl) return;
  const demo::Body body = demo::pressed_organ(0.006F, 0.4);
  Camera camera;
  camera.fit(body.triangles, body.rest, 1);
  const std::vector<float> course(100, 0.5F);
  Caption caption{"a title that is wider than the picture", "a status", "keys"};
  caption.replay = ReplayState{Micros{0}, Micros{1'000'000}, Micros{500'000}, 1, true, course};
  for (const int size : {1, 64}) {
    Stage stage(size, size, 1);
    const Picture picture = stage.photograph(demo::sight_of(body), caption, camera, {.panels = true}, size, size);
    CHECK(picture.rgb.size() == static_cast<std::size_t>(3 * size * size));
  }
}

TEST_CASE("The force of a pull, which points into the body, shows through it", "[view]") {
  const auto gl = context();
  if (!gl) return;
  demo::Body body = demo::pressed_organ(-0.010F, -0.9);
  const double free = share(photograph(body, {}), kTeal);
  body.tools[0].contact = true;
  const Vec3f head = (body.tools[0].position + 0.04 * body.tools[0].force).cast<float>();  // for an arrow of 45 mm
  REQUIRE((head - Vec3f(0, 0, 0.03F)).norm() < 0.04F);                                     // inside
  CHECK(share(photograph(body, {}), kTeal) > free + 4e-4);
}

TEST_CASE("The bottom of an indentation is darker than the same place of the flat body, for what hides the light around it",
          "[view]") {
  const auto gl = context();
  if (!gl) return;
  for (const int levels : {4, 5}) {  // refined, and as it is
    const auto bottom = [&](float depth_m) {
      demo::Body body = demo::pressed_organ(depth_m, 0, levels);
      const std::vector<float> scalars(body.rest.size(), 0.0F);  // one colour
      Sight sight = demo::sight_of(body);
      sight.tools = {};
      sight.scalars = scalars;
      Camera camera;
      camera.look_from(Camera::Side::top);
      camera.fit(body.triangles, body.rest, kAspect);
      const Vec3f at = to_pixels(camera.projection(kAspect) * camera.view(), body.tools[0].position.cast<float>(), kPictureWidth,
                                 kPictureHeight);
      Stage stage(kPictureWidth, kPictureHeight, 1);
      const Picture picture = stage.photograph(sight, {"demo", "a test", ""}, camera, {}, kPictureWidth, kPictureHeight);
      double sum = 0;
      for (int y = -3; y <= 3; ++y)
        for (int x = -3; x <= 3; ++x)
          sum += picture.rgb[3 * static_cast<std::size_t>((static_cast<int>(at.y()) + y) * kPictureWidth +
                                                          static_cast<int>(at.x()) + x)];
      return sum;
    };
    CHECK(bottom(0.010F) < 0.92 * bottom(0));
  }
}

TEST_CASE("While colours show displacement the legend says so, whatever was asked for", "[view]") {
  const auto gl = context();
  if (!gl) return;
  const demo::Body body = demo::pressed_organ(0.006F, 0.4);
  const Picture displacement = photograph(body, {}), asked = photograph(body, {.color = ShapeChannel::tension});
  CHECK(asked.rgb == displacement.rgb);
}

TEST_CASE("An indentation glows where it is deep and a body at rest does not", "[view]") {
  const auto gl = context();
  if (!gl) return;
  demo::Body rest = demo::pressed_organ(0, 0), deep = demo::pressed_organ(0.010F, 0);
  rest.tools.clear();
  deep.tools.clear();
  const double legend = share(photograph(rest, {.dark = true}), kAmber);
  CHECK(share(photograph(deep, {.dark = true}), kAmber) > legend + 2e-3);
}

TEST_CASE("The side that faces the key light is brighter than the side that faces the floor", "[view]") {
  const auto gl = context();
  if (!gl) return;
  demo::Body body = demo::pressed_organ(0, 0);
  body.tools.clear();
  const Picture picture = photograph(body, {.dark = true});
  Camera camera;
  camera.fit(body.triangles, body.rest, kAspect);
  const Eigen::Matrix4f m = camera.projection(kAspect) * camera.view();
  std::vector<Vec3f> normals;
  update_normals(body.triangles, body.rest, normals);
  double up = 0, down = 0;
  int ups = 0, downs = 0;
  for (std::size_t i = 0; i < body.rest.size(); ++i) {
    const Vec3f& n = normals[i];
    if (n.dot(camera.axes().col(2)) < 0.25F) continue;
    const Vec3f at = to_pixels(m, body.rest[i], kPictureWidth, kPictureHeight);
    const auto pixel = 3 * (static_cast<std::size_t>(at.y()) * kPictureWidth + static_cast<std::size_t>(at.x()));
    const int light = picture.rgb[pixel] + picture.rgb[pixel + 1] + picture.rgb[pixel + 2];
    if (n.z() > 0.6F) up += light, ++ups;
    if (n.z() < -0.2F) down += light, ++downs;
  }
  REQUIRE(ups > 20);
  REQUIRE(downs > 20);
  CHECK(up / ups > 1.4 * down / downs);
}

TEST_CASE("The wireframe draws dark edges and an empty scene draws a background", "[view]") {
  const auto gl = context();
  if (!gl) return;
  demo::Body body = demo::pressed_organ(0, 0, 3);
  body.tools.clear();
  const auto dark_red = [](int r, int g, int b) { return r < 90 && r > g + 15 && r > b + 15; };
  CHECK(share(photograph(body, {.lines = Lines::edges}), dark_red) > 0.02 + share(photograph(body, {}), dark_red));
  const Picture empty = photograph(demo::Body{}, {});
  CHECK(share(empty, kTissue) < 0.02);  // only the legend
  CHECK(share(empty, [](int r, int g, int b) { return r > 150 && g > 150 && b > 150; }) > 0.9);
}

TEST_CASE("A picture is read back from its file as it was, and a folder that is not there is an error", "[view]") {
  Picture picture{3, 2, {255, 0, 0, 0, 255, 0, 0, 0, 255, 1, 2, 3, 40, 50, 60, 250, 251, 252}};
  const auto file = std::filesystem::temp_directory_path() / "palpate_test_picture.png";
  write_png(file, picture);
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  REQUIRE(png_image_begin_read_from_file(&image, file.c_str()));
  REQUIRE(image.width == 3);
  REQUIRE(image.height == 2);
  image.format = PNG_FORMAT_RGB;
  std::vector<std::uint8_t> rgb(PNG_IMAGE_SIZE(image));
  REQUIRE(png_image_finish_read(&image, nullptr, rgb.data(), 0, nullptr));
  std::filesystem::remove(file);
  REQUIRE(rgb == picture.rgb);
  REQUIRE_THROWS_AS(write_png("/nonexistent/picture.png", picture), std::runtime_error);
  const auto pipe = std::filesystem::temp_directory_path() / ("palpate_test_pipe_" + std::to_string(::getpid()));
  REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
  CHECK_THROWS_AS(write_png(pipe, picture), InputError);
  CHECK(std::filesystem::is_fifo(pipe));
  std::filesystem::remove(pipe);
  std::filesystem::create_symlink(file, pipe);
  write_png(pipe, picture);
  CHECK(std::filesystem::is_symlink(pipe));
  CHECK(std::filesystem::is_regular_file(file));
  std::filesystem::remove(pipe);
  std::filesystem::remove(file);
}
