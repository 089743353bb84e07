#include "client/device/hid/force_profile.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "common/base/error.hpp"

namespace palpate {

namespace {

constexpr const char* kWhere = "force device";
constexpr std::uint32_t kNanometre = 0x11, kMillinewton = 0xE111, kMicronewtonMetre = 0xE121;  ///< cm, dyne, dyne cm
constexpr int kNanometreExponent = -7, kMillinewtonExponent = 2, kMicronewtonMetreExponent = 1;
constexpr double kMPerNm = 1e-9, kNPerMn = 1e-3, kMnPerN = 1e3, kNmPerUnm = 1e-6, kUnmPerNm = 1e6, kWhole = 32767,
                 kWideOpen = 65535;

std::uint32_t usage_of(int usage) { return hid_usage(FORCE_HID_PAGE, static_cast<std::uint32_t>(usage)); }

std::string hexadecimal(std::uint32_t value) {
  constexpr const char* kDigits = "0123456789ABCDEF";
  return {'0', 'x', kDigits[value >> 4 & 15], kDigits[value & 15]};
}

HidField field_of(const ReportDescriptor& descriptor, HidReportKind kind, int usage, std::uint32_t bits_least) {
  const HidField* field = descriptor.find(kind, usage_of(usage));
  const std::string name = "usage " + hexadecimal(static_cast<std::uint32_t>(usage));
  if (!field || field->array)
    throw InputError(kWhere, "its report descriptor has no field of " + name, "one, as docs/reference/hid-profile.md says");
  if (field->bits < bits_least)
    throw InputError(kWhere, "its field of " + name + " has " + std::to_string(field->bits) + " bits",
                     "at least " + std::to_string(bits_least));
  return *field;
}

void expect_unit(const HidField& field, std::uint32_t unit, int exponent, const char* name) {
  if (field.unit != unit || field.unit_exponent != exponent)
    throw InputError(kWhere, "its field of usage " + hexadecimal(field.usage & 0xFFFF) + " is in another unit", name);
}

void expect_one_report(const HidField& first, const HidField& other) {
  if (first.report_id != other.report_id)
    throw InputError(kWhere,
                     "its report descriptor spreads one report over ids " + std::to_string(first.report_id) + " and " +
                         std::to_string(other.report_id),
                     "one report of each kind");
}

/// Numbers of the feature report, by usage.
class Limits {
 public:
  Limits(HidTransport& transport, const ReportDescriptor& descriptor) : descriptor_(descriptor) {
    const HidField version = field_of(descriptor, HidReportKind::feature, FORCE_HID_MAJOR, 8);
    report_.resize(descriptor.report_bytes(HidReportKind::feature, version.report_id));
    report_[0] = std::byte{version.report_id};
    const int got = transport.get_feature(report_);
    if (got < 0 || static_cast<std::size_t>(got) < report_.size())
      throw InputError(kWhere, "it gave " + std::to_string(std::max(got, 0)) + " bytes of its feature report",
                       std::to_string(report_.size()));
  }

  double operator()(int usage, double least, double most, const char* name) const {
    const HidField field = field_of(descriptor_, HidReportKind::feature, usage, 8);
    if (!holds(field, report_))
      throw InputError(kWhere, std::string("its feature report lacks the ") + name, "one report with all limits");
    const auto value = static_cast<double>(value_of(field, report_));
    if (!(value >= least && value <= most))
      throw InputError(kWhere, std::string("its ") + name + " is " + std::to_string(static_cast<long long>(value)),
                       std::to_string(static_cast<long long>(least)) + " to " + std::to_string(static_cast<long long>(most)));
    return value;
  }

