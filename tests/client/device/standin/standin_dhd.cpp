// Stand-in for libdrd.so. Numbers and signatures are repeated here from the vendor's published reference, and nothing is shared
// with the adapter, so that an error in either shows.
#include <chrono>
#include <cstring>

#include "tests/client/device/standin/arm.hpp"

using palpate::Motion;
using palpate::Standin;
using palpate::StandinFault;
using palpate::Vec3;
using palpate::Wrench;

namespace {

constexpr int kId = 3, kOmega3 = 33, kSigma7 = 104;
constexpr std::int64_t kStatusForce = 5, kStatusWrist = 8, kStatusCause = 14;

thread_local int last_error = 0;

int failed(int code) {
  last_error = code;
  return -1;
}

class StandinDhd final : public palpate::StandinArm {
 public:
  int open(char index) {
    if (open_) return failed(20);
    if (index != 0 || fault() == StandinFault::no_device || fault() == StandinFault::lost) return failed(5);
    open_ = true;
    forces_ = expert_ = false;
    watchdog_ms_ = 0;
    start_time();
    return kId;
  }
  int close(char id) {
    if (!open_ || id != kId) return failed(5);
    if (forces_ && fault() != StandinFault::lost) breach("closed with the force on");
    stop_time();
    open_ = false;  // last: a waiting thread may open it again at once
    return 0;
  }
  /// Returns -1 and stores the reason, or returns 0.
  int unusable(char id) {
    if (!open_ || id != kId) return failed(5);
    return fault() == StandinFault::lost ? failed(2) : 0;
  }

  int enable(bool on, char id) {
    if (const int bad = unusable(id)) return bad;
    forces_ = on;
    since_force_ms_ = cause_ = 0;
    if (!on) command({});
    return 0;
  }
  int position(double* x, double* y, double* z, char id) {
    if (const int bad = unusable(id)) return bad;
    wait_while_blocked();
    if (!calibrated()) return failed(12);
    const Vec3 w = StandinArm::position();
    *x = -w.y();
    *y = w.x();
    *z = w.z();
    return 0;
  }
  int orientation(double m[3][3], char id) {
    if (const int bad = unusable(id)) return bad;
    // Rotated by 30 degrees about D's z axis; columns are the end effector's axes.
    const double c = 0.8660254037844387, s = 0.5;
    const double turned[3][3] = {{c, -s, 0}, {s, c, 0}, {0, 0, 1}};
    std::memcpy(m, turned, sizeof turned);
    if (!turns()) return 0;
    // Held level, the end effector's x, y, z are the tool's z, x, y.
    const Eigen::Matrix3d tool = turn_of_tool().toRotationMatrix();
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 w = tool.col((axis + 2) % 3);
      m[0][axis] = -w.y();
      m[1][axis] = w.x();
      m[2][axis] = w.z();
    }
    return 0;
  }
  int force(double x, double y, double z, double tx, double ty, double tz, char id) {
    if (const int bad = unusable(id)) return bad;
    if (!forces_) return failed(19);
    since_force_ms_ = 0;
    if (!turns() && (tx != 0 || ty != 0 || tz != 0)) breach("a torque for a device without motors for it");
    command(Wrench(Vec3(y, -x, z), Vec3(ty, -tx, tz)));
    return fault() == StandinFault::force_limit ? 2 : 0;
  }
  int status(int* out, char id) {
    if (const int bad = unusable(id)) return bad;
    std::memset(out, 0, 17 * sizeof(int));
    out[kStatusForce] = forces_;
    out[kStatusWrist] = 1;
    out[kStatusCause] = cause_;
    return 0;
  }
  int expert() {
    expert_ = true;
    return 0;
  }
  int watchdog(unsigned char units, char id) {
    if (const int bad = unusable(id)) return bad;
    if (!expert_) return failed(9);
    watchdog_ms_ = units / 8;
    return 0;
  }
  int gravity(int on) {
    gravity_ = on;
    return 0;
  }
  int home() {
    if (!forces_) breach("homed with the force off");
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    calibrate();
    return 0;
  }
  bool active_wrist() const { return turns(); }
  bool gripper() const { return has_gripper(); }
  int gap(double* metres, char id) {
    if (const int bad = unusable(id)) return bad;
    *metres = 0.025 * opening();
    return 0;
  }
  bool in_use() const override { return open_; }
  bool homed() const { return calibrated(); }
  unsigned int pressed() const { return buttons(); }

