// A picture without changes since the last one is not redrawn, and the result is identical.
#include <catch2/catch.hpp>
#include <functional>
#include <string>
#include <vector>

#include "client/view/stage.hpp"
#include "tests/client/view/demo_body.hpp"
#include "tests/client/view/offscreen.hpp"

using namespace palpate;

namespace {

constexpr int kRedrawWidth = 320, kRedrawHeight = 200;

struct Shot {
  demo::Body body = demo::pressed_organ(0.008F, 0.9, 3);
  std::vector<MeshVertex> vertices = std::vector<MeshVertex>(body.rest.size(), MeshVertex{});
  std::vector<float> scalars = {};
  float color_max = 0.01F;
  Camera camera = {};
  Look look = {};
  int width = kRedrawWidth;

  Shot() { camera.fit(body.triangles, body.rest, static_cast<float>(kRedrawWidth) / kRedrawHeight); }
  Picture by(Stage& stage) const {
    Sight sight = demo::sight_of(body);
    sight.vertices = vertices;
    sight.scalars = scalars;
    sight.color_max = color_max;
    return stage.photograph(sight, {"organ", "", "", {}}, camera, look, width, kRedrawHeight);
  }
};

struct Change {
  std::string what;
  std::function<void(Shot&)> make;
};

const std::vector<Change> kChanges{
    {"the camera turns", [](Shot& s) { s.camera.orbit(0.1F, 0); }},
    {"a vertex moves", [](Shot& s) { s.body.positions[3].z() += 0.01F; }},
    {"a vertex lies elsewhere at rest", [](Shot& s) { s.body.rest[7].x() -= 0.004F; }},
    {"colours show something else", [](Shot& s) { s.scalars.assign(s.body.rest.size(), 0.004F); }},
    {"that changes", [](Shot& s) { s.scalars[4] = 0.01F; }},
    {"the legend ends elsewhere", [](Shot& s) { s.color_max = 0.02F; }},
    {"an end is held fast",
     [](Shot& s) {
       for (std::size_t i = 0; i < s.vertices.size(); ++i) s.vertices[i].fixed = s.body.rest[i].x() > 0.05F;
     }},
    {"the tool moves", [](Shot& s) { s.body.tools[0].position.z() += 0.01; }},
    {"the force turns", [](Shot& s) { s.body.tools[0].force = Vec3(0.5, 0, 0.2); }},
    {"contact ends", [](Shot& s) { s.body.tools[0].contact = false; }},
    {"lines", [](Shot& s) { s.look.lines = Lines::edges; }},
    {"strains", [](Shot& s) { s.look.lines = Lines::strain; }},
    {"a coarser refinement", [](Shot& s) { s.look.triangle_budget = 3'000; }},
    {"none", [](Shot& s) { s.look.triangle_budget = 1; }},
    {"dark", [](Shot& s) { s.look.dark = true; }},
    {"fewer samples of shadows", [](Shot& s) { s.look.shadow_taps = 4; }},
    {"a narrower picture", [](Shot& s) { s.width = 240; }},
    {"edges as they are", [](Shot& s) { s.look.smooth_edges = false; }},
    {"coarser pixels", [](Shot& s) { s.look.pixel = 2; }},
    {"another mesh", [](Shot& s) { s.body.triangles.resize(s.body.triangles.size() / 2); }},
};

}  // namespace

TEST_CASE("After every change a stage draws what a new one would", "[view]") {
  const auto gl = context();
  if (!gl) return;
  Shot changing;
  std::vector<Shot> shots{changing};
  std::vector<Picture> fresh;  // there is only one stage at a time
  for (const Change& change : kChanges) {
    change.make(changing);
    shots.push_back(changing);
  }
  for (const Shot& shot : shots) {
    Stage stage(kRedrawWidth, kRedrawHeight, 1);
    fresh.push_back(shot.by(stage));
  }
  Stage stage(kRedrawWidth, kRedrawHeight, 1);
  CHECK(shots[0].by(stage).rgb == fresh[0].rgb);
  for (std::size_t i = 1; i < shots.size(); ++i) {
    INFO(kChanges[i - 1].what);
    CHECK(fresh[i].rgb != fresh[i - 1].rgb);
    CHECK(shots[i].by(stage).rgb == fresh[i].rgb);
    CHECK(stage.drawn() == static_cast<int>(i) + 1);
  }
}

TEST_CASE("A body at rest under a camera at rest is drawn once", "[view]") {
  const auto gl = context();
  if (!gl) return;
  const Shot shot;
  Stage stage(kRedrawWidth, kRedrawHeight, 1);
  const Picture first = shot.by(stage);
  CHECK(shot.by(stage).rgb == first.rgb);
  CHECK(shot.by(stage).rgb == first.rgb);
  CHECK(stage.drawn() == 1);
}
