// Stand-in for libHD.so. Numbers and signatures are repeated here from the vendor's published reference, and nothing is shared
// with the adapter, so that an error in either shows.
#include <cstring>

#include "tests/client/device/standin/arm.hpp"

using palpate::Motion;
using palpate::Standin;
using palpate::StandinFault;
using palpate::Vec3;
using palpate::Wrench;

namespace {

using HHD = unsigned int;
using HDenum = unsigned int;
using Servo = unsigned int (*)(void*);

constexpr HHD kHandle = 7;
constexpr unsigned int kMask = 0xFF00;  // parameters 0x20.., 0x21.., 0x22.., 0x23.., 0x27.., 0x28.. belong to a frame

class StandinHd final : public palpate::StandinArm {
 public:
  HHD init(const char* config) {
    if (open_) return error(0x301), 0xFFFFFFFF;
    if (fault() == StandinFault::no_device || fault() == StandinFault::lost || (config && !std::strcmp(config, "nobody")))
      return error(0x300), 0xFFFFFFFF;
    open_ = true;
    return kHandle;
  }
  void disable(HHD handle) {
    if (!known(handle)) return;
    if (scheduler_) breach("hdDisableDevice while the scheduler runs");
    open_ = forces_ = false;
  }
  bool known(HHD handle) {
    if (handle == kHandle && open_) return true;
    error(0x104);
    return false;
  }

  void begin_frame(HHD handle) {
    if (!known(handle)) return;
    wait_while_blocked();
    if (!in_time_thread()) breach("hdBeginFrame outside of the scheduler's thread");
    if (in_frame_ || frame_used_) {
      breach("a second hdBeginFrame in a tick");
      return error(0x400);
    }
    in_frame_ = frame_used_ = true;
    if (fault() == StandinFault::hot) error(0x200);
    if (fault() == StandinFault::velocity_limit) error(0x203);
    if (fault() == StandinFault::lost) error(0x302);
  }
  void end_frame(HHD handle) {
    if (!known(handle)) return;
    if (!in_frame_) {
      breach("hdEndFrame without hdBeginFrame");
      return error(0x401);
    }
    in_frame_ = false;
    if (fault() == StandinFault::force_limit) error(0x201);
    // frame D to W; torques in thousandths
    const Vec3 force(set_[0], -set_[2], set_[1]), torque = 1e-3 * Vec3(torque_[0], -torque_[2], torque_[1]);
    command(forces_ ? Wrench(force, torque) : Wrench());
  }
  bool allowed(HDenum parameter) {
    const unsigned int group = parameter & kMask;
    const bool of_frame =
        group == 0x2000 || group == 0x2100 || group == 0x2200 || group == 0x2300 || group == 0x2700 || group == 0x2800;
    if (!of_frame || (in_frame_ && in_time_thread())) return true;
    breach("state got or set outside of a frame");
    error(0x402);
    return false;
  }

  void get_doubles(HDenum parameter, double* out) {
    if (!allowed(parameter)) return;
    const Vec3 w = 1000 * position();
    const double d[3] = {w.x(), w.z(), -w.y()};
    // The stylus is rotated by 30 degrees about D's y axis; columns of the matrix are its axes.
    const double c = 0.8660254037844387, s = 0.5;
    double transform[16] = {c, 0, -s, 0, 0, 1, 0, 0, s, 0, c, 0, d[0], d[1], d[2], 1};
    const bool turning = turns();
    if (turning) {
      const Eigen::Matrix3d tool = turn_of_tool().toRotationMatrix();
      for (int axis = 0; axis < 3; ++axis) {
        transform[4 * axis] = tool(0, axis);
        transform[4 * axis + 1] = tool(2, axis);
        transform[4 * axis + 2] = -tool(1, axis);
      }
    }
    switch (parameter) {
      case 0x2050:
        std::memcpy(out, d, sizeof d);
        break;
      case 0x2052:
        std::memcpy(out, transform, sizeof transform);
        break;
      case 0x2551: {
        const double box[6] = {-190, -95, -130, 190, 170, 60};
        std::memcpy(out, box, sizeof box);
        break;
      }
      case 0x2602:
        *out = 0.8;
        break;
      case 0x2603:
        *out = 8.5;
        break;
      case 0x2604:
        *out = 1.4;
        break;
      case 0x2620:
        return turning ? void(*out = 800) : error(0x100);
      case 0x2622:
        return turning ? void(*out = 300) : error(0x100);
      case 0x2623:
        return turning ? void(*out = 50) : error(0x100);
      default:
        error(0x100);
    }
  }
  void get_integers(HDenum parameter, int* out) {
    if (!allowed(parameter)) return;
    switch (parameter) {
      case 0x2000:
        *out = static_cast<int>(buttons());
        break;
      case 0x2553:
        *out = 6;
        break;
      case 0x2554:
        *out = turns() ? 6 : 3;
        break;
      case 0x2555:
        *out = 4;
        break;
      default:
        error(0x100);
    }
  }
  void set_doubles(HDenum parameter, const double* in) {
    if (!allowed(parameter)) return;
    const bool torque = parameter == 0x2701 && turns() && fault() != StandinFault::no_torque;
    if (parameter != 0x2700 && !torque) return error(0x100);
    std::memcpy(torque ? torque_ : set_, in, sizeof set_);
  }
  bool in_use() const override { return open_; }
  void force_output(bool on) { forces_ = on; }
  bool force_output() const { return forces_; }

