#include "client/device/hid/io/hid_device.hpp"

#include <time.h>

#include <chrono>
#include <exception>

#include "common/base/error.hpp"
#include "common/io/monotonic.hpp"

namespace palpate {

namespace {

constexpr std::size_t kReportRoom = 4096;
constexpr Micros kWriterWait{10'000};
constexpr long kNanosPerSecondHid = 1'000'000'000;

/// Waits for a post, at most `time`; consumes all pending posts as one.
void wait_for(sem_t& semaphore, Micros time) noexcept {
  timespec until{};
  clock_gettime(CLOCK_MONOTONIC, &until);
  until.tv_nsec += 1000 * static_cast<long>(time.count());
  until.tv_sec += until.tv_nsec / kNanosPerSecondHid;
  until.tv_nsec %= kNanosPerSecondHid;
  if (sem_clockwait(&semaphore, CLOCK_MONOTONIC, &until) != 0) return;
  while (sem_trywait(&semaphore) == 0) {
  }
}

bool same_limits(const DeviceCaps& a, const DeviceCaps& b) {
  return a.force_max_n == b.force_max_n && a.force_continuous_n == b.force_continuous_n && a.slew_max_n_s == b.slew_max_n_s &&
         a.stiffness_max_n_m == b.stiffness_max_n_m && a.velocity_max_m_s == b.velocity_max_m_s && a.watchdog == b.watchdog &&
         a.workspace.isApprox(b.workspace) && a.renders_torque == b.renders_torque && a.torque_max_nm == b.torque_max_nm &&
         a.torque_continuous_nm == b.torque_continuous_nm && a.torque_slew_max_nm_s == b.torque_slew_max_nm_s &&
         a.torsion_stiffness_max_nm_rad == b.torsion_stiffness_max_nm_rad && a.spin_max_rad_s == b.spin_max_rad_s;
}

}  // namespace

HidDevice::HidDevice(std::unique_ptr<HidProtocol> protocol, HidDeviceOptions options)
    : protocol_(std::move(protocol)), options_(std::move(options)) {
  std::string fault;
  transport_ = options_.open(fault);
  if (!transport_)
    throw InputError(options_.model.empty() ? "hid" : options_.model, fault, "a device that is plugged in and may be opened");
  caps_ = protocol_->begin(*transport_);
  caps_.model = options_.model + (options_.model.empty() || caps_.model.empty() ? "" : ", ") + caps_.model;
  input_ = protocol_->unheard();
  newest_ = {input_, monotonic_now()};
  sem_init(&wake_, 0, 0);
  reader_ = std::thread([this] { run_reader(); });
  writer_ = std::thread([this] { run_writer(); });
}

HidDevice::~HidDevice() {
  end_ = true;
  sem_post(&wake_);
  writer_.join();
  reader_.join();
  sem_destroy(&wake_);
}

DeviceReading HidDevice::read(Micros now) noexcept {
  if (const Heard* heard = heard_.take()) newest_ = *heard;
  HidInput input = newest_.input;
  const Micros silence_max = protocol_->silence_max(input);
  if (input.reading.ok() && silence_max > Micros{0} && now - newest_.at > silence_max) {
    input.reading.state = DeviceState::fault;
    input.reading.reason = "its reports have stopped: move it, and check its power, cable or radio";
  }
  const DeviceReading reading = protocol_->read(input, now);
  was_ok_ = reading.ok();
  return reading;
}

void HidDevice::write(const Wrench& wrench) noexcept { command({was_ok_ ? finite_parts(wrench) : Wrench(), was_ok_, true}); }

void HidDevice::stop() noexcept { command({{}, false, false}); }

void HidDevice::command(const HidCommand& command) noexcept {
  commands_.back() = command;
  commands_.publish();
  sem_post(&wake_);
}

void HidDevice::halt() noexcept {
  halted_.store(true, std::memory_order_release);
  sem_post(&wake_);
}

void HidDevice::publish(const HidInput& input) noexcept {
  input_ = input;
  heard_.back() = {input_, monotonic_now()};
  heard_.publish();
}

void HidDevice::publish_gone(DeviceReason reason) noexcept {
  HidInput input;
  input.reading.reason = reason;
  publish(input);
}

/// Reads reports until the device is lost; returns false at the end.
bool HidDevice::listen() noexcept {
  std::array<std::byte, kReportRoom> report;
  while (!end_.load(std::memory_order_relaxed)) {
    const int got = lost_.load(std::memory_order_acquire) ? -1 : transport_->read(report, kReadWait);
    if (got < 0) return true;
    if (got == 0 || !protocol_->take(std::span(report).first(static_cast<std::size_t>(got)), input_)) continue;
    publish(input_);
  }
  return false;
}

/// Returns false when the device is not there yet, or is another one.
bool HidDevice::open_again() noexcept {
  try {
    std::string fault;
    auto transport = options_.open(fault);
    if (!transport) return false;
    const std::lock_guard lock(use_);
    if (!same_limits(protocol_->begin(*transport), caps_)) {
      publish_gone("what was plugged in has other limits: start anew to use it");
      return false;
    }
    transport_ = std::move(transport);
    return true;
  } catch (const std::exception& error) {
    publish_gone(error.what());
    return false;
  }
}

void HidDevice::run_reader() noexcept {
  if (options_.on_thread) options_.on_thread();
  while (listen()) {
    publish_gone("unplugged, or switched off");
    {
      const std::lock_guard lock(use_);
      transport_.reset();
    }
    while (!end_ && !open_again()) std::this_thread::sleep_for(kLookAgain);
    if (end_) return;
    lost_ = false;
    publish(protocol_->unheard());
  }
}

void HidDevice::send(const HidCommand& command) noexcept {
  const std::lock_guard lock(use_);
  if (!transport_) return;
  if (!protocol_->send(*transport_, command, monotonic_now())) lost_.store(true, std::memory_order_release);
}

void HidDevice::run_writer() noexcept {
  if (options_.on_thread) options_.on_thread();
  HidCommand latest;
  Micros commanded = monotonic_now();
  while (!end_.load(std::memory_order_relaxed)) {
    wait_for(wake_, kWriterWait);
    const HidCommand* fresh = commands_.take();
    if (fresh) {
      latest = *fresh;
      commanded = monotonic_now();
    }
    if (halted_.load(std::memory_order_acquire))
      send({{}, false, false});
    else if (fresh)
      send(latest);
    else if (monotonic_now() - commanded > kStale)
      send({{}, false, true});
  }
  send({{}, false, false});
}

}  // namespace palpate
