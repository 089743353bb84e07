#include "client/device/forcedimension/dhd_session.hpp"

#include <array>

#include "client/device/forcedimension/dhd_frame.hpp"
#include "client/device/forcedimension/dhd_limits.hpp"
#include "common/base/error.hpp"

namespace palpate::dhd {

namespace {

constexpr Micros kWatchdogUnit{125};
static_assert(kWatchdog / kWatchdogUnit <= 255, "the device counts it in a byte");
constexpr int kCheckTurns = 100;         // between two checks of the device's status: 50 ms
constexpr int kChecksUntilForceOn = 20;  // a second without force, after which it is requested again
constexpr double kPeakInS = 0.004;       // a step to the peak force in four ticks feels like a knock, not a blow
constexpr int kButtons = 8;

const char* why_force_is_off(int cause) {
  switch (cause) {
    case force_off::kButton:
      return "its force is switched off: press the force button at the device";
    case force_off::kVelocity:
      return "its velocity limit was exceeded";
    case force_off::kWatchdog:
      return "it heard nothing of this program for 20 ms";
    case force_off::kSoftware:
      return "its driver took the force away";
    case force_off::kUsb:
      return "its connection was disturbed";
    case force_off::kDeadMan:
      return "its dead man's switch is open: hold it";
    default:
      return "its force is off";
  }
}

bool comes_back_by_hand(int cause) { return cause == force_off::kButton || cause == force_off::kDeadMan; }

bool is_loss(int code) {
  return code == error::kCommunication || code == error::kNoDriver || code == error::kNoDevice || code == error::kNotAvailable;
}

}  // namespace

Session::Session(const Functions& functions, int index, DriverExchange& exchange)
    : dhd_(functions), exchange_(exchange), gate_(kTurnHz, kVelocityMaxMS) {
  const auto number = static_cast<char>(index);
  id_ = dhd_.drdOpenID ? dhd_.drdOpenID(number) : dhd_.dhdOpenID(number);
  if (id_ < 0) fail(index);
  const auto id = static_cast<char>(id_);
  drd_ = dhd_.drdIsSupported && dhd_.drdIsInitialized && dhd_.drdAutoInit && dhd_.drdStop && dhd_.drdIsSupported(id);
  read_caps(index);
  dhd_.dhdSetGravityCompensation(kOn, id);
  if (caps_.force_max_n > 0) dhd_.dhdSetMaxForce(caps_.force_max_n, id);
  if (caps_.renders_torque) dhd_.dhdSetMaxTorque(caps_.torque_max_nm, id);
  dhd_.dhdEnableExpertMode();  // required to set the watchdog
  if (dhd_.dhdSetWatchdog(static_cast<unsigned char>(kWatchdog / kWatchdogUnit), id) < 0)
    caps_.model += ", which has no watchdog of its own";
  dhd_.dhdEnableForce(kOn, id);
}

Session::~Session() {
  const auto id = static_cast<char>(id_);
  dhd_.dhdSetForceAndTorqueAndGripperForce(0, 0, 0, 0, 0, 0, 0, id);
  dhd_.dhdEnableForce(kOff, id);
  if (dhd_.drdClose)
    dhd_.drdClose(id);
  else
    dhd_.dhdClose(id);
}

void Session::fail(int index) const {
  const int code = dhd_.dhdErrorGetLast();
  const int count = dhd_.dhdGetDeviceCount();
  const char* said = dhd_.dhdErrorGetStr(code);
  const std::string device = "device " + std::to_string(index);
  if (code == error::kInUse)
    throw InputError("forcedimension", device + " is already open", "one program, and one station of it, for each device");
  throw InputError("forcedimension", device + " does not open" + (said ? std::string(": ") + said : ""),
                   count > 0 ? "0 to " + std::to_string(count - 1) + ", and the right to use it (--list-devices)"
                             : "a device that is plugged in, switched on and readable (--list-devices)");
}

void Session::read_caps(int index) {
  const auto id = static_cast<char>(id_);
  const Limits limits = limits_of(dhd_.dhdGetSystemType(id));
  const char* name = dhd_.dhdGetSystemName(id);
  unsigned short serial = 0;
  dhd_.dhdGetSerialNumber(&serial, id);
  std::array<int, status::kCount> status{};
  dhd_.dhdGetStatus(status.data(), id);
  caps_.name = "forcedimension";
  caps_.force_max_n = limits.force_max_n;
  caps_.force_continuous_n = limits.force_continuous_n;
  caps_.stiffness_max_n_m = limits.stiffness_max_n_m;
  caps_.slew_max_n_s = limits.force_max_n / kPeakInS;
  caps_.velocity_max_m_s = kVelocityMaxMS;
  if (limits.radius_m > 0)
    caps_.workspace = Eigen::AlignedBox3d(Vec3::Constant(-limits.radius_m), Vec3::Constant(limits.radius_m));
  caps_.has_orientation = status[status::kWristDetected] != 0;
  const bool turns = caps_.has_orientation && dhd_.dhdHasActiveWrist && dhd_.dhdSetMaxTorque && dhd_.dhdHasActiveWrist(id);
  if (turns && limits.torque_max_nm > 0) {
    caps_.renders_torque = true;
    caps_.torque_max_nm = caps_.torque_continuous_nm = limits.torque_max_nm;
    caps_.torque_slew_max_nm_s = limits.torque_max_nm / kPeakInS;
    caps_.spin_max_rad_s = kSpinMaxRadS;
  }
  caps_.has_opening = dhd_.dhdHasGripper && dhd_.dhdGetGripperGap && dhd_.dhdHasGripper(id);
  caps_.buttons = kButtons;
  caps_.watchdog = kWatchdog;
  caps_.model = "Force Dimension " + std::string(name ? name : "device") + ", serial number " + std::to_string(serial) +
                ", number " + std::to_string(index);
  if (turns && !caps_.renders_torque) caps_.model += ", whose torque has no known limit and is left out";
}

bool Session::must_home() const { return drd_ && !dhd_.drdIsInitialized(static_cast<char>(id_)); }

bool Session::home() noexcept {
  const auto id = static_cast<char>(id_);
  dhd_.dhdEnableForce(kOn, id);  // the watchdog may have switched it off during the warning
  const bool done = dhd_.drdAutoInit(id) >= 0;
  dhd_.drdStop(done, id);  // ends the motion control; the force stays on
  dhd_.dhdEnableForce(kOn, id);
  return done;
}

void Session::turn() noexcept {
  not_ready_ = false;
  const DeviceReading measured = measure();
  if (--until_check_ <= 0) look_after_force();
  DeviceReading reading = gate_.pass(measured);
  if (not_ready_) {
    reading.state = DeviceState::not_ready;
    reading.reason = "it is not calibrated: do what its manual says, or run the maker's autoinit";
  }
  if (lost_) {
    reading.state = DeviceState::gone;
    reading.reason = "the connection to it broke";
  }
  const Wrench asked = exchange_.turn(reading);
  const Vec3 force = to_d(asked.force), torque = caps_.renders_torque ? to_d(asked.torque) : Vec3(Vec3::Zero());
  check(dhd_.dhdSetForceAndTorqueAndGripperForce(force.x(), force.y(), force.z(), torque.x(), torque.y(), torque.z(), 0,
                                                 static_cast<char>(id_)));
}

DeviceReading Session::measure() noexcept {
  const auto id = static_cast<char>(id_);
  Vec3 position = Vec3::Zero();
  DeviceReading reading;
  reading.state = DeviceState::ok;
  check(dhd_.dhdGetPosition(&position.x(), &position.y(), &position.z(), id));
  reading.position = to_w(position);
  if (caps_.has_orientation) {
    double matrix[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    check(dhd_.dhdGetOrientationFrame(matrix, id));
    reading.orientation = orientation_from(matrix);
  }
  if (caps_.has_opening) {
    double gap_m = 0;
    check(dhd_.dhdGetGripperGap(&gap_m, id));
    reading.opening = gap_m / kGripperGapM;
  }
  reading.buttons = dhd_.dhdGetButtonMask(id);
  return reading;
}

/// Requests a force that the device switched off again after a second, unless a person switched it off.
void Session::look_after_force() noexcept {
  const auto id = static_cast<char>(id_);
  until_check_ = kCheckTurns;
  std::array<int, status::kCount> status{};
  const int result = dhd_.dhdGetStatus(status.data(), id);
  check(result);
  if (result < 0 || status[status::kForce]) {
    checks_without_force_ = 0;
    return;
  }
  const int cause = status[status::kForceOffCause];
  gate_.refuse(why_force_is_off(cause));
  if (++checks_without_force_ < kChecksUntilForceOn || comes_back_by_hand(cause)) return;
  checks_without_force_ = 0;
  dhd_.dhdEnableForce(kOn, id);
}

/// Positive results are no errors: a value that was read too soon, a motor at its limit.
void Session::check(int result) noexcept {
  if (result < 0) note(dhd_.dhdErrorGetLast());
}

void Session::note(int code) noexcept {
  if (is_loss(code))
    lost_ = true;
  else if (code == error::kNotReady)
    not_ready_ = true;
  else if (code == error::kNotEnabled)
    until_check_ = 0;  // the status gives the reason
  else if (code == error::kTimeout)
    gate_.refuse("it did not answer in time");
  else
    gate_.refuse("its driver reports an error");
}

}  // namespace palpate::dhd
