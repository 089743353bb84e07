#include <cstdio>
#include <thread>

#include "client/device/make_device.hpp"
#include "client/io/haptic_loop.hpp"
#include "client/io/udp_client.hpp"
#include "common/io/monotonic.hpp"

int main(int, char** argv) {
  using namespace palpate;
  ClientOptions options;
  options.hello.station = "mine";
  ClientCore core(options, monotonic_now());
  UdpClient udp(argv[1], core);
  udp.start();
  while (udp.status().link != LinkState::joined) std::this_thread::sleep_for(Micros{10'000});
  const auto device = make_device(read_motion(std::filesystem::path(argv[2])));
  HapticLoop loop(*device, {&core.haptic()}, {});
  loop.start();
  while (!udp.status().clock_locked) std::this_thread::sleep_for(Micros{10'000});
  device->start(loop.due_after(Micros{100'000}));
  std::this_thread::sleep_for(Micros{3'000'000});
  loop.stop();
  udp.stop();
  std::printf("%llu ticks, at most %.2f N\n", static_cast<unsigned long long>(loop.stats().ticks), loop.stats().force_max_n);
}