 private:
  void turn() override {
    if (!gravity_ && forces_) breach("forces without gravity compensation");
    if (fault() == StandinFault::velocity_limit) force_off(2);
    if (fault() == StandinFault::button_off) force_off(1);
    if (watchdog_ms_ > 0 && forces_ && ++since_force_ms_ > watchdog_ms_) force_off(3);
  }
  void force_off(int cause) {
    forces_ = false;
    cause_ = cause;
    command({});
  }

  std::atomic<bool> open_{false}, forces_{false}, expert_{false};
  std::atomic<int> cause_{0}, since_force_ms_{0}, watchdog_ms_{0}, gravity_{1};
};

StandinDhd& dhd() {
  static auto* standin = new StandinDhd;  // its thread may outlive every static
  return *standin;
}

}  // namespace

#define DHD_API extern "C" __attribute__((visibility("default")))

DHD_API Standin* palpate_standin() { return &dhd(); }

DHD_API int dhdGetDeviceCount() { return 1; }
DHD_API int dhdOpenID(char index) { return dhd().open(index); }
DHD_API int dhdClose(char id) { return dhd().close(id); }
DHD_API int dhdEnableForce(unsigned char on, char id) { return dhd().enable(on != 0, id); }
DHD_API const char* dhdGetSystemName(char) { return dhd().active_wrist() ? "sigma.7 stand-in" : "omega.3 stand-in"; }
DHD_API int dhdGetSystemType(char) { return dhd().active_wrist() ? kSigma7 : kOmega3; }
DHD_API int dhdGetSerialNumber(unsigned short* number, char) {
  *number = 42;
  return 0;
}
DHD_API int dhdGetPosition(double* x, double* y, double* z, char id) { return dhd().position(x, y, z, id); }
DHD_API int dhdGetOrientationFrame(double m[3][3], char id) { return dhd().orientation(m, id); }
DHD_API bool dhdHasActiveWrist(char) { return dhd().active_wrist(); }
DHD_API bool dhdHasGripper(char) { return dhd().gripper(); }
DHD_API int dhdGetGripperGap(double* metres, char id) { return dhd().gap(metres, id); }
DHD_API int dhdSetMaxTorque(double, char) { return 0; }
DHD_API unsigned int dhdGetButtonMask(char) { return dhd().pressed(); }
DHD_API int dhdSetForceAndTorqueAndGripperForce(double x, double y, double z, double tx, double ty, double tz, double, char id) {
  return dhd().force(x, y, z, tx, ty, tz, id);
}
DHD_API int dhdSetGravityCompensation(int on, char) { return dhd().gravity(on); }
DHD_API int dhdSetMaxForce(double, char) { return 0; }
DHD_API int dhdGetStatus(int status[17], char id) { return dhd().status(status, id); }
DHD_API int dhdErrorGetLast() { return last_error; }
DHD_API const char* dhdErrorGetStr(int code) { return code == 5 ? "no device found" : "an error"; }
DHD_API int dhdEnableExpertMode() { return dhd().expert(); }
DHD_API int dhdSetWatchdog(unsigned char units, char id) { return dhd().watchdog(units, id); }
// Older or smaller installations have only libdhd.
#ifndef STANDIN_WITHOUT_DRD
DHD_API int drdOpenID(char index) { return dhd().open(index); }
DHD_API int drdClose(char id) { return dhd().close(id); }
DHD_API bool drdIsSupported(char) { return true; }
DHD_API bool drdIsInitialized(char) { return dhd().homed(); }
DHD_API int drdAutoInit(char) { return dhd().home(); }
DHD_API int drdStop(bool, char) { return 0; }
#endif
