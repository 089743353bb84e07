#include "client/io/haptic_loop.hpp"

#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "client/io/device_limits.hpp"
#include "client/io/sleep_until.hpp"
#include "common/io/monotonic.hpp"

namespace palpate {

namespace {

constexpr Micros kLate{200}, kVeryLate{1000}, kLook{1000};

std::int64_t now_ns() noexcept {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

int this_thread() noexcept { return static_cast<int>(::syscall(SYS_gettid)); }

}  // namespace

HapticLoop::HapticLoop(Device& device, std::vector<HapticTick*> displays, const HapticLoopOptions& options)
    : device_(device),
      displays_(std::move(displays)),
      outputs_(displays_.size()),
      options_(options),
      recorder_(options.record_ticks, displays_.size()),
      check_(device.caps()),
      watchdog_(device) {
  const GuardLimits limits = limits_of(device.caps(), options.passivity);
  for (HapticTick* const display : displays_) display->limit(limits);
}

HapticLoop::~HapticLoop() {
  stop();
  if (thread_.joinable()) thread_.join();
}

RealtimeStatus HapticLoop::start() {
  watch_crashes();
  running_ = true;
  thread_ = std::thread([this] { run(); });
  ready_.wait(false);
  if (device_.caps().renders_force) watchdog_.start(options_.realtime);
  return realtime_;
}

void HapticLoop::stop() {
  stop_ = true;
  if (!thread_.joinable() || stuck_) return;
  for (const Micros end = monotonic_now() + kStopMost; running() && monotonic_now() < end;) sleep_until(monotonic_now() + kLook);
  stuck_ = running();
  if (stuck_)
    device_.halt();
  else
    thread_.join();
  watchdog_.stop();
  stats_.halts = watchdog_.halts();
  forget_crashes();
}

Micros HapticLoop::due_after(Micros after) const noexcept {
  const Micros first{first_due_us_.load()};
  return first + ((monotonic_now() + after - first) / kTick + 1) * kTick;
}

void HapticLoop::run() noexcept {
  block_signals();
  const CrashStack stack;
  if (options_.realtime) realtime_ = request_realtime();
  thread_id_ = this_thread();
  loop();
  watchdog_.rest();
  running_.store(false, std::memory_order_release);
}

void HapticLoop::loop() noexcept {
  Micros due = monotonic_now() + kTick;
  first_due_us_ = due.count();
  ready_ = true;
  ready_.notify_all();
  for (;;) {
    sleep_until(due);
    const Micros lateness = monotonic_now() - due;
    stats_.late_us.add(lateness.count());
    if (lateness > kLate) {
      ++stats_.late;
      displays_.front()->note_late();
    }
    if (lateness > kVeryLate) ++stats_.very_late;
    // Skip ticks that were slept through: the device is read for the newest moment that is due.
    const auto slept_through = lateness / kTick;
    stats_.skipped += static_cast<std::uint64_t>(slept_through);
    due += slept_through * kTick;
    if (stop_.load(std::memory_order_relaxed) || !tick(due)) break;
    due += kTick;
    if (const Micros done = monotonic_now(); done > due) {
      const auto overrun = (done - due) / kTick + 1;
      stats_.skipped += static_cast<std::uint64_t>(overrun);
      due += overrun * kTick;
    }
  }
  make_safe(due);
}

/// Runs a tick. Returns false when the motion has ended.
bool HapticLoop::tick(Micros due) noexcept {
  const std::int64_t begin_ns = now_ns();
  watchdog_.tick(monotonic_now());
  bool halted = false;
  const bool may_write = watchdog_.resumes(halted);
  if (halted) begin_again(false);
  const DeviceReading reading = device_.read(due);
  if (reading.state == DeviceState::ended) {
    stats_.device_ended = true;
    return false;
  }
  if (!reading.ok()) {
    stay_away(reading);
    return true;
  }
  if (std::exchange(was_away_, false)) {
    check_.restart();
    begin_again(false);
  }
  const Micros gap = due - std::exchange(last_due_, due), own_watchdog = device_.caps().watchdog;
  if (!halted && gap != due && seconds(gap) > Guard::kGapMaxS) begin_again(own_watchdog == Micros{} || gap < own_watchdog);
  const ReadingFault fault =
      check_.look({reading.position, Rotation(reading.orientation)}, due, reading.share * wrench_.force.norm());
  stats_.not_believed += fault != ReadingFault::none;
  note(fault == ReadingFault::none ? DeviceState::ok : DeviceState::fault, describe(fault));
  if (fault == ReadingFault::jumped) begin_again(true);
  const bool shown = fault == ReadingFault::none && may_write && !hold_.load(std::memory_order_relaxed);
  if (shown && share_ == 0) {
    begin_again(false);
    share_ = 1;
  }
  const ToolSample sample{due, reading.position, orientation_of(reading), reading.opening};
  const std::int64_t before_ns = now_ns();
  outputs_[0] = displays_[0]->tick(sample);
  displays_[0]->buttons().say(due, reading.buttons);
  stats_.tick_ns.add(now_ns() - before_ns);
  write(faded(outputs_[0].wrench(), shown) + left_over());
  outputs_[0].force = wrench_.force;
  outputs_[0].torque = wrench_.torque;

  for (std::size_t i = 1; i < displays_.size(); ++i) outputs_[i] = displays_[i]->tick(sample);
  int with_patch = 0;
  for (const TickOutput& output : outputs_) with_patch += output.has_patch;
  with_patch_.store(outputs_[0].has_patch ? with_patch : 0, std::memory_order_release);
  ++stats_.ticks;
  stats_.force_max_n = std::max(stats_.force_max_n, reading.share * wrench_.force.norm());
  stats_.torque_max_nm = std::max(stats_.torque_max_nm, reading.share * wrench_.torque.norm());
  stats_.grip_max_nm = std::max(stats_.grip_max_nm, std::abs(outputs_[0].grip));
  record(due, reading, outputs_[0]);
  stats_.work_ns.add(now_ns() - begin_ns);
  return true;
}

/// Handles a device that switched its force off by itself: the position of its tool is unknown.
void HapticLoop::stay_away(const DeviceReading& reading) noexcept {
  was_away_ = true;
  ++stats_.away;
  wrench_ = {};
  at_zero_.store(true, std::memory_order_release);
  note(reading.state, reading.reason);
}

/// Fades out over kRampTicks while not `shown`, in over Guard::kRampTicks.
Wrench HapticLoop::faded(const Wrench& wrench, bool shown) noexcept {
  share_ = std::clamp(share_ + (shown ? 1.0 / Guard::kRampTicks : -1.0 / kRampTicks), 0.0, 1.0);
  return share_ * wrench;
}

/// Restarts the displays' force at zero; `holds`: the device still shows the force written last.
void HapticLoop::begin_again(bool holds) noexcept {
  displays_.front()->restart();
  held_ = wrench_;
  held_ticks_ = holds ? kRampTicks : 0;
}

/// Returns the remaining part of the force that the device was left with.
Wrench HapticLoop::left_over() noexcept {
  if (held_ticks_ == 0) return {};
  return (static_cast<double>(--held_ticks_) / kRampTicks) * held_;
}

void HapticLoop::write(const Wrench& wrench) noexcept {
  wrench_ = wrench;
  device_.write(wrench_);
  at_zero_.store(wrench_.zero(), std::memory_order_release);
}

void HapticLoop::note(DeviceState state, const DeviceReason& reason) noexcept {
  if (state == noted_.state && reason.text() == noted_.reason.text()) return;
  noted_ = {state, reason};
  notes_.back() = noted_;
  notes_.publish();
}

Orientation HapticLoop::orientation_of(const DeviceReading& reading) const noexcept {
  return device_.caps().has_orientation ? Orientation(reading.orientation) : Orientation();
}

void HapticLoop::record(Micros due, const DeviceReading& reading, const TickOutput& main) noexcept {
  if (!recorder_.begin({due,
                        reading.position,
                        {main.model_force, main.model_torque},
                        main.patch_age,
                        main.has_patch,
                        main.swapped,
                        main.hand_over_step_n,
                        orientation_of(reading),
                        reading.buttons,
                        main.opening,
                        main.grip}))
    return;
  for (std::size_t i = 0; i < outputs_.size(); ++i) recorder_.set(i, {reading.share * outputs_[i].wrench(), outputs_[i].contact});
  recorder_.end();
}

void HapticLoop::make_safe(Micros due) noexcept {
  const Wrench from = wrench_;
  for (int left = kRampTicks - 1; left >= 0 && !stats_.device_ended && !was_away_; --left) {
    write((static_cast<double>(left) / kRampTicks) * from);
    due += kTick;
    sleep_until(due);
    watchdog_.tick(monotonic_now());
    if (!device_.read(due).ok()) break;
  }
  device_.stop();
}

void HapticLoop::stop_in_crash() noexcept {
  constexpr int kLooks = 40;
  stop_.store(true);
  if (thread_id_.load() != this_thread())
    for (int look = 0; look < kLooks && running(); ++look) sleep_until(monotonic_now() + kLook);
  device_.halt();
}

}  // namespace palpate
