#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <thread>

#include "client/device/device.hpp"
#include "client/io/haptic_loop.hpp"
#include "client/io/udp_client.hpp"
#include "common/io/monotonic.hpp"

using namespace palpate;

/// A motor of its own that presses the tool 8 mm down and up again, once a second, and only feels.
class Presser final : public Device {
 public:
  explicit Presser(const Vec3& home) : home_(home) {}
  const DeviceCaps& caps() const override { return caps_; }
  DeviceReading read(Micros now) noexcept override {
    const double depth = 0.004 * (1 - std::cos(2 * M_PI * seconds(now - begin_)));
    return {home_ - Vec3(0, 0, depth), DeviceState::ok};  // or not_ready, fault, gone
  }
  void write(const Wrench& wrench) noexcept override { force_ = wrench.force; }  // here a driver would send it to the motors
  void stop() noexcept override { force_ = Vec3::Zero(); }

 private:
  Vec3 home_, force_ = Vec3::Zero();
  // Peak [N], slew [N/s], stiffness [N/m], continuous force [N], speed [m/s] and the place that it stays in: no limit, no force.
  DeviceCaps caps_{"presser", 5.0, 2000.0, 800.0, 1.5, 1.0, {home_ - Vec3::Constant(0.05), home_ + Vec3::Constant(0.05)}};
  Micros begin_ = monotonic_now();
};

int main(int argc, char** argv) try {
  if (argc != 2) return std::fputs("usage: own_device HOST:PORT\n", stderr), 2;
  ClientOptions options;
  options.hello.station = "presser";
  ClientCore core(options, monotonic_now());
  UdpClient udp(argv[1], core);
  udp.start();
  for (int k = 0; udp.status().link != LinkState::joined; ++k) {
    if (udp.status().link == LinkState::refused) throw std::runtime_error(udp.status().refusal);
    if (k == 1'000) throw std::runtime_error(no_answer_text(argv[1], udp.status().nobody_listens, false));
    std::this_thread::sleep_for(Micros{10'000});
  }
  Presser device(udp.status().welcome.home);
  HapticLoop loop(device, {&core.haptic()}, {});
  loop.start();
  std::this_thread::sleep_for(Micros{3'000'000});
  loop.stop();
  udp.stop();
  std::printf("%llu ticks, at most %.2f N\n", static_cast<unsigned long long>(loop.stats().ticks), loop.stats().force_max_n);
} catch (const std::exception& fault) {
  std::fprintf(stderr, "own_device: %s\n", fault.what());
  return 2;
}
