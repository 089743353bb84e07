#include "client/device/openhaptics/hd_session.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <thread>

#include "client/device/openhaptics/hd_frame.hpp"
#include "common/base/error.hpp"

namespace palpate::hd {

namespace {

constexpr int kErrorsMax = 16;    // read from the stack at once: a bound, whatever the library does
constexpr int kCheckTurns = 100;  // between two checks of calibration and force output
constexpr double kNewtonsPerMillimetre = 1000;
constexpr double kPeakInS = 0.004;  // a step to the peak force in four ticks feels like a knock, not a blow
constexpr Micros kZeroWait{50'000}, kZeroPoll{1'000};
constexpr int kZeroTurns = 3;
constexpr int kStylusButtons = 2, kDofWithRotation = 6;

const char* calibration_request(unsigned int style) {
  if (style & calibration::kInkwell) return "it is not calibrated: put the stylus into the inkwell";
  if (style & calibration::kEncoderReset) return "it is not calibrated: hold the arm in its reset position and press the button";
  return "it is not calibrated: move the stylus about slowly";
}

/// Returns the calibration style that needs the least of the person.
unsigned int best_style(unsigned int styles) {
  for (const unsigned int style : {calibration::kAuto, calibration::kInkwell, calibration::kEncoderReset})
    if (styles & style) return style;
  return 0;
}

/// Returns null for errors that are no fault of the device, such as our own call at a wrong time.
const char* fault_of(unsigned int code) {
  switch (code) {
    case error::kWarmMotors:
      return "its motors are too hot: let them cool";
    case error::kExceededMaxForce:
      return "its driver's force limit was exceeded";
    case error::kExceededMaxForceImpulse:
      return "its driver's limit of force changes was exceeded";
    case error::kExceededMaxVelocity:
      return "its driver's velocity limit was exceeded";
    case error::kForceError:
      return "its driver cannot render the force";
    default:
      return nullptr;
  }
}

bool is_loss(unsigned int code) {
  return code == error::kDeviceFault || code == error::kCommError || code == error::kCommConfigError ||
         code == error::kTimerError;
}

std::string text_of(const char* text) { return text ? text : ""; }

}  // namespace

Session::Session(const Functions& functions, const std::string& config, DriverExchange& exchange)
    : hd_(functions), exchange_(exchange), gate_(kSchedulerHz, kVelocityMaxMS) {
  take_errors();  // those of an earlier user of the library
  handle_ = hd_.hdInitDevice(config.empty() ? nullptr : config.c_str());
  const unsigned int code = hd_.hdGetError().code;
  if (handle_ == kInvalidHandle || code != error::kSuccess) fail(config, code);
  hd_.hdMakeCurrentDevice(handle_);
  read_caps();
  hd_.hdEnable(capability::kForceOutput);
  hd_.hdEnable(capability::kMaxForceClamping);
  hd_.hdEnable(capability::kSoftwareForceLimit);
  hd_.hdSetSchedulerRate(static_cast<unsigned long>(kSchedulerHz));
  scheduled_ = hd_.hdScheduleAsynchronous(&Session::tick, this, kPriorityMax);
  take_errors();
  hd_.hdStartScheduler();
}

Session::~Session() {
  closes_ = true;
  const std::uint64_t before = turns_;
  for (Micros waited{}; turns_ < before + kZeroTurns && waited < kZeroWait; waited += kZeroPoll)
    std::this_thread::sleep_for(kZeroPoll);
  hd_.hdStopScheduler();
  hd_.hdUnschedule(scheduled_);
  hd_.hdMakeCurrentDevice(handle_);
  hd_.hdDisable(capability::kForceOutput);
  hd_.hdDisableDevice(handle_);
}

void Session::fail(const std::string& config, unsigned int code) {
  const std::string device = config.empty() ? "the default device" : "the device '" + config + "'";
  if (code == error::kDeviceAlreadyInitiated)
    throw InputError("openhaptics", device + " is already open", "one program, and one station of it, for each device");
  const std::string said = text_of(hd_.hdGetErrorString(code));
  const bool has_folder = std::getenv("GTDD_HOME") != nullptr;
  throw InputError("openhaptics", device + " does not open" + (said.empty() ? "" : ": " + said),
                   std::string("a device that is plugged in, switched on, set up with the vendor's setup program and readable "
                               "(--list-devices)") +
                       (has_folder ? "" : "; the 2022 driver also wants GTDD_HOME to name its configuration folder"));
}

void Session::read_caps() {
  const auto number = [this](unsigned int parameter) {
    double value = 0;
    hd_.hdGetDoublev(parameter, &value);
    return std::max(0.0, value);
  };
  const auto text = [this](unsigned int parameter) { return text_of(hd_.hdGetString(parameter)); };
  caps_.name = "openhaptics";
  caps_.force_max_n = number(parameter::kNominalMaxForce);
  caps_.force_continuous_n = number(parameter::kNominalMaxContinuousForce);
  caps_.stiffness_max_n_m = kNewtonsPerMillimetre * number(parameter::kNominalMaxStiffness);
  caps_.slew_max_n_s = caps_.force_max_n / kPeakInS;
  caps_.velocity_max_m_s = kVelocityMaxMS;
  std::array<double, 6> box{};
  hd_.hdGetDoublev(parameter::kUsableWorkspace, box.data());
  if (box[3] > box[0]) {
    caps_.workspace.extend(position_from(box.data()));
    caps_.workspace.extend(position_from(box.data() + 3));
  }
  int dof = 0, styles = 0;
  hd_.hdGetIntegerv(parameter::kInputDof, &dof);
  hd_.hdGetIntegerv(parameter::kCalibrationStyle, &styles);
  calibration_style_ = best_style(static_cast<unsigned int>(styles));
  caps_.has_orientation = dof >= kDofWithRotation;
  caps_.buttons = kStylusButtons;
  caps_.watchdog = DriverExchange::kStaleAfter;
  caps_.model = text(parameter::kDeviceVendor) + " " + text(parameter::kDeviceModelType) + ", serial number " +
                text(parameter::kDeviceSerialNumber) + ", driver " + text(parameter::kDeviceDriverVersion);
  take_errors();
  read_torque_caps();
}

/// A device with six motors renders a torque if its library states the limits.
void Session::read_torque_caps() {
  int output_dof = 0;
  hd_.hdGetIntegerv(parameter::kOutputDof, &output_dof);
  take_errors();
  if (!caps_.has_orientation || output_dof < kDofWithRotation) return;
  const auto number = [this](unsigned int parameter) {
    double value = 0;
    hd_.hdGetDoublev(parameter, &value);
    return std::max(0.0, value) / kMilli;
  };
  caps_.torque_max_nm = number(parameter::kNominalMaxTorque);
  caps_.torque_continuous_nm = number(parameter::kNominalMaxContinuousTorque);
  caps_.torsion_stiffness_max_nm_rad = number(parameter::kNominalMaxTorqueStiffness);
  caps_.torque_slew_max_nm_s = caps_.torque_max_nm / kPeakInS;
  caps_.spin_max_rad_s = kSpinMaxRadS;
  take_errors();
  caps_.renders_torque = caps_.torque_max_nm > 0 && caps_.torque_continuous_nm > 0;
  if (!caps_.renders_torque) caps_.model += ", whose torque has no known limit and is left out";
}

/// Sets the torque, until the library refuses to know it.
void Session::set_torque(const double* mnm) noexcept {
  if (!caps_.renders_torque || torque_refused_) return;
  take_errors();
  hd_.hdSetDoublev(parameter::kCurrentTorque, mnm);
  const unsigned int code = hd_.hdGetError().code;
  torque_refused_ = code == error::kInvalidEnum || code == error::kInvalidValue || code == error::kInvalidOperation;
  if (torque_refused_) gate_.refuse("its library takes no torque in space: there is none from now on");
  if (code != error::kSuccess) note(code);
}

unsigned int Session::tick(void* self) noexcept {
  static_cast<Session*>(self)->turn();
  return kCallbackContinue;
}

void Session::turn() noexcept {
  hd_.hdMakeCurrentDevice(handle_);
  hd_.hdBeginFrame(handle_);
  const DeviceReading measured = measure();
  take_errors();
  DeviceReading reading = gate_.pass(measured);
  if (lost()) {
    reading.state = DeviceState::gone;
    reading.reason = "the connection to it broke";
  }
  std::array<double, 3> force{}, torque{};
  const Wrench asked = exchange_.turn(reading);
  if (!closes_.load(std::memory_order_acquire)) {
    force_to(asked.force, force.data());
    torque_to(asked.torque, torque.data());
  }
  hd_.hdSetDoublev(parameter::kCurrentForce, force.data());
  set_torque(torque.data());
  hd_.hdEndFrame(handle_);
  take_errors();
  turns_.fetch_add(1, std::memory_order_release);
}

DeviceReading Session::measure() noexcept {
  std::array<double, 3> position{};
  std::array<double, 16> transform{};
  int buttons = 0;
  hd_.hdGetDoublev(parameter::kCurrentPosition, position.data());
  hd_.hdGetIntegerv(parameter::kCurrentButtons, &buttons);
  DeviceReading reading;
  reading.position = position_from(position.data());
  reading.buttons = static_cast<std::uint32_t>(buttons);
  if (caps_.has_orientation) {
    hd_.hdGetDoublev(parameter::kCurrentTransform, transform.data());
    reading.orientation = orientation_from(transform.data());
  }
  look_after(reading.buttons);
  reading.state = calibration_ == calibration::kOk ? DeviceState::ok : DeviceState::not_ready;
  if (!reading.ok()) reading.reason = calibration_request(calibration_style_);
  return reading;
}

/// Checks occasionally that the device is calibrated and its force on. Encoders are reset only when the person confirms by the
/// button.
void Session::look_after(std::uint32_t buttons) noexcept {
  const bool pressed = buttons != 0 && buttons_before_ == 0;
  buttons_before_ = buttons;
  if (--until_check_ > 0 && !pressed) return;
  until_check_ = kCheckTurns;
  if (!hd_.hdIsEnabled(capability::kForceOutput)) hd_.hdEnable(capability::kForceOutput);
  calibration_ = hd_.hdCheckCalibration();
  const bool by_hand = calibration_style_ == calibration::kEncoderReset;
  if (by_hand ? pressed && calibration_ != calibration::kOk : calibration_ == calibration::kNeedsUpdate)
    hd_.hdUpdateCalibration(calibration_style_);
}

void Session::take_errors() noexcept {
  for (int i = 0; i < kErrorsMax; ++i) {
    const ErrorInfo info = hd_.hdGetError();
    if (info.code == error::kSuccess) return;
    note(info.code);
  }
}

void Session::note(unsigned int code) noexcept {
  if (const char* fault = fault_of(code)) gate_.refuse(fault);
  if (is_loss(code)) lost_.store(true, std::memory_order_release);
}

}  // namespace palpate::hd
