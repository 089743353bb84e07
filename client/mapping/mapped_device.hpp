// A device seen from the scene: its user sees only frame W (workspace_mapping.hpp), a clutch and a dead-man switch.
//
// The tool follows the hand while it is engaged: the dead-man button is held (where there is one) and the clutch button is not.
// Otherwise the tool stays where it is in the body, which keeps pushing it, the force on the hand fades out (force_fade.hpp), and
// the hand is free to move. When engaged again, the tool continues from where it stayed: c becomes p_WT - s R p_DT, so neither
// the tool nor the force makes a step, and the force fades in. So a clutch moves the device's reach through a scene larger than
// it, like the foot pedal of a surgical robot; and a hand that releases its switch leaves the tool standing, where a falling
// device would push it through an organ. Orientations and openings always follow the hand; a button for jaws closes them while it
// is held, from wide open, and opens them else, within 1 / kJawsButton1S.
//
// After wait_for_start() the hand feels nothing until start(), wherever it moves.
//
// Without the dead-man button there is no force at all, not even against the tool's weight; the clutch does not affect the
// weight. While the fade factor is not 1 the hand does less work than the tool, or receives less: it can gain the energy that the
// body stores within the 0.25 s of one fade in, which the guard, at the tool, does not see.
//
// The written wrench is clamped to the device's peaks once more, for a scene whose guard has other limits than caps(). The
// force begins at zero whenever the device becomes ok: both factors start at zero. During a reading that is not ok the tool keeps
// its position; afterwards it continues from there with a clutch or a dead-man button, and returns to where c maps it without.
// Nothing in read() and write() allocates, locks or throws.
#pragma once

#include "client/device/motion_device.hpp"
#include "client/mapping/force_fade.hpp"
#include "client/mapping/workspace_mapping.hpp"

namespace palpate {

struct SceneSpot {
  Vec3 home = Vec3::Zero();  ///< position in W of the device's centre
  bool grasps = false;       ///< true: the tool holds the body from the start, so it should start at home
};

class MappedDevice final : public MotionDevice {
 public:
  /// `device` outlives this object. Throws InputError, with `where` as the place, when the mapping needs more than the device
  /// has.
  MappedDevice(Device& device, const WorkspaceMapping& mapping, const SceneSpot& spot, std::string_view where = "workspace");

  const DeviceCaps& caps() const override { return caps_; }
  DeviceReading read(Micros now) noexcept override;
  void write(const Wrench& wrench) noexcept override;
  void stop() noexcept override;
  void halt() noexcept override { device_.halt(); }
  void resume() noexcept override;

  /// Returns the position of the tool in W while the device, not moved yet, is at p_DT.
  Vec3 place(const Vec3& p_dt) const noexcept { return origin_ ? Vec3(*origin_ + turn_ * p_dt) : place_; }
  /// Share of the body's force that the hand feels.
  double share() const noexcept { return body_.share(); }

 private:
  bool held(const std::optional<int>& button, std::uint32_t buttons, bool otherwise) const noexcept;
  void follow(const Vec3& p_dt, bool engaged) noexcept;
  void move_jaws(std::uint32_t buttons, Micros passed) noexcept;

  Device& device_;
  WorkspaceMapping mapping_;
  Vec3 place_;                   ///< position of the centre in W
  Mat3 turn_;                    ///< s R
  Eigen::Quaterniond rotation_;  ///< R
  Mat3 force_turn_;              ///< g R^T
  Mat3 torque_turn_;             ///< (g / s) R^T
  std::optional<Vec3> origin_;   ///< c; empty before the first reading where that determines it
  DeviceCaps caps_;
  ForceFade body_, weight_;
  Vec3 tool_;           ///< p_WT
  double opening_ = 1;  ///< of jaws with a button
  Micros last_{};
  bool well_ = false, followed_ = false, placed_ = false;
};

}  // namespace palpate
