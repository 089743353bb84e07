#include "client/io/haptic_loop.hpp"

#include <time.h>

#include <algorithm>
#include <chrono>

#include "common/io/monotonic.hpp"

namespace palpate {

namespace {

constexpr std::int64_t kNanosPerMicro = 1000, kNanosPerSecond = 1'000'000'000;
constexpr Micros kLate{200}, kVeryLate{1000};

std::int64_t now_ns() noexcept {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void sleep_until(Micros due) noexcept {
  const std::int64_t ns = due.count() * kNanosPerMicro;
  const timespec t{ns / kNanosPerSecond, ns % kNanosPerSecond};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) != 0) {
  }
}

}  // namespace

HapticLoop::HapticLoop(Device& device, std::vector<HapticTick*> displays, const HapticLoopOptions& options)
    : device_(device),
      displays_(std::move(displays)),
      outputs_(displays_.size()),
      options_(options),
      recorder_(options.record_ticks, displays_.size()) {}

HapticLoop::~HapticLoop() { stop(); }

RealtimeStatus HapticLoop::start() {
  running_ = true;
  thread_ = std::thread([this] { run(); });
  ready_.wait(false);
  return realtime_;
}

void HapticLoop::stop() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
}

Micros HapticLoop::due_after(Micros after) const noexcept {
  const Micros first{first_due_us_.load()};
  return first + ((monotonic_now() + after - first) / kTick + 1) * kTick;
}

void HapticLoop::run() noexcept {
  if (options_.realtime) realtime_ = request_realtime();
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
    // A tick slept through is gone: the device is read for the newest moment that is due.
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
  running_.store(false, std::memory_order_release);
}

/// False when the device is gone or at its end.
bool HapticLoop::tick(Micros due) noexcept {
  const std::int64_t begin_ns = now_ns();
  const DeviceReading reading = device_.read(due);
  if (!reading.ok()) {
    stats_.device_ended = true;
    return false;
  }
  const ToolSample sample{due, reading.position};
  const std::int64_t before_ns = now_ns();
  outputs_[0] = displays_[0]->tick(sample);
  displays_[0]->hold().say(due, orientation_of(reading), reading.buttons);
  stats_.tick_ns.add(now_ns() - before_ns);
  force_ = outputs_[0].force;
  device_.write(force_);

  for (std::size_t i = 1; i < displays_.size(); ++i) outputs_[i] = displays_[i]->tick(sample);
  int with_patch = 0;
  for (const TickOutput& output : outputs_) with_patch += output.has_patch;
  with_patch_.store(outputs_[0].has_patch ? with_patch : 0, std::memory_order_release);
  ++stats_.ticks;
  stats_.force_max_n = std::max(stats_.force_max_n, reading.share * force_.norm());
  record(due, reading, outputs_[0]);
  stats_.work_ns.add(now_ns() - begin_ns);
  return true;
}

Orientation HapticLoop::orientation_of(const DeviceReading& reading) const noexcept {
  return device_.caps().has_orientation ? Orientation(reading.orientation) : Orientation();
}

void HapticLoop::record(Micros due, const DeviceReading& reading, const TickOutput& main) noexcept {
  if (!recorder_.begin({due, reading.position, main.model_force, main.patch_age, main.has_patch, main.swapped,
                        main.hand_over_step_n, orientation_of(reading), reading.buttons}))
    return;
  for (std::size_t i = 0; i < outputs_.size(); ++i) recorder_.set(i, {reading.share * outputs_[i].force, outputs_[i].contact});
  recorder_.end();
}

void HapticLoop::make_safe(Micros due) noexcept {
  for (int left = kRampTicks - 1; left >= 0 && !stats_.device_ended; --left) {
    device_.write(force_ * (static_cast<double>(left) / kRampTicks));
    due += kTick;
    sleep_until(due);
    if (!device_.read(due).ok()) break;
  }
  device_.stop();
}

}  // namespace palpate
