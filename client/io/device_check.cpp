#include "client/io/device_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <thread>

#include "common/base/rotation_vector.hpp"
#include "common/io/monotonic.hpp"

namespace palpate {

namespace {

constexpr std::uint64_t kSecondTicks = 1000;
constexpr double kTestMostN = 0.5, kTestShare = 0.25;  // kTestShare: of the force that the motors can hold
constexpr double kTestRiseNTick = 0.005;               // 5 N/s: feels like a push, not a knock
constexpr double kTestMostNm = 0.02, kTestRiseNmTick = 0.0002;
constexpr double kYieldM = 0.0005, kYieldRad = 0.01;
constexpr Micros kPushTime{1'000'000}, kRestTime{500'000}, kMeanTime{200'000}, kPollDevice{2'000};
constexpr double kLateShareMax = 0.01, kSkippedShareMax = 0.001, kAnswersLeastHz = 500;

/// Least range of a coordinate within a second.
class Stillness {
 public:
  void add(const Vec3& position) noexcept {
    second_.extend(position);
    if (++ticks_ % kSecondTicks != 0) return;
    const Vec3 range = second_.sizes();
    if (range.norm() < noise_.norm()) noise_ = range;
    second_.setEmpty();
  }
  Vec3 noise() const { return ticks_ < kSecondTicks ? Vec3(Vec3::Zero()) : noise_; }

 private:
  Eigen::AlignedBox3d second_;
  Vec3 noise_ = Vec3::Constant(1e3);
  std::uint64_t ticks_ = 0;
};

}  // namespace

/// The device, observed, and pushed on request.
class DeviceCheck::Probe final : public Device {
 public:
  explicit Probe(Device& device) : device_(device) {}

  const DeviceCaps& caps() const override { return device_.caps(); }
  DeviceReading read(Micros now) noexcept override {
    const DeviceReading reading = device_.read(now);
    ok_ = reading.ok();
    if (ok_) watch(reading);
    newest_.back() = last_ = reading;
    newest_.publish();
    return reading;
  }
  ExchangeFigures exchanges() const override { return device_.exchanges(); }
  void write(const Wrench& wrench) noexcept override {
    if (const Wrench* target = targets_.take()) target_ = *target;
    push_ += limited_to((ok_ ? target_ : Wrench()) - push_, kTestRiseNTick, kTestRiseNmTick);
    if (!ok_) push_ = {};
    device_.write(wrench + push_);
  }
  void stop() noexcept override { device_.stop(); }
  void halt() noexcept override { device_.halt(); }
  void resume() noexcept override {
    push_ = {};
    device_.resume();
  }

  // functions of the other thread
  const DeviceReading* newest() { return newest_.take(); }
  void aim(const Wrench& wrench) {
    targets_.back() = wrench;
    targets_.publish();
  }
  /// Fills in the figures. After the loop.
  void report(DeviceFigures& figures) const {
    figures.seconds = static_cast<double>(watched_) / static_cast<double>(kSecondTicks);
    figures.step_m = step_ < std::numeric_limits<double>::infinity() ? step_ : 0;
    figures.noise_m = stillness_.noise();
    figures.reached = reached_;
    figures.turned_rad = turned_rad_;
    figures.buttons = buttons_;
    figures.state = last_.state;
    figures.reason = last_.reason.text();
  }

 private:
  void watch(const DeviceReading& reading) noexcept {
    constexpr double kRounding = 1e-9;
    if (watched_++ > 0)
      for (const double change : reading.position - place_)
        if (std::abs(change) > kRounding) step_ = std::min(step_, std::abs(change));
    place_ = reading.position;
    reached_.extend(place_);
    stillness_.add(place_);
    buttons_ |= reading.buttons;
    if (!caps().has_orientation) return;
    if (watched_ == 1) first_turn_ = reading.orientation;
    turned_rad_ = std::max(turned_rad_, first_turn_.angularDistance(reading.orientation));
  }

