// The part of the C interface of Force Dimension's DHD and DRD (libdhd.so, libdrd.so) that is used here: numbers and signatures
// of a Linux x86-64 library, written down from its published reference. The names are the vendor's, so that its manual can be
// searched.
//
// Getters and setters return 0, or -1 with the reason in dhdErrorGetLast(), or a positive number that is no error.
#pragma once

namespace palpate::dhd {

inline constexpr int kOn = 1, kOff = 0;
inline constexpr int kTimeGuard = 1;       ///< a getter was called too soon and returned the last value again
inline constexpr int kMotorSaturated = 2;  ///< a setter asked for more than the motors can give

namespace error {
inline constexpr int kNone = 0, kError = 1, kCommunication = 2, kBusy = 3, kNoDriver = 4, kNoDevice = 5, kNotAvailable = 6,
                     kTimeout = 7, kExpertModeDisabled = 9, kNotReady = 12, kNotEnabled = 19, kInUse = 20;
}

/// Results of dhdGetSystemType().
namespace type {
inline constexpr int kOmega3 = 33, kOmega6Right = 34, kOmega7Right = 35, kOmega6Left = 36, kOmega7Left = 37, kFalcon = 60,
                     kDelta3 = 63, kSigma7Right = 104, kSigma7Left = 105, kLambda7Right = 108, kLambda7Left = 109,
                     kLambda6Right = 131, kLambda6Left = 132, kLambda3 = 203, kSigma3 = 206;
}

/// Indices into the array that dhdGetStatus() fills.
namespace status {
inline constexpr int kForce = 5, kWristDetected = 8, kForceOffCause = 14, kCount = 17;
}

/// Reasons for which the device switched its force off.
namespace force_off {
inline constexpr int kNone = 0, kButton = 1, kVelocity = 2, kWatchdog = 3, kSoftware = 4, kUsb = 5, kDeadMan = 6;
}

struct Functions {
  int (*dhdGetDeviceCount)();
  int (*dhdOpenID)(char index);
  int (*dhdClose)(char id);
  int (*dhdEnableForce)(unsigned char on, char id);
  const char* (*dhdGetSystemName)(char id);
  int (*dhdGetSystemType)(char id);
  int (*dhdGetSerialNumber)(unsigned short* number, char id);
  int (*dhdGetPosition)(double* x, double* y, double* z, char id);
  int (*dhdGetOrientationFrame)(double matrix[3][3], char id);
  unsigned int (*dhdGetButtonMask)(char id);
  int (*dhdSetForceAndTorqueAndGripperForce)(double fx, double fy, double fz, double tx, double ty, double tz, double grip,
                                             char id);
  int (*dhdSetGravityCompensation)(int on, char id);
  int (*dhdSetMaxForce)(double newtons, char id);
  // null in an older library
  int (*dhdSetMaxTorque)(double newton_metres, char id);
  bool (*dhdHasActiveWrist)(char id);
  bool (*dhdHasGripper)(char id);
  int (*dhdGetGripperGap)(double* metres, char id);
  int (*dhdGetStatus)(int status[status::kCount], char id);
  int (*dhdErrorGetLast)();
  const char* (*dhdErrorGetStr)(int code);
  int (*dhdEnableExpertMode)();
  int (*dhdSetWatchdog)(unsigned char units, char id);  ///< in units of 125 us, 0: off
  // only in libdrd; null in libdhd
  int (*drdOpenID)(char index);
  int (*drdClose)(char id);
  bool (*drdIsSupported)(char id);
  int (*drdAutoInit)(char id);
  int (*drdStop)(bool keep_force, char id);
  bool (*drdIsInitialized)(char id);
};

/// Functions of libdrd.so, which contains libdhd's too, or of libdhd.so, loaded once. Throws InputError when neither is found.
const Functions& functions();

}  // namespace palpate::dhd
