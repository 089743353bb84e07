#include "client/device/forcedimension/forcedimension_device.hpp"

#include <pthread.h>
#include <sched.h>
#include <sys/prctl.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>

#include "client/device/driver_exchange.hpp"
#include "client/device/forcedimension/dhd_session.hpp"
#include "common/base/error.hpp"

namespace palpate {

namespace {

constexpr Micros kOpenEvery{1'000'000}, kHangsAfter{200'000}, kHangPoll{1'000}, kWarnEvery{10'000};
constexpr auto kTurn = std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 / dhd::kTurnHz));
constexpr int kRealtimePriority = 49;  // same as that of the 1 kHz loop

/// Requests the priority of the 1 kHz loop. When denied, the exchange is less regular, like the loop itself, which reports it.
void ask_for_priority() noexcept {
  sched_param priority{};
  priority.sched_priority = kRealtimePriority;
  pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority);
  prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
}

}  // namespace

/// State shared by thread and device; the thread may be its last owner when a call of the library hangs.
struct ForceDimensionDevice::Driver {
  explicit Driver(const ForceDimensionOptions& given) : options(given) {}

  ForceDimensionOptions options;
  DriverExchange exchange{dhd::kTurnHz};
  std::unique_ptr<dhd::Session> session;
  std::string model;
  std::atomic<bool> ends{false}, ended{false};
  std::thread thread;

  void run() noexcept {
    ask_for_priority();
    while (!ends) {
      if (!session && !open_again()) continue;
      if (session->must_home() && !home()) continue;
      use();
    }
    session.reset();
    ended = true;
  }

  /// Reopens the device. Waits a moment when it is still away.
  bool open_again() noexcept {
    pause(kOpenEvery, not_ok(DeviceState::gone, "the connection to it broke"));
    if (ends) return false;
    try {
      session = std::make_unique<dhd::Session>(dhd::functions(), options.index, exchange);
    } catch (const std::exception&) {
      return false;
    }
    // Another device has other limits than those known to the guard.
    if (session->caps().model != model) session.reset();
    return session != nullptr;
  }

  bool home() noexcept {
    pause(options.hands_off, not_ok(DeviceState::not_ready, "hands off: it will move by itself to find its place"));
    exchange.turn(not_ok(DeviceState::not_ready, "hands off: it moves by itself to find its place"));
    if (ends || session->home()) return !ends;
    pause(kOpenEvery, not_ok(DeviceState::not_ready, "it did not find its place: move it to the middle, then hands off"));
    return false;
  }

  void pause(Micros time, const DeviceReading& reading) noexcept {
    for (Micros waited{}; waited < time && !ends; waited += kWarnEvery) {
      exchange.turn(reading);
      std::this_thread::sleep_for(std::min(kWarnEvery, time - waited));
    }
  }

  void use() noexcept {
    auto due = std::chrono::steady_clock::now();
    while (!ends && !session->lost()) {
      session->turn();
      due = std::max(due + kTurn, std::chrono::steady_clock::now());  // missed turns are not made up for
      std::this_thread::sleep_until(due);
    }
    if (session->lost()) session.reset();
  }
};

ForceDimensionDevice::ForceDimensionDevice(const ForceDimensionOptions& options) : driver_(std::make_shared<Driver>(options)) {
  if (options.index < 0 || options.index > 127)
    throw InputError("forcedimension", "device " + std::to_string(options.index), "a number from 0");
  driver_->session = std::make_unique<dhd::Session>(dhd::functions(), options.index, driver_->exchange);
  caps_ = driver_->session->caps();
  driver_->model = caps_.model;
  if (options.own_thread) driver_->thread = std::thread([driver = driver_] { driver->run(); });
}

ForceDimensionDevice::~ForceDimensionDevice() {
  driver_->exchange.halt();
  driver_->ends = true;
  if (!driver_->thread.joinable()) return;
  for (Micros waited{}; !driver_->ended && waited < kHangsAfter; waited += kHangPoll) std::this_thread::sleep_for(kHangPoll);
  if (driver_->ended) {
    driver_->thread.join();
  } else {
    driver_->thread.detach();
  }
}

DeviceReading ForceDimensionDevice::read(Micros) noexcept { return driver_->exchange.read(); }
void ForceDimensionDevice::write(const Wrench& wrench) noexcept { driver_->exchange.write(wrench); }
void ForceDimensionDevice::stop() noexcept { driver_->exchange.write({}); }
void ForceDimensionDevice::halt() noexcept { driver_->exchange.halt(); }
void ForceDimensionDevice::resume() noexcept { driver_->exchange.resume(); }
void ForceDimensionDevice::turn() noexcept { driver_->session->turn(); }

}  // namespace palpate
