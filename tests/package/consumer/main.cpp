// Two masses joined by a spring, the upper one held by the tool: after a frame at rest the room has a patch that a client may
// play.
#include <cstdio>

#include "common/player/player.hpp"
#include "server/room/room.hpp"

int main() {
  using namespace palpate;
  Scene scene;
  scene.body.nodes = {{0, 0, 0}, {0, 0, 0.1}, {0.1, 0, 0}};
  scene.body.masses_kg = {0.01, 0.01, 0.01};
  scene.body.fixed = {1, 0, 0};
  scene.body.elements = {{0, 1, 0.1, 60, 0.24}, {0, 2, 0.1, 60, 0.24}};
  scene.tool.contact = ContactKind::attach;
  scene.tool.node = 1;
  Room room(scene);
  room.start(Micros{0});
  StationJob station;
  station.id = 1;
  station.bridge = Micros{50'000};
  station.samples = {{Micros{0}, home_of(scene)}, {Micros{50'000}, home_of(scene)}};
  FrameJob job;
  job.target = Micros{50'000};
  job.stations = {station};
  const FrameResult frame = room.run(job);
  const bool good = frame.stations.size() == 1 && frame.stations[0].patch && check(*frame.stations[0].patch) == PatchFault::none;
  std::printf("%s, a player takes %zu bytes\n", good ? "a patch came" : "no patch came", sizeof(PatchPlayer));
  return good ? 0 : 1;
}
