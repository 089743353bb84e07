// A device whose readings are set by the test and which records its commands.
#pragma once

#include <vector>

#include "client/mapping/mapped_device.hpp"

namespace palpate::test {

inline constexpr Micros kMs{1000};

class ScriptedDevice final : public Device {
 public:
  ScriptedDevice() {
    device_caps.name = "scripted";
    device_caps.buttons = 2;
    device_caps.has_orientation = true;
    reading.state = DeviceState::ok;
  }
  const DeviceCaps& caps() const override { return device_caps; }
  DeviceReading read(Micros) noexcept override { return reading; }
  void write(const Wrench& wrench) noexcept override { written = wrench.force, turned = wrench.torque; }
  void stop() noexcept override { written = turned = Vec3::Zero(); }
  void halt() noexcept override { halted = true; }
  void resume() noexcept override { halted = false; }

  DeviceCaps device_caps;
  DeviceReading reading;
  Vec3 written = Vec3::Zero(), turned = Vec3::Zero();  ///< force, torque
  bool halted = false;
};

/// Runs 1 ms ticks of a mapped device under a steady force in W; records the felt force and the tool's position.
class Bench {
 public:
  explicit Bench(const WorkspaceMapping& mapping, const SceneSpot& spot = {}) : mapped(device, mapping, spot) {}

  /// `each` sets the reading of tick k of this stretch.
  template <class Each>
  void run(int ticks, const Vec3& force_w, Each each) {
    for (int k = 0; k < ticks; ++k) {
      each(k, device.reading);
      const DeviceReading seen = mapped.read(now += kMs);
      tools.push_back(seen.position);
      mapped.write(force_w);
      forces.push_back(device.written);
    }
  }
  void run(int ticks, const Vec3& force_w) {
    run(ticks, force_w, [](int, DeviceReading&) {});
  }
  double force_step_max_n() const { return step_max(forces); }
  double tool_step_max_m() const { return step_max(tools); }

  ScriptedDevice device;
  MappedDevice mapped;
  Micros now{5'000'000};
  std::vector<Vec3> forces, tools;

 private:
  static double step_max(const std::vector<Vec3>& values) {
    double most = 0;
    for (std::size_t i = 1; i < values.size(); ++i) most = std::max(most, (values[i] - values[i - 1]).norm());
    return most;
  }
};

/// Ticks that cover every fade.
inline constexpr int kWholeFade = 260;

}  // namespace palpate::test
