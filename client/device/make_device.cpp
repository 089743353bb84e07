#include "client/device/make_device.hpp"

#include "client/device/replay_device.hpp"
#include "client/device/sim_phantom.hpp"

namespace palpate {

namespace {

std::unique_ptr<MotionDevice> make_phantom(const Motion& motion, const DeviceOptions& options) {
  SimPhantomOptions phantom;
  phantom.hand = options.hand;
  phantom.seed = options.seed;
  phantom.release_s = options.release_s;
  if (options.kind == DeviceKind::sim6) phantom.wrist = SimWrist{};
  return std::make_unique<SimPhantom>(motion, phantom);
}

}  // namespace

std::unique_ptr<MotionDevice> make_device(const Motion& motion, const DeviceOptions& options) {
  std::unique_ptr<MotionDevice> device;
  if (options.kind == DeviceKind::replay)
    device =
        std::make_unique<ReplayDevice>(motion, options.stays_at_end ? ReplayDevice::AtEnd::stays : ReplayDevice::AtEnd::gone);
  else
    device = make_phantom(motion, options);
  device->wait_for_start();
  return device;
}

}  // namespace palpate
