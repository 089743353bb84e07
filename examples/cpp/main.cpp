#include <cstdio>
#include <exception>

#include "common/player/player.hpp"
#include "server/room/room.hpp"

int main(int argc, char** argv) try {
  using namespace palpate;
  if (argc != 2) return std::fputs("usage: consumer SCENE\n", stderr), 2;
  const Scene scene = load_scene(argv[1]);
  const Vec3 above = home_of(scene), pressed = above - Vec3(0, 0, 0.005);
  Room room(scene);  // the server's side: the body
  room.start(Micros{0});
  FrameJob job;  // a frame of 50 ms in which the hand, station 1, goes down by 5 mm
  job.target = Micros{50'000};
  job.stations = {{.id = 1, .horizon = Micros{150'000}, .samples = {{Micros{0}, above}, {job.target, pressed}}}};
  const StationFrame frame = room.run(job).stations.at(0);
  PatchPlayer player(frame.patch.value(), frame.terms);  // the client's side, once a millisecond
  for (Micros t = job.target; t <= Micros{200'000}; t += kTick) player.advance({t, pressed});
  std::printf("150 ms later the hand feels %.2f N\n", player.output().force.z());
} catch (const std::exception& fault) {
  std::fprintf(stderr, "consumer: %s\n", fault.what());
  return 2;
}
