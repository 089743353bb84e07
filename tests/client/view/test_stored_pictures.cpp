// Pictures of known scenes, compared with stored ones. Drivers round differently, so pictures are compared as means over 8 x 8
// pixels: fewer than kTolerated of these may differ by more than kLevels of 255. The test also checks which differences this
// accepts and which not. After an intended change, `test_view "[.write-pictures]"` stores the pictures anew: look at them.
#include <png.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <functional>
#include <memory>

#include "client/view/foresight.hpp"
#include "client/view/stage.hpp"
#include "tests/client/view/demo_body.hpp"
#include "tests/client/view/offscreen.hpp"

using namespace palpate;

namespace {

constexpr int kStoredPicturesWidth = 480, kStoredPicturesHeight = 304, kBlock = 8, kLevels = 10;
constexpr double kTolerated = 0.003;

struct Scenery {
  const char* name;
  Look look;
  demo::Body body = {};
  std::vector<MeshVertex> vertices = {};  ///< those on one side are fixed
  float zoom = 0;
  bool words = false;  ///< panels, the replay bar, and the patch's prediction
  std::vector<float> scalars = {};
  std::vector<BodyName> bodies = {};
  std::vector<PatchPin> pins = {};
  std::vector<Triangle> pin_triangles = {};
  int width = kStoredPicturesWidth, height = kStoredPicturesHeight;

