// A device seen from the scene: whatever it wraps, who holds it sees frame W alone (workspace_mapping.hpp), a clutch and a
// dead-man switch.
//
// The tool follows the hand while it is engaged: the dead-man button is held (where there is one) and the clutch button is not.
// Otherwise it stays where it is in the body, which goes on pushing it, the force fades out of the hand (force_fade.hpp), and
// the hand is free to move away. Engaged again, the tool goes on from where it stayed: c becomes p_WT - s R p_DT, so neither the
// tool nor the force makes a step, and the force fades in. So a clutch moves the device's reach through a scene larger than it,
// as the foot pedal of a surgical robot does; and a hand that lets go of its switch leaves the tool standing, where a falling
// device would push it through an organ. Orientations always follow the hand.
//
// After wait_for_start() the hand feels nothing until start(), wherever it moves.
//
// Without the dead-man button there is no force at all, not even against the tool's weight; the clutch leaves that.
// While the share of the force is not 1 the hand pays less than the tool does, or gets less: it can gain what the body stores
// within the 0.25 s of one fade in, which the guard, at the tool, does not see.
//
// What is written is held within the device's peak force once more, for a scene whose guard has other limits than caps() says.
// Force begins at zero whenever the device becomes well: both shares start from none. A reading that is not ok has the tool where
// it was; afterwards the tool goes on from there where there is a clutch or a dead-man button, and is where c has it where there
// is none. Nothing in read() and write() allocates, locks or throws.
#pragma once

#include "client/device/motion_device.hpp"
#include "client/mapping/force_fade.hpp"
#include "client/mapping/workspace_mapping.hpp"

namespace palpate {

struct SceneSpot {
  Vec3 home = Vec3::Zero();  ///< in W, where the device's centre comes to
  bool grasps = false;       ///< the tool holds the body from the start: it had better start at home
};

class MappedDevice final : public MotionDevice {
 public:
  /// `device` outlives it. Throws InputError, with `where` as the place, when the mapping asks for more than the device has.
  MappedDevice(Device& device, const WorkspaceMapping& mapping, const SceneSpot& spot, std::string_view where = "workspace");

  const DeviceCaps& caps() const override { return caps_; }
  DeviceReading read(Micros now) noexcept override;
  void write(const Vec3& force) noexcept override;
  void stop() noexcept override;
  void halt() noexcept override { device_.halt(); }
  void resume() noexcept override;

  /// Where the tool is in W when the device, not moved yet, is at p_DT.
  Vec3 place(const Vec3& p_dt) const noexcept { return origin_ ? Vec3(*origin_ + turn_ * p_dt) : place_; }
  /// Share of the body's force that the hand feels.
  double share() const noexcept { return body_.share(); }

 private:
  bool held(const std::optional<int>& button, std::uint32_t buttons, bool otherwise) const noexcept;
  void follow(const Vec3& p_dt, bool engaged) noexcept;

  Device& device_;
  WorkspaceMapping mapping_;
  Vec3 place_;                   ///< where the centre comes to, in W
  Mat3 turn_;                    ///< s R
  Eigen::Quaterniond rotation_;  ///< R
  Mat3 force_turn_;              ///< g R^T
  std::optional<Vec3> origin_;   ///< c; nothing before the first reading where that says it
  DeviceCaps caps_;
  ForceFade body_, weight_;
  Vec3 tool_;  ///< p_WT
  Micros last_{};
  bool well_ = false, followed_ = false, placed_ = false;
};

}  // namespace palpate
