#include <cstdio>
#include <stdexcept>
#include <thread>

#include "client/device/make_device.hpp"
#include "client/io/haptic_loop.hpp"
#include "client/io/udp_client.hpp"
#include "common/io/monotonic.hpp"

int main(int argc, char** argv) try {
  using namespace palpate;
  if (argc != 3) return std::fputs("usage: station HOST:PORT MOTION.csv\n", stderr), 2;
  ClientOptions options;
  options.hello.station = "mine";
  ClientCore core(options, monotonic_now());
  UdpClient udp(argv[1], core);
  udp.start();
  for (int k = 0; udp.status().link != LinkState::joined; ++k) {
    if (udp.status().link == LinkState::refused) throw std::runtime_error(udp.status().refusal);
    if (k == 1'000) throw std::runtime_error(no_answer_text(argv[1], udp.status().nobody_listens, false));
    std::this_thread::sleep_for(Micros{10'000});
  }
  const auto device = make_device(read_motion(std::filesystem::path(argv[2])));
  HapticLoop loop(*device, {&core.haptic()}, {});
  loop.start();
  while (!udp.status().clock_locked) std::this_thread::sleep_for(Micros{10'000});
  device->start(loop.due_after(Micros{100'000}));
  std::this_thread::sleep_for(Micros{3'000'000});
  loop.stop();
  udp.stop();
  std::printf("%llu ticks, at most %.2f N\n", static_cast<unsigned long long>(loop.stats().ticks), loop.stats().force_max_n);
} catch (const std::exception& fault) {
  std::fprintf(stderr, "station: %s\n", fault.what());
  return 2;
}