  Device& device_;
  bool ok_ = false;
  Wrench target_, push_;
  Vec3 place_ = Vec3::Zero();
  Eigen::Quaterniond first_turn_ = Eigen::Quaterniond::Identity();
  double turned_rad_ = 0;
  std::uint64_t watched_ = 0;
  double step_ = std::numeric_limits<double>::infinity();
  Stillness stillness_;
  Eigen::AlignedBox3d reached_;
  std::uint32_t buttons_ = 0;
  DeviceReading last_;
  LatestSlot<DeviceReading> newest_;
  LatestSlot<Wrench> targets_;
};

/// A display that never receives a patch: its force is zero.
struct DeviceCheck::Display {
  LatestSlot<PatchPlayer> patches;
  SampleRing samples;
  HapticTick tick{patches, samples, GuardLimits{}};
};

DeviceCheck::DeviceCheck(Device& device, bool realtime)
    : probe_(std::make_unique<Probe>(device)), display_(std::make_unique<Display>()) {
  HapticLoopOptions options;
  options.realtime = realtime;
  loop_ = std::make_unique<HapticLoop>(*probe_, std::vector<HapticTick*>{&display_->tick}, options);
  loop_->start();
  begin_ = monotonic_now();
  before_ = device.exchanges();
}

DeviceCheck::~DeviceCheck() { loop_->stop(); }

const DeviceReading* DeviceCheck::newest() { return probe_->newest(); }
bool DeviceCheck::running() const { return loop_->running(); }

double DeviceCheck::test_force_n() const { return std::min(kTestMostN, kTestShare * probe_->caps().force_continuous_n); }

double DeviceCheck::test_torque_nm() const { return std::min(kTestMostNm, kTestShare * probe_->caps().torque_continuous_nm); }

Yield DeviceCheck::push(int axis, const std::atomic<bool>& stop) {
  return test(
      test_force_n() * Vec3::Unit(axis), kYieldM, [axis](const DeviceReading& reading) { return reading.position[axis]; }, stop);
}

Yield DeviceCheck::twist(int axis, const std::atomic<bool>& stop) {
  std::optional<Rotation> first;
  const auto angle = [&first, axis](const DeviceReading& reading) {
    const Rotation turn(reading.orientation);
    if (!first) first = turn;
    return rotation_between(*first, turn)[axis];
  };
  return test({Vec3::Zero(), test_torque_nm() * Vec3::Unit(axis)}, kYieldRad, angle, stop);
}

/// Exerts a wrench for a second. `along`: coordinate that it moves; less than `least` is no motion.
Yield DeviceCheck::test(const Wrench& wrench, double least, const std::function<double(const DeviceReading&)>& along,
                        const std::atomic<bool>& stop) {
  /// Returns the mean coordinate over the last kMeanTime of `time`.
  const auto place_after = [&](Micros time) {
    const Micros begin = monotonic_now();
    double sum = 0;
    int count = 0;
    for (Micros passed{}; passed < time && !stop && running(); passed = monotonic_now() - begin) {
      std::this_thread::sleep_for(kPollDevice);
      const DeviceReading* reading = newest();
      if (!reading || passed < time - kMeanTime) continue;
      sum += along(*reading);
      ++count;
    }
    return count > 0 ? sum / count : 0.0;
  };
  const double before = place_after(kRestTime);
  probe_->aim(wrench);
  const double after = place_after(kPushTime);
  probe_->aim({});
  if (stop || !running() || std::abs(after - before) < least) return Yield::not_at_all;
  return after > before ? Yield::along : Yield::against;
}

DeviceFigures DeviceCheck::finish() {
  const double passed_s = palpate::seconds(monotonic_now() - begin_);
  loop_->stop();
  DeviceFigures figures;
  const HapticLoopStats& stats = loop_->stats();
  figures.ticks = stats.ticks;
  figures.rate_hz = static_cast<double>(stats.ticks) / std::max(1e-3, passed_s);
  figures.late_ticks = stats.late;
  figures.skipped_ticks = stats.skipped;
  figures.late_us = stats.late_us;
  const ExchangeFigures after = probe_->exchanges();
  figures.exchanges = {after.answers - before_.answers, after.total - before_.total, after.most};
  figures.answers_hz = static_cast<double>(figures.exchanges.answers) / std::max(1e-3, passed_s);
  probe_->report(figures);
  return figures;
}

bool wait_until_ready(Device& device, Micros most, const std::atomic<bool>& stop,
                      const std::function<void(const DeviceReading&, Micros)>& say, const std::function<Micros()>& clock) {
  std::string said;
  Micros said_at{};
  for (const Micros begin = clock(); !stop; std::this_thread::sleep_for(kTick)) {
    const Micros now = clock();
    const DeviceReading reading = device.read(now);
    if (reading.ok()) return true;
    device.write({});
    if (now - begin > most) return false;
    if (reading.reason.text() == said && now - said_at < kRemindEvery) continue;
    said = reading.reason.text();
    said_at = now;
    say(reading, now - begin);
  }
  return false;
}

namespace {

/// Returns the histogram of lateness, with two rows per decade; bars are logarithmic, so that a single tick is visible.
std::string lateness_rows(const DeviceFigures& f) {
  constexpr std::array<std::int64_t, 9> kEdgesUs{0, 10, 20, 50, 100, 200, 500, 1000, 10'000};
  constexpr double kMarksPerDecade = 8;
  std::string rows;
  for (std::size_t i = 0; i + 1 < kEdgesUs.size(); ++i) {
    const std::uint64_t ticks = f.late_us.below(kEdgesUs[i + 1]) - f.late_us.below(kEdgesUs[i]);
    const auto marks = ticks == 0 ? 0 : static_cast<std::size_t>(1 + kMarksPerDecade * std::log10(static_cast<double>(ticks)));
    rows += fmt::format("  {:>4} to {:>5} us {:>7} {}\n", kEdgesUs[i], kEdgesUs[i + 1], ticks, std::string(marks, '#'));
  }
  return rows;
}

}  // namespace

std::string describe(const DeviceFigures& f, const DeviceCaps& caps) {
  const auto known = [](double value, const char* unit) {
    return value > 0 ? fmt::format("{:.3g} {}", value, unit) : "not known";
  };
  const auto in_mm = [](const Vec3& v) {
    return fmt::format("{:.3g}, {:.3g}, {:.3g} mm", 1e3 * v.x(), 1e3 * v.y(), 1e3 * v.z());
  };
  std::string text;
  if (!caps.model.empty()) text += fmt::format("model       {}\n", caps.model);
  text += fmt::format("limits      peak {}, lasting {}, stiffness {}\n", known(caps.force_max_n, "N"),
                      known(caps.force_continuous_n, "N"), known(caps.stiffness_max_n_m, "N/m"));
  if (caps.renders_torque)
    text += fmt::format("torque      peak {}, lasting {}, stiffness {}\n", known(caps.torque_max_nm, "N m"),
                        known(caps.torque_continuous_nm, "N m"), known(caps.torsion_stiffness_max_nm_rad, "N m/rad"));
  else
    text +=
        "torque      none: it has no motors for it, or no limits of it are known; a tool with a body is felt by its force "
        "alone\n";
  text += fmt::format(
      "loop        {:.1f} ticks a second, {} late by more than 0.2 ms, {} skipped; woken late by (median) {} us, (99 %) {} us, "
      "(most) {} us\n",
      f.rate_hz, f.late_ticks, f.skipped_ticks, f.late_us.percentile(0.5), f.late_us.percentile(0.99), f.late_us.max());
  text += lateness_rows(f);
  if (f.exchanges.answers > 0)
    text +=
        fmt::format("driver      {:.1f} answers a second, after {:.2f} ms in the mean, {:.2f} ms at most\n", f.answers_hz,
                    1e3 * seconds(f.exchanges.total) / static_cast<double>(f.exchanges.answers), 1e3 * seconds(f.exchanges.most));
  text += fmt::format("position    steps of {}, moves by {} peak to peak in its stillest second\n",
                      f.step_m > 0 ? fmt::format("{:.3g} mm", 1e3 * f.step_m) : "nothing: it never moved", in_mm(f.noise_m));
  if (!f.reached.isEmpty()) text += fmt::format("was moved   over {} (right, away, up)\n", in_mm(f.reached.sizes()));
  if (caps.has_orientation) text += fmt::format("was turned  by {:.0f} degrees\n", f.turned_rad * 180 / std::numbers::pi);
  if (!caps.workspace.isEmpty()) text += fmt::format("workspace   {}\n", in_mm(caps.workspace.sizes()));
  std::string pressed;
  for (int button = 0; button < 32; ++button)
    if (f.buttons >> button & 1U) pressed += fmt::format(" {}", button);
  text += caps.buttons == 0 ? "buttons     none\n"
                            : fmt::format("buttons     {}, pressed:{}\n", caps.buttons, pressed.empty() ? " none" : pressed);
  return text;
}

std::vector<std::string> faults_of(const DeviceFigures& f, const DeviceCaps& caps) {
  std::vector<std::string> faults;
  const auto all = static_cast<double>(std::max<std::uint64_t>(1, f.ticks));
  if (f.state != DeviceState::ok) faults.push_back("the device was not ok at the end: " + f.reason);
  if (caps.renders_force && (caps.force_max_n <= 0 || caps.slew_max_n_s <= 0))
    faults.push_back("the device does not say what force it can render: it cannot be felt with");
  if (static_cast<double>(f.late_ticks) > kLateShareMax * all)
    faults.push_back(fmt::format("{:.1f} % of the ticks are late: give the loop real-time priority (docs/reference/threads.md)",
                                 100 * static_cast<double>(f.late_ticks) / all));
  if (static_cast<double>(f.skipped_ticks) > kSkippedShareMax * all)
    faults.push_back(fmt::format("{} ticks never ran: this machine has too much else to do", f.skipped_ticks));
  if (f.exchanges.answers > 0 && f.answers_hz < kAnswersLeastHz)
    faults.push_back(
        fmt::format("its driver answers {:.0f} times a second; a stiff body needs {:.0f}", f.answers_hz, kAnswersLeastHz));
  return faults;
}

}  // namespace palpate
