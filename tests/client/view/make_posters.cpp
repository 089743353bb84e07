// The pictures of the documents: scenes/organ.json pressed, stroked and released, computed frame by frame without a clock and
// drawn by the view. `test_view "[.posters]"` writes them to out/posters, light and dark, 1280x800 and 640x400: look at them.
#include <catch2/catch.hpp>
#include <filesystem>

#include "client/view/offscreen_context.hpp"
#include "client/view/stage.hpp"
#include "server/core/room_info.hpp"
#include "server/room/room.hpp"

using namespace palpate;

namespace {

/// Position of the hand: down onto the body, along it, and up again; the tool meets the resting body at about `home - 20 mm`.
Vec3 hand_at(const Vec3& home, double t_s) {
  const double press = std::clamp((t_s - 0.2) / 0.6, 0.0, 1.0), stroke = std::clamp((t_s - 1.0) / 0.8, 0.0, 1.0);
  const double up = std::clamp((t_s - 2.0) / 0.1, 0.0, 1.0);
  return home + Vec3(0.03 * stroke, -0.012 * stroke, -0.031 * press - 0.004 * stroke + 0.027 * up);
}

struct Moment {
  const char* name;
  double t_s;
  ShapeChannel color = ShapeChannel::position;
  Lines lines = Lines::none;
};
/// At the release the tool left the body 10 ms ago: a third of the indentation remains.
constexpr Moment kMoments[] = {{"press", 0.95},
                               {"tension", 0.95, ShapeChannel::tension},
                               {"support", 0.95, ShapeChannel::support},
                               {"strain", 0.95, ShapeChannel::position, Lines::strain},
                               {"stroke", 1.55},
                               {"release", 2.02}};

std::vector<float> scalars_of(const RoomInfo& facts, const FrameResult& frame, ShapeChannel color) {
  std::vector<float> scalars;
  if (color == ShapeChannel::position) return scalars;
  for (const std::uint32_t node : facts.vertex_of) scalars.push_back(frame.fields[index_of(color)][node]);
  return scalars;
}

void draw(const Moment& moment, const RoomInfo& facts, const FrameResult& frame, Scales& scales) {
  std::vector<Vec3f> rest, positions;
  for (std::size_t v = 0; v < facts.vertex_of.size(); ++v) {
    rest.push_back(facts.mesh.vertices[v].rest.cast<float>());
    positions.push_back(frame.positions[facts.vertex_of[v]].cast<float>());
  }
  const StationFrame& hand = frame.stations[0];
  const std::vector<ToolView> tools{{"hand", hand.tool, hand.force, hand.contact}};
  const std::vector<float> scalars = scalars_of(facts, frame, moment.color);
  scales.see(facts.mesh.triangles, positions, rest, tools, moment.color, scalars);
  const Sight sight{.triangles = facts.mesh.triangles,
                    .positions = positions,
                    .rest = rest,
                    .scalars = scalars,
                    .vertices = facts.mesh.vertices,
                    .tools = tools,
                    .color = moment.color,
                    .closed = is_closed(facts.mesh.triangles),
                    .color_max = scales.color_max(moment.color),
                    .arrow_m_per_n = scales.arrow_m_per_n()};
  for (const bool dark : {false, true})
    for (const auto& [width, height] : {std::pair{1280, 800}, {640, 400}}) {
      Camera camera;
      camera.fit(facts.mesh.triangles, rest, static_cast<float>(width) / static_cast<float>(height));
      Stage stage(width, height, 1);
      const auto status = std::to_string(facts.nodes) + " nodes    " + std::to_string(facts.mesh.triangles.size()) + " triangles";
      const auto file = std::string(moment.name) + (dark ? "_dark_" : "_light_") + std::to_string(width) + ".png";
      const Look look{.dark = dark, .lines = moment.lines};
      write_png(std::filesystem::path("out/posters") / file,
                stage.photograph(sight, {facts.scene, status, "", {}}, camera, look, width, height));
    }
}

}  // namespace

TEST_CASE("The pictures of the documents", "[.posters]") {
  const Scene scene = load_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/organ.json");
  const RoomInfo facts = facts_of(scene, home_of(scene));
  const OffscreenContext gl;
  std::filesystem::create_directories("out/posters");
  Room room(scene);
  room.start(Micros{0});
  FrameJob job;
  job.shapes = true;
  job.fields = bit_of(ShapeChannel::tension) | bit_of(ShapeChannel::support);
  Micros sampled{0};
  FrameResult frame;
  Scales scales;
  for (const Moment& moment : kMoments) {
    while (job.target < from_seconds(moment.t_s)) {
      job.target += Micros{10'000};
      StationJob hand;
      hand.id = 1;
      hand.horizon = Micros{100'000};
      for (; sampled <= job.target; sampled += Micros{1'000})
        hand.samples.push_back({sampled, hand_at(facts.home, seconds(sampled))});
      job.stations = {hand};
      frame = room.run(job);
    }
    draw(moment, facts, frame, scales);
  }
}