 private:
  const ReportDescriptor& descriptor_;
  std::vector<std::byte> report_;
};

const char* reason_of_fault(std::int64_t status) noexcept {
  if ((status & FORCE_HID_STATUS_TOO_HOT) != 0) return "too hot: it took its force away until it has cooled";
  if ((status & FORCE_HID_STATUS_TOO_FAST) != 0) return "the tool was faster than the device allows: it took its force away";
  if ((status & FORCE_HID_STATUS_ENCODER) != 0) return "an encoder cannot be trusted: switch the device off and on, or mend it";
  if ((status & FORCE_HID_STATUS_MOTOR) != 0) return "its motor driver reports a fault: check supply and cables";
  if ((status & FORCE_HID_STATUS_SWITCH) != 0) return "its emergency switch is open";
  return "it reports a fault";
}

DeviceState device_state(std::int64_t state) noexcept {
  if (state == FORCE_HID_STATE_HOMING) return DeviceState::not_ready;
  return state == FORCE_HID_STATE_READY || state == FORCE_HID_STATE_ARMED ? DeviceState::ok : DeviceState::fault;
}

DeviceReason reason_of(std::int64_t state, std::int64_t status) noexcept {
  if (state == FORCE_HID_STATE_READY || state == FORCE_HID_STATE_ARMED) return {};
  if (state == FORCE_HID_STATE_HOMING) return "it homes: follow its maker's instructions until it knows where it is";
  if (state == FORCE_HID_STATE_TIMED_OUT) return "its watchdog took the force away: no force was sent in time";
  return reason_of_fault(status);
}

}  // namespace

bool ForceProfile::is(const ReportDescriptor& descriptor) {
  const auto applications = descriptor.applications();
  return std::find(applications.begin(), applications.end(), usage_of(FORCE_HID_DEVICE)) != applications.end();
}

void ForceProfile::bind(const ReportDescriptor& descriptor) {
  const auto input = [&](int usage, std::uint32_t bits) { return field_of(descriptor, HidReportKind::input, usage, bits); };
  const auto output = [&](int usage, std::uint32_t bits) { return field_of(descriptor, HidReportKind::output, usage, bits); };
  in_.buttons = input(FORCE_HID_BUTTONS, 1);
  in_.status = input(FORCE_HID_STATUS, 16);
  in_.state = input(FORCE_HID_STATE, 3);
  out_.sequence = output(FORCE_HID_COMMAND, 16);
  out_.flags = output(FORCE_HID_FLAGS, 3);
  for (int i = 0; i < 3; ++i) {
    in_.position[i] = input(FORCE_HID_POSITION_X + i, 24);
    out_.force[i] = output(FORCE_HID_FORCE_X + i, 16);
    expect_unit(in_.position[i], kNanometre, kNanometreExponent, "nanometres (unit 0x11, exponent -7)");
    expect_unit(out_.force[i], kMillinewton, kMillinewtonExponent, "millinewtons (unit 0xE111, exponent 2)");
    expect_one_report(in_.state, in_.position[i]);
    expect_one_report(out_.flags, out_.force[i]);
  }
  in_.has_orientation = descriptor.find(HidReportKind::input, usage_of(FORCE_HID_ORIENTATION_X)) != nullptr;
  for (int i = 0; i < 4 && in_.has_orientation; ++i) in_.orientation[i] = input(FORCE_HID_ORIENTATION_X + i, 16);
  if (in_.has_orientation)
    for (const HidField& field : in_.orientation) expect_one_report(in_.state, field);
  in_.has_opening = descriptor.find(HidReportKind::input, usage_of(FORCE_HID_OPENING)) != nullptr;
  if (in_.has_opening) {
    in_.opening = input(FORCE_HID_OPENING, 16);
    expect_one_report(in_.state, in_.opening);
  }
  out_.has_torque = descriptor.find(HidReportKind::output, usage_of(FORCE_HID_TORQUE_X)) != nullptr;
  for (int i = 0; i < 3 && out_.has_torque; ++i) {
    out_.torque[i] = output(FORCE_HID_TORQUE_X + i, 24);
    expect_unit(out_.torque[i], kMicronewtonMetre, kMicronewtonMetreExponent, "micronewton metres (unit 0xE121, exponent 1)");
    expect_one_report(out_.flags, out_.torque[i]);
  }
  for (const HidField* field : {&in_.buttons, &in_.status}) expect_one_report(in_.state, *field);
  expect_one_report(out_.flags, out_.sequence);
  report_.assign(descriptor.report_bytes(HidReportKind::output, out_.flags.report_id), std::byte{0});
  report_[0] = std::byte{out_.flags.report_id};
}

DeviceCaps ForceProfile::read_limits(HidTransport& transport, const ReportDescriptor& descriptor) const {
  const Limits limits(transport, descriptor);
  limits(FORCE_HID_MAJOR, FORCE_HID_VERSION_MAJOR, FORCE_HID_VERSION_MAJOR, "profile version");
  limits(FORCE_HID_RATE, kRateLeastHz, 65535, "rate [Hz]");
  DeviceCaps caps;
  caps.name = "hid";
  const double peak_mn = limits(FORCE_HID_PEAK, 1, FORCE_HID_PEAK_MAX_MN, "peak force [mN]");
  caps.force_max_n = peak_mn * kNPerMn;
  caps.force_continuous_n = limits(FORCE_HID_CONTINUOUS, 1, peak_mn, "continuous force [mN]") * kNPerMn;
  caps.stiffness_max_n_m = limits(FORCE_HID_STIFFNESS, 1, 1e6, "stiffness [N/m]");
  caps.slew_max_n_s = limits(FORCE_HID_SLEW, 1, 1e6, "slew [N/s]");
  caps.velocity_max_m_s = limits(FORCE_HID_SPEED, 0, 65535, "speed [mm/s]") * 1e-3;
  caps.watchdog =
      Micros{static_cast<std::int64_t>(1000 * limits(FORCE_HID_WATCHDOG, 1, FORCE_HID_WATCHDOG_MAX_MS, "watchdog [ms]"))};
  caps.buttons = static_cast<int>(limits(FORCE_HID_BUTTON_COUNT, 0, 16, "number of buttons"));
  const auto features = static_cast<int>(limits(FORCE_HID_FEATURES, 0, 255, "features"));
  caps.has_orientation = in_.has_orientation && (features & FORCE_HID_FEATURE_ORIENTATION) != 0;
  caps.renders_torque = caps.has_orientation && out_.has_torque && (features & FORCE_HID_FEATURE_TORQUE) != 0;
  caps.has_opening = in_.has_opening && (features & FORCE_HID_FEATURE_OPENING) != 0;
  if (caps.renders_torque) {
    const double most_unm = limits(FORCE_HID_PEAK_TORQUE, 1, FORCE_HID_TORQUE_MAX_UNM, "peak torque [uN m]");
    caps.torque_max_nm = most_unm * kNmPerUnm;
    caps.torque_continuous_nm = limits(FORCE_HID_CONTINUOUS_TORQUE, 1, most_unm, "continuous torque [uN m]") * kNmPerUnm;
    caps.torque_slew_max_nm_s = limits(FORCE_HID_TORQUE_SLEW, 1, 1e9, "change of torque [mN m/s]") * 1e-3;
    caps.torsion_stiffness_max_nm_rad = limits(FORCE_HID_TORSION, 0, 1e9, "torsional stiffness [mN m/rad]") * 1e-3;
    caps.spin_max_rad_s = limits(FORCE_HID_SPIN, 1, 65535, "rate of rotation [mrad/s]") * 1e-3;
  }
  Vec3 least, most;
  for (int i = 0; i < 3; ++i) {
    const double from_nm = limits(FORCE_HID_WORKSPACE_MIN_X + i, -2147483648.0, 2147483647.0, "workspace [nm]");
    least[i] = from_nm * kMPerNm;
    most[i] = limits(FORCE_HID_WORKSPACE_MAX_X + i, from_nm, 2147483647.0, "workspace [nm]") * kMPerNm;
  }
  if (least == most) throw InputError(kWhere, "its workspace is a point", "the box that its tool can reach");
  caps.workspace = {least, most};
  caps.model = "firmware " + std::to_string(static_cast<int>(limits(FORCE_HID_FIRMWARE, 0, 65535, "firmware version")));
  return caps;
}

DeviceCaps ForceProfile::begin(HidTransport& transport) {
  const ReportDescriptor descriptor(transport.descriptor());
  bind(descriptor);
  state_ = FORCE_HID_STATE_HOMING;
  disarmed_ = false;
  return read_limits(transport, descriptor);
}

bool ForceProfile::take(std::span<const std::byte> report, HidInput& input) noexcept {
  if (!holds(in_.state, report) || !holds(in_.status, report) || !holds(in_.buttons, report)) return false;
  for (const HidField& field : in_.position)
    if (!holds(field, report)) return false;
  for (const HidField& field : in_.orientation)
    if (in_.has_orientation && !holds(field, report)) return false;
  if (in_.has_opening && !holds(in_.opening, report)) return false;
  const std::int64_t state = value_of(in_.state, report);
  DeviceReading& reading = input.reading;
  for (int i = 0; i < 3; ++i) reading.position[i] = static_cast<double>(value_of(in_.position[i], report)) * kMPerNm;
  reading.buttons = static_cast<std::uint32_t>(value_of(in_.buttons, report));
  reading.state = device_state(state);
  reading.reason = reason_of(state, value_of(in_.status, report));
  state_.store(static_cast<std::uint8_t>(state), std::memory_order_relaxed);
  if (in_.has_opening) reading.opening = static_cast<double>(value_of(in_.opening, report)) / kWideOpen;
  if (!in_.has_orientation) return true;
  Eigen::Vector4d q;
  for (int i = 0; i < 4; ++i) q[i] = static_cast<double>(value_of(in_.orientation[i], report)) / kWhole;
  reading.orientation = q.norm() > 0.5 ? Eigen::Quaterniond(q.normalized()) : Eigen::Quaterniond::Identity();
  return true;
}

std::uint8_t ForceProfile::flags_for(const HidCommand& command, Micros now) noexcept {
  const std::uint8_t state = state_.load(std::memory_order_relaxed);
  if (state == FORCE_HID_STATE_FAULT && seen_ != state) fault_since_ = now;
  if (state != FORCE_HID_STATE_READY && state != FORCE_HID_STATE_ARMED) disarmed_ = false;
  seen_ = state;
  const std::uint8_t ramp = command.ramped ? FORCE_HID_FLAG_RAMP : 0;
  if (state == FORCE_HID_STATE_FAULT) return now - fault_since_ >= kFaultHold ? FORCE_HID_FLAG_CLEAR : 0;
  if (state == FORCE_HID_STATE_READY && (!disarmed_ || tries_ >= kArmingTries)) {
    disarmed_ = true;
    tries_ = 0;
    return 0;
  }
  if (!command.armed || !disarmed_) return command.armed ? 0 : ramp;
  tries_ = state == FORCE_HID_STATE_READY ? tries_ + 1 : 0;
  return FORCE_HID_FLAG_ARM | FORCE_HID_FLAG_RAMP;
}

bool ForceProfile::send(HidTransport& transport, const HidCommand& command, Micros now) noexcept {
  set_value(out_.flags, report_, flags_for(command, now));
  set_value(out_.sequence, report_, ++sequence_);
  const auto whole = [](double value) { return std::llround(std::clamp(value, -1e9, 1e9)); };
  for (int i = 0; i < 3; ++i) {
    set_value(out_.force[i], report_, whole(command.wrench.force[i] * kMnPerN));
    if (out_.has_torque) set_value(out_.torque[i], report_, whole(command.wrench.torque[i] * kUnmPerNm));
  }
  return transport.write(report_);
}

}  // namespace palpate