  Sight sight() const {
    Sight s = demo::sight_of(body);
    s.vertices = vertices;
    s.scalars = scalars;
    s.bodies = bodies;
    s.pins = pins;
    s.pin_triangles = pin_triangles;
    if (!scalars.empty()) s.color = ShapeChannel::tension, s.color_max = 1;
    return s;
  }
};

std::vector<MeshVertex> held_at_the_end(const demo::Body& body) {
  std::vector<MeshVertex> vertices;
  for (const Vec3f& x : body.rest) vertices.push_back({x.cast<double>(), x.x() > 0.05F});
  return vertices;
}

/// So many triangles that they are drawn unrefined, and so close that ring and arrow are large.
Scenery fine() {
  demo::Body body = demo::pressed_organ(0.010F, 0.6, 5);
  return {.name = "fine", .look = {.dark = true}, .body = body, .vertices = held_at_the_end(body), .zoom = 5};
}

/// A tool that pulls the body, so the arrow shows through it. All texts are next to it.
Scenery pulled() {
  Scenery s{.name = "pulled", .look = {.lines = Lines::edges}, .words = true, .width = 960, .height = 608};
  s.body = demo::pressed_organ(-0.012F, -0.9, 3);
  s.body.tools[0].contact = true;
  for (std::size_t i = 0; i < s.body.rest.size(); ++i) s.scalars.push_back(80 * (s.body.positions[i] - s.body.rest[i]).norm());
  const Vec3f tool = s.body.tools[0].position.cast<float>();
  for (const Triangle& t : s.body.triangles) {
    if ((s.body.positions[t[0]] - tool).norm() > 0.03F) continue;
    const auto first = static_cast<std::uint32_t>(s.pins.size());
    for (const std::uint32_t i : t) s.pins.push_back({s.body.positions[i], Vec3f(0, 0, 6e-5F), true});
    s.pin_triangles.push_back({first, first + 1, first + 2});
  }
  return s;
}

/// Three bodies side by side: the middle one is hidden under the tool's indentation in part.
Scenery several() {
  Scenery s{.name = "several", .look = {}, .body = demo::pressed_organ(0.008F, 0.9, 3)};
  s.bodies = {{"left", 0x8a3b32}, {"middle", 0x3f7f6a}, {"right", 0xd9b36c}};
  for (const Vec3f& x : s.body.rest)
    s.vertices.push_back({x.cast<double>(), false, false, static_cast<std::uint8_t>(x.x() < -0.02F ? 0 : x.x() < 0.02F ? 1 : 2)});
  return s;
}

std::vector<Scenery> sceneries() {
  const demo::Body pressed = demo::pressed_organ(0.008F, 0.9, 3);
  const auto held = held_at_the_end(pressed);
  return {{.name = "press_light", .look = {}, .body = pressed, .vertices = held},
          {.name = "press_dark", .look = {.dark = true}, .body = pressed, .vertices = held},
          {.name = "strain", .look = {.lines = Lines::strain}, .body = pressed, .vertices = held},
          fine(),
          pulled(),
          several()};
}

/// Texts of the panels and the replay bar of a picture.
struct Words {
  RoomView room{1515,
                Micros{16'500},
                20,
                3.2,
                {{"hand", Micros{41'000}, Micros{900}, Micros{80'000}, 100, 3, 12, 16, Scheme::port},
                 {"hand/hold", Micros{42'000}, Micros{1'200}, Micros{95'000}, 100, 0, 0, 0, Scheme::hold},
                 {"hand/tangent", Micros{43'000}, Micros{800}, Micros{95'000}, 100, 1, 0, 0, {Scheme::tangent}}}};
  History forces, patch_ages;
  Foresight foresight;
  std::vector<float> course;

  Words() {
    for (int k = 0; k < 200; ++k) {
      const Micros t = k * Micros{50'000};
      forces.add(t, "hand", static_cast<float>(1 + std::sin(0.1 * k)));
      patch_ages.add(t, "hand", static_cast<float>(70 + k % 20));
      patch_ages.add(t, "hand/hold", static_cast<float>(90 + k / 10));
      patch_ages.add(t, "hand/tangent", static_cast<float>(60 - k / 10));
      course.push_back(static_cast<float>(0.5 + 0.5 * std::sin(0.1 * k)));
    }
    foresight.at = Micros{50'000};
    foresight.compared = 9;
    foresight.miss_rms_m = 4e-5;
    foresight.miss_max_m = 9e-5;
  }
  Caption caption() const {
    Caption caption{"organ", "a stored picture", "Q quit"};
    caption.panels = {.room = &room, .forces = &forces, .patch_ages = &patch_ages, .foresight = &foresight, .stations = {"hand"}};
    caption.panels.now = Micros{10'000'000};
    caption.replay = ReplayState{Micros{0}, Micros{10'000'000}, Micros{6'000'000}, 2, true, course};
    return caption;
  }
};

std::filesystem::path stored(const Scenery& scenery) {
  return std::filesystem::path(PALPATE_SOURCE_DIR) / "tests/client/view/pictures" / (std::string(scenery.name) + ".png");
}

Picture draw(const Scenery& scenery, const Sight& sight, int times_as_large = 1, float density = 1) {
  const int width = times_as_large * scenery.width, height = times_as_large * scenery.height;
  Stage stage(width, height, density);
  Camera camera;
  camera.fit(scenery.body.triangles, scenery.body.rest, static_cast<float>(width) / static_cast<float>(height),
             covered_by_panels(scenery.look, width, height, density));
  camera.zoom(scenery.zoom);
  const Words words;
  const Caption caption = scenery.words ? words.caption() : Caption{"organ", "a stored picture", "", {}};
  return stage.photograph(sight, caption, camera, scenery.look, width, height);
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

/// Averages pairs of pixels, as an eye that does not resolve the denser picture.
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
  CHECK(with([&](Sight& s) { s.positions = scenery.body.rest; }) > 2 * kTolerated);  // colours and indentation
  CHECK(with([](Sight& s) { s.color_max *= 2; }) > 2 * kTolerated);
  CHECK(with([](Sight& s) { s.vertices = {}; }) > 2 * kTolerated);  // fixed vertices
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
    scenery.look.smooth_edges = false;  // as drawn in software, with the body in points
    scenery.look.pixel = 2;
    CHECK(differs(2) < kAlike);
  }
}

TEST_CASE("Stores the pictures anew", "[.write-pictures]") {
  const OffscreenContext gl;
  for (const Scenery& scenery : sceneries()) write_png(stored(scenery), draw(scenery));
}