  unsigned int check_calibration() {
    if (!calibrated()) return 0x5002;
    return updated_ ? 0x5000 : 0x5001;
  }
  void update_calibration(unsigned int style) {
    if (style != 4) return error(0x101);
    if (calibrated()) updated_ = true;
  }
  void misbehave(StandinFault fault) override {
    if (fault == StandinFault::not_calibrated) updated_ = false;
    StandinArm::misbehave(fault);
  }
  void begin(const Motion& intention, const palpate::SimPhantomOptions& hand) override {
    StandinArm::begin(intention, hand);
    updated_ = true;
    errors_.clear();
  }

  void start_scheduler() {
    scheduler_ = true;
    start_time();
  }
  void stop_scheduler() {
    scheduler_ = false;
    stop_time();
  }
  unsigned long schedule(Servo servo, void* data) {
    servo_ = servo;
    data_ = data;
    return 1;
  }
  void unschedule() { servo_ = nullptr; }

  void error(unsigned int code) {
    const std::lock_guard lock(errors_mutex_);
    errors_.push_back(code);
  }
  unsigned int take_error() {
    const std::lock_guard lock(errors_mutex_);
    if (errors_.empty()) return 0;
    const unsigned int code = errors_.back();
    errors_.pop_back();
    return code;
  }

 private:
  void turn() override {
    frame_used_ = in_frame_ = false;
    if (servo_ && servo_(data_) == 0) servo_ = nullptr;
  }

  std::atomic<bool> open_{false};
  bool scheduler_ = false, in_frame_ = false, frame_used_ = false;
  std::atomic<bool> forces_{false}, updated_{true};
  double set_[3] = {0, 0, 0}, torque_[3] = {0, 0, 0};
  Servo servo_ = nullptr;
  void* data_ = nullptr;
  std::mutex errors_mutex_;
  std::vector<unsigned int> errors_;
};

StandinHd& hd() {
  static auto* standin = new StandinHd;  // its thread may outlive every static
  return *standin;
}

}  // namespace

#define HD_API extern "C" __attribute__((visibility("default")))

struct HDErrorInfo {
  unsigned int errorCode;
  int internalErrorCode;
  HHD hHD;
};

HD_API Standin* palpate_standin() { return &hd(); }

HD_API HHD hdInitDevice(const char* config) { return hd().init(config); }
HD_API void hdDisableDevice(HHD handle) { hd().disable(handle); }
HD_API void hdMakeCurrentDevice(HHD handle) { hd().known(handle); }
HD_API void hdBeginFrame(HHD handle) { hd().begin_frame(handle); }
HD_API void hdEndFrame(HHD handle) { hd().end_frame(handle); }
HD_API HDErrorInfo hdGetError() { return {hd().take_error(), 0, kHandle}; }
HD_API const char* hdGetErrorString(HDenum code) { return code == 0x300 ? "Device fault" : "An error"; }
HD_API void hdEnable(HDenum capability) {
  if (capability == 0x4000) hd().force_output(true);
}
HD_API void hdDisable(HDenum capability) {
  if (capability == 0x4000) hd().force_output(false);
}
HD_API unsigned char hdIsEnabled(HDenum capability) { return capability == 0x4000 && hd().force_output(); }
HD_API void hdGetIntegerv(HDenum parameter, int* out) { hd().get_integers(parameter, out); }
HD_API void hdGetDoublev(HDenum parameter, double* out) { hd().get_doubles(parameter, out); }
HD_API const char* hdGetString(HDenum parameter) {
  return parameter == 0x2501 ? "PHANTOM Premium 1.5" : parameter == 0x2503 ? "stand-in" : "1";
}
HD_API void hdSetDoublev(HDenum parameter, const double* in) { hd().set_doubles(parameter, in); }
HD_API HDenum hdCheckCalibration() { return hd().check_calibration(); }
HD_API void hdUpdateCalibration(HDenum style) { hd().update_calibration(style); }
HD_API void hdStartScheduler() { hd().start_scheduler(); }
HD_API void hdStopScheduler() { hd().stop_scheduler(); }
HD_API void hdSetSchedulerRate(unsigned long hz) {
  if (hz != 1000) hd().error(0x101);
}
HD_API unsigned long hdScheduleAsynchronous(Servo servo, void* data, unsigned short) { return hd().schedule(servo, data); }
HD_API void hdUnschedule(unsigned long) { hd().unschedule(); }
