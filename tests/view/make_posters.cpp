// The pictures of the documents: scenes/organ.json pressed, stroked and let go, computed frame by frame without a clock and drawn
// by the view. `test_view "[.posters]"` writes them into out/posters, light and dark, 1280x800 and 640x400: look at them.
#include <catch2/catch.hpp>
#include <filesystem>

#include "client/view/offscreen_context.hpp"
#include "client/view/stage.hpp"
#include "server/core/room_facts.hpp"
#include "server/room/room.hpp"

using namespace palpate;

namespace {

/// Down onto the body, along it, and up again; the surface of the resting body is met at about `home - 20 mm`.
Vec3 hand_at(const Vec3& home, double t_s) {
  const double press = std::clamp((t_s - 0.2) / 0.6, 0.0, 1.0), stroke = std::clamp((t_s - 1.0) / 0.8, 0.0, 1.0);
  const double up = std::clamp((t_s - 2.0) / 0.15, 0.0, 1.0);
  return home + Vec3(0.03 * stroke, -0.012 * stroke, -0.031 * press - 0.004 * stroke + 0.04 * up);
}

struct Moment {
  const char* name;
  double t_s;
};
constexpr Moment kMoments[] = {{"press", 0.95}, {"stroke", 1.55}, {"release", 2.25}};

void draw(const char* name, const RoomFacts& facts, const FrameResult& frame) {
  std::vector<Vec3f> rest, positions;
  for (std::size_t v = 0; v < facts.node_of.size(); ++v) {
    rest.push_back(facts.mesh.vertices[v].rest.cast<float>());
    positions.push_back(frame.positions[facts.node_of[v]].cast<float>());
  }
  const StationFrame& hand = frame.stations[0];
  const std::vector<ToolView> tools{{"hand", hand.tool, hand.force, hand.contact}};
  Scales scales;
  scales.see(facts.mesh.triangles, positions, rest, {}, tools);
  Sight sight{facts.mesh.triangles,  positions, rest, {}, facts.mesh.vertices, tools, scales.color_max(false),
              scales.arrow_m_per_n()};
  for (const bool dark : {false, true})
    for (const auto& [width, height] : {std::pair{1280, 800}, {640, 400}}) {
      Camera camera;
      camera.fit(facts.mesh.triangles, rest, static_cast<float>(width) / static_cast<float>(height));
      Stage stage(width, height, 1);
      const auto status = std::to_string(facts.nodes) + " nodes    " + std::to_string(facts.mesh.triangles.size()) + " triangles";
      const auto file = std::string(name) + (dark ? "_dark_" : "_light_") + std::to_string(width) + ".png";
      write_png(std::filesystem::path("out/posters") / file,
                stage.photograph(sight, {facts.scene, status, "", {}}, camera, {.dark = dark}, width, height));
    }
}

}  // namespace

TEST_CASE("The pictures of the documents", "[.posters]") {
  const Scene scene = load_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/organ.json");
  const RoomFacts facts = facts_of(scene, home_of(scene));
  const OffscreenContext gl;
  std::filesystem::create_directories("out/posters");
  Room room(scene);
  room.start(Micros{0});
  FrameJob job;
  job.shapes = true;
  Micros sampled{0};
  for (const Moment& moment : kMoments)
    for (FrameResult frame; job.target < from_seconds(moment.t_s);) {
      job.target += Micros{50'000};
      StationJob hand;
      hand.id = 1;
      hand.bridge = Micros{100'000};
      for (; sampled <= job.target; sampled += Micros{1'000})
        hand.samples.push_back({sampled, hand_at(facts.home, seconds(sampled))});
      job.stations = {hand};
      frame = room.run(job);
      if (job.target >= from_seconds(moment.t_s)) draw(moment.name, facts, frame);
    }
}
