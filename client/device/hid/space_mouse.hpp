// 3Dconnexion SpaceMouse and its relatives: six axes in, no force out.
//
// The cap says how far it is pushed and turned, s in [-1, 1] per axis of full deflection (some 1 mm and 10 degrees). Reports come
// only while that changes, in one report or, on older models, translation and rotation in turn: silence means that nothing did.
//
// `rate` (the default): the deflection is a speed,
//     v = v_max u(s) e,   u(s) = 0 for s <= d, ((s - d) / (1 - d))^2 above (d = kDeadZone),   e = deflection / s,   s =
//     |deflection|
// because the cap is stiff and springs back: a place held against a spring of a millimetre can neither be held still nor reach
// far (Zhai, Milgram, Drascic 1993: elastic devices suit rate, free ones position). A touch needs both: the tool goes on over the
// body, slows to well below 1 mm/s, and stays where it is, pressing, when the cap is let go. `position`: the deflection is a
// place around where the tool began, at most `reach_m` away, smoothed as the mouse's pointer is (time constant 1 / kPace); let
// go, the tool leaves the body. Half a step of 1/350 is 0.1 mm at 60 mm.
//
// Either way the tool stays in `workspace`. Rotation is taken the same way at most at `turn_max_rad_s`, and in `position` by at
// most a right angle at full deflection.
#pragma once

#include <string_view>

#include "client/device/hid/hid_protocol.hpp"
#include "client/device/hid/report_descriptor.hpp"

namespace palpate {

/// Name of the model; empty: these ids are none of theirs, or of one without six axes.
std::string_view space_mouse_model(std::uint16_t vendor, std::uint16_t product);

/// Which raw axis, with which sign, is each axis of frame W: row i of `matrix` picks it. Written "x -y -z", raw axes after a
/// sign.
struct AxisMap {
  Mat3 matrix = Mat3::Identity();
  /// Throws InputError unless each of x, y, z is there once and the whole is a rotation (a mirror would swap hands).
  static AxisMap from_text(std::string_view text);
};

struct SpaceMouseOptions {
  enum class Control : std::uint8_t { rate, position };
  Control control = Control::rate;
  /// Raw axes are x right, y towards the user, z down (as both known open drivers imply): W has y away from the user and z up.
  AxisMap axes = AxisMap::from_text("x -y -z");
  double speed_max_m_s = 0.15;
  double turn_max_rad_s = 2;
  double reach_m = 0.06;
  Eigen::AlignedBox3d workspace{Vec3(-0.15, -0.15, -0.15), Vec3(0.15, 0.15, 0.15)};
  Vec3 start = Vec3::Zero();  ///< where the tool begins, in the workspace
};

class SpaceMouse final : public HidProtocol {
 public:
  static constexpr double kDeadZone = 0.04;
  static constexpr double kPace = 40;  ///< [1/s]
  static constexpr Micros kLongestTick{20'000};

  explicit SpaceMouse(const SpaceMouseOptions& options);

  DeviceCaps begin(HidTransport& transport) override;
  /// A cap that nobody touches says nothing.
  HidInput unheard() const noexcept override;
  bool take(std::span<const std::byte> report, HidInput& input) noexcept override;
  bool send(HidTransport&, const HidCommand&, Micros) noexcept override { return true; }
  DeviceReading read(const HidInput& input, Micros now) noexcept override;

  /// A multi-axis controller with six axes.
  static bool is(const ReportDescriptor& descriptor);

 private:
  struct Axis {
    HidField field;
    double full = 350;  ///< counts of full deflection
  };
  void move(const Vec3& push, const Vec3& turn, double dt) noexcept;

  SpaceMouseOptions options_;
  std::array<Axis, 6> axes_;
  std::vector<HidField> buttons_;
  // The haptic thread's.
  Vec3 position_, velocity_ = Vec3::Zero();
  Eigen::Quaterniond orientation_ = Eigen::Quaterniond::Identity();
  Micros read_{};
  bool started_ = false;
};

}  // namespace palpate
