// Pictures of known scenes, compared with stored ones. Drivers round differently, so pictures are compared as means over
// 8 x 8 pixels: fewer than kTolerated of these may differ by more than kLevels of 255. What that lets through, and what not, is
// part of the test. After a change that is meant, `test_view "[.write-pictures]"` stores the pictures anew: look at them.
#include <png.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <functional>
#include <memory>

#include "client/view/stage.hpp"
#include "tests/view/demo_body.hpp"
#include "tests/view/offscreen.hpp"

using namespace palpate;

namespace {

constexpr int kWidth = 480, kHeight = 304, kBlock = 8, kLevels = 10;
constexpr double kTolerated = 0.003;

struct Scenery {
  const char* name;
  Look look;
  demo::Body body;
  std::vector<MeshVertex> vertices;  ///< one end of the body is held fast
  Sight sight() const {
    Sight s = demo::sight_of(body);
    s.vertices = vertices;
    return s;
  }
};

std::vector<Scenery> sceneries() {
  const demo::Body pressed = demo::pressed_organ(0.008F, 0.9, 3);
  std::vector<MeshVertex> vertices;
  for (const Vec3f& x : pressed.rest) vertices.push_back({x.cast<double>(), x.x() > 0.05F});
  return {{"press_light", {}, pressed, vertices},
          {"press_dark", {.dark = true}, pressed, vertices},
          {"strain", {.lines = Lines::strain}, pressed, vertices}};
}

std::filesystem::path stored(const Scenery& scenery) {
  return std::filesystem::path(PALPATE_SOURCE_DIR) / "tests/view/pictures" / (std::string(scenery.name) + ".png");
}

Picture draw(const Scenery& scenery, const Sight& sight, int times_as_large = 1, float density = 1) {
  const int width = times_as_large * kWidth, height = times_as_large * kHeight;
  Stage stage(width, height, density);
  Camera camera;
  camera.fit(scenery.body.triangles, scenery.body.rest, static_cast<float>(kWidth) / kHeight);
  return stage.photograph(sight, {"organ", "a stored picture", "", {}}, camera, scenery.look, width, height);
}
Picture draw(const Scenery& scenery) { return draw(scenery, scenery.sight()); }

Picture read_png(const std::filesystem::path& file) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  REQUIRE(png_image_begin_read_from_file(&image, file.c_str()));
  image.format = PNG_FORMAT_RGB;
  Picture picture{static_cast<int>(image.width), static_cast<int>(image.height), {}};
  picture.rgb.resize(PNG_IMAGE_SIZE(image));
  REQUIRE(png_image_finish_read(&image, nullptr, picture.rgb.data(), 0, nullptr));
  return picture;
}

double mean(const Picture& picture, int left, int top, int channel) {
  double sum = 0;
  for (int y = top; y < top + kBlock; ++y)
    for (int x = left; x < left + kBlock; ++x)
      sum += picture.rgb[static_cast<std::size_t>(3 * (y * picture.width + x) + channel)];
  return sum / (kBlock * kBlock);
}

/// Share of the blocks that differ.
double difference(const Picture& a, const Picture& b) {
  REQUIRE(a.width == b.width);
  REQUIRE(a.height == b.height);
  int differ = 0, all = 0;
  for (int y = 0; y + kBlock <= a.height; y += kBlock)
    for (int x = 0; x + kBlock <= a.width; x += kBlock, ++all) {
      double worst = 0;
      for (int c = 0; c < 3; ++c) worst = std::max(worst, std::abs(mean(a, x, y, c) - mean(b, x, y, c)));
      differ += worst > kLevels;
    }
  return static_cast<double>(differ) / all;
}

/// As an eye sees it that does not tell the pixels of the denser picture apart.
Picture halved(const Picture& fine) {
  Picture picture{fine.width / 2, fine.height / 2, {}};
  const auto at = [&](int x, int y, int c) { return int{fine.rgb[static_cast<std::size_t>(3 * (y * fine.width + x) + c)]}; };
  for (int y = 0; y < fine.height; y += 2)
    for (int x = 0; x < fine.width; x += 2)
      for (int c = 0; c < 3; ++c)
        picture.rgb.push_back(
            static_cast<std::uint8_t>((at(x, y, c) + at(x + 1, y, c) + at(x, y + 1, c) + at(x + 1, y + 1, c) + 2) / 4));
  return picture;
}

}  // namespace

TEST_CASE("Known scenes look like their stored pictures", "[view]") {
  const auto gl = context();
  if (!gl) return;
  for (const Scenery& scenery : sceneries()) {
    CAPTURE(scenery.name);
    CHECK(difference(draw(scenery), read_png(stored(scenery))) < kTolerated);
  }
}

TEST_CASE("A picture without its tool, with flipped normals or other faults is told from the stored one", "[view]") {
  const auto gl = context();
  if (!gl) return;
  const Scenery scenery = sceneries()[0];
  const Picture good = read_png(stored(scenery));
  demo::Body turned = scenery.body;  // inside out: every normal flips
  for (Triangle& t : turned.triangles) std::swap(t[1], t[2]);
  demo::Body moved = scenery.body;
  moved.tools[0].position.x() += 0.02;
  demo::Body free = scenery.body;
  free.tools[0].contact = false;
  const auto with = [&](const std::function<void(Sight&)>& change) {
    Sight sight = scenery.sight();
    change(sight);
    return difference(draw(scenery, sight), good);
  };
  CHECK(with([](Sight& s) { s.tools = {}; }) > 2 * kTolerated);
  CHECK(with([&](Sight& s) { s.triangles = turned.triangles; }) > 2 * kTolerated);
  CHECK(with([&](Sight& s) { s.tools = moved.tools; }) > 2 * kTolerated);
  CHECK(with([&](Sight& s) { s.tools = free.tools; }) > 2 * kTolerated);
  CHECK(with([&](Sight& s) { s.positions = scenery.body.rest; }) > 2 * kTolerated);  // colours and dent
  CHECK(with([](Sight& s) { s.color_max *= 2; }) > 2 * kTolerated);
  CHECK(with([](Sight& s) { s.vertices = {}; }) > 2 * kTolerated);  // what is held fast
  Scenery unlit = scenery, lines = scenery;
  unlit.look.shadow_taps = 0;  // the shader divides by it: shadows break
  lines.look.lines = Lines::edges;
  CHECK(difference(draw(unlit), good) > 2 * kTolerated);
  CHECK(difference(draw(lines), good) > 2 * kTolerated);
}

TEST_CASE("On a display twice as dense words, scales, panels and body are as large as on another", "[view]") {
  const auto gl = context();
  if (!gl) return;
  constexpr double kAlike = 0.02;  // letters and edges are finer
  for (Scenery scenery : sceneries()) {
    CAPTURE(scenery.name);
    const Picture known = read_png(stored(scenery));
    const auto differs = [&](float density) { return difference(halved(draw(scenery, scenery.sight(), 2, density)), known); };
    CHECK(differs(2) < kAlike);
    CHECK(differs(1) > 2 * kAlike);
    scenery.look.smooth_edges = false;  // as drawn in software, the body in points
    scenery.look.pixel = 2;
    CHECK(differs(2) < kAlike);
  }
}

TEST_CASE("Stores the pictures anew", "[.write-pictures]") {
  const OffscreenContext gl;
  for (const Scenery& scenery : sceneries()) write_png(stored(scenery), draw(scenery));
}
