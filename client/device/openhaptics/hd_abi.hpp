// The part of the C interface of OpenHaptics' HDAPI (libHD.so, 3D Systems) that is used here: types, numbers and signatures of a
// Linux x86-64 library, written down from its published reference. The names are the vendor's, so that its manual can be
// searched.
#pragma once

namespace palpate::hd {

using Handle = unsigned int;
using SchedulerHandle = unsigned long;
using Callback = unsigned int (*)(void*);

/// Returned by value, in registers: its three fields are part of the interface.
struct ErrorInfo {
  unsigned int code;
  int internal_code;
  Handle device;
};
static_assert(sizeof(ErrorInfo) == 12);

inline constexpr Handle kInvalidHandle = 0xFFFFFFFF;
inline constexpr unsigned int kCallbackDone = 0, kCallbackContinue = 1;
inline constexpr unsigned short kPriorityMax = 65535;

namespace error {
inline constexpr unsigned int kSuccess = 0, kInvalidEnum = 0x100, kInvalidValue = 0x101, kInvalidOperation = 0x102,
                              kWarmMotors = 0x200, kExceededMaxForce = 0x201, kExceededMaxForceImpulse = 0x202,
                              kExceededMaxVelocity = 0x203, kForceError = 0x204, kDeviceFault = 0x300,
                              kDeviceAlreadyInitiated = 0x301, kCommError = 0x302, kCommConfigError = 0x303, kTimerError = 0x304;
}

namespace calibration {
inline constexpr unsigned int kOk = 0x5000, kNeedsUpdate = 0x5001, kNeedsManualInput = 0x5002;
inline constexpr unsigned int kEncoderReset = 1, kAuto = 2, kInkwell = 4;  // styles, a bit mask
}  // namespace calibration

namespace capability {
inline constexpr unsigned int kForceOutput = 0x4000, kMaxForceClamping = 0x4001, kSoftwareForceLimit = 0x4003;
}

namespace parameter {
inline constexpr unsigned int kCurrentButtons = 0x2000, kCurrentPosition = 0x2050, kCurrentTransform = 0x2052,
                              kDeviceModelType = 0x2501, kDeviceDriverVersion = 0x2502, kDeviceVendor = 0x2503,
                              kDeviceSerialNumber = 0x2504, kUsableWorkspace = 0x2551, kInputDof = 0x2553, kOutputDof = 0x2554,
                              kCalibrationStyle = 0x2555, kNominalMaxStiffness = 0x2602, kNominalMaxForce = 0x2603,
                              kNominalMaxContinuousForce = 0x2604, kNominalMaxTorqueStiffness = 0x2620,
                              kNominalMaxTorque = 0x2622, kNominalMaxContinuousTorque = 0x2623, kCurrentForce = 0x2700,
                              kCurrentTorque = 0x2701;
}

struct Functions {
  Handle (*hdInitDevice)(const char* config);
  void (*hdDisableDevice)(Handle);
  void (*hdMakeCurrentDevice)(Handle);
  void (*hdBeginFrame)(Handle);
  void (*hdEndFrame)(Handle);
  ErrorInfo (*hdGetError)();
  const char* (*hdGetErrorString)(unsigned int code);
  void (*hdEnable)(unsigned int capability);
  void (*hdDisable)(unsigned int capability);
  unsigned char (*hdIsEnabled)(unsigned int capability);
  void (*hdGetIntegerv)(unsigned int parameter, int* out);
  void (*hdGetDoublev)(unsigned int parameter, double* out);
  const char* (*hdGetString)(unsigned int parameter);
  void (*hdSetDoublev)(unsigned int parameter, const double* in);
  unsigned int (*hdCheckCalibration)();
  void (*hdUpdateCalibration)(unsigned int style);
  void (*hdStartScheduler)();
  void (*hdStopScheduler)();
  void (*hdSetSchedulerRate)(unsigned long hz);
  SchedulerHandle (*hdScheduleAsynchronous)(Callback, void*, unsigned short priority);
  void (*hdUnschedule)(SchedulerHandle);
};

/// Functions of libHD.so, loaded once. Throws InputError when the library is missing or lacks one of them.
const Functions& functions();

}  // namespace palpate::hd
