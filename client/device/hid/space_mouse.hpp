// 3Dconnexion SpaceMouse and its relatives: six axes in, no force out.
//
// The cap reports how far it is pushed and turned, s in [-1, 1] per axis of full deflection (some 1 mm and 10 degrees), in one
// report or, on older models, translation and rotation alternately. A cap at rest sends nothing, so before the first report
// nothing shows that the device works: it is not ready. A hand that pushes the cap never holds it exactly still, so a silence of
// kSilenceMax during a push is a fault (an empty battery, a receiver out of reach), and the tool stops.
//
// `rate` (the default): the deflection is a speed,
//     v = v_max u(s) e,   u(s) = 0 for s <= d, ((s - d) / (1 - d))^2 above (d = kDeadZone),   e = deflection / s,   s =
//     |deflection|
// because the cap is stiff and springs back: a position held against a spring of a millimetre can neither be held still nor reach
// far (Zhai, Milgram, Drascic 1993: elastic devices suit rate, free ones position). A touch needs both: the tool moves over the
// body, slows to well below 1 mm/s, and stays where it is, pressing, when the cap is released. `position`: the deflection is a
// position relative to the tool's start, at most `reach_m` away, smoothed like the mouse's pointer (time constant 1 / kPace);
// when the cap is released, the tool leaves the body. Half a step of 1/350 is 0.1 mm at 60 mm.
//
// In both modes the tool stays in `workspace`. Rotation is applied in the same way: at most `turn_max_rad_s` in `rate`, and at
// most a right angle at full deflection in `position`.
#pragma once

#include <string_view>

#include "client/device/hid/hid_protocol.hpp"
#include "client/device/hid/report_descriptor.hpp"

namespace palpate {

/// Returns the name of the model; empty for other ids, and for models without six axes.
std::string_view space_mouse_model(std::uint16_t vendor, std::uint16_t product);

/// Selects a raw axis and a sign for each axis of frame W: row i of `matrix` selects it. Written as "x -y -z", raw axes with
/// optional signs.
struct AxisMap {
  Mat3 matrix = Mat3::Identity();
  /// Throws InputError unless each of x, y, z occurs once and the map is a rotation (a mirror would swap hands).
  static AxisMap from_text(std::string_view text);
};

struct SpaceMouseOptions {
  enum class Control : std::uint8_t { rate, position };
  Control control = Control::rate;
  /// Raw axes are x right, y towards the user, z down (implied by both known open drivers): W has y away from the user and z up.
  AxisMap axes = AxisMap::from_text("x -y -z");
  double speed_max_m_s = 0.15;
  double turn_max_rad_s = 2;
  double reach_m = 0.06;
  Eigen::AlignedBox3d workspace{Vec3(-0.15, -0.15, -0.15), Vec3(0.15, 0.15, 0.15)};
  Vec3 start = Vec3::Zero();  ///< start of the tool, inside the workspace
};

class SpaceMouse final : public HidProtocol {
 public:
  static constexpr double kDeadZone = 0.04;
  static constexpr double kPace = 40;  ///< [1/s]
  static constexpr Micros kLongestTick{20'000}, kSilenceMax{400'000};

  explicit SpaceMouse(const SpaceMouseOptions& options);

  DeviceCaps begin(HidTransport& transport) override;
  bool take(std::span<const std::byte> report, HidInput& input) noexcept override;
  bool send(HidTransport&, const HidCommand&, Micros) noexcept override { return true; }
  DeviceReading read(const HidInput& input, Micros now) noexcept override;
  Micros silence_max(const HidInput& input) const noexcept override;

  /// True for a multi-axis controller with six axes.
  static bool is(const ReportDescriptor& descriptor);

 private:
  struct Axis {
    HidField field;
    double full = 350;  ///< counts at full deflection
  };
  void move(const Vec3& push, const Vec3& turn, double dt) noexcept;

  SpaceMouseOptions options_;
  std::array<Axis, 6> axes_;
  std::vector<HidField> buttons_;
  // state of the haptic thread
  Vec3 position_, velocity_ = Vec3::Zero();
  Eigen::Quaterniond orientation_ = Eigen::Quaterniond::Identity();
  Micros read_{};
  bool started_ = false;
};

}  // namespace palpate
