#include "client/device/openhaptics/openhaptics_device.hpp"

#include <atomic>
#include <thread>

#include "client/device/driver_exchange.hpp"
#include "client/device/openhaptics/hd_session.hpp"
#include "common/base/error.hpp"

namespace palpate {

namespace {

constexpr Micros kKeeperPoll{20'000}, kOpenAgainEvery{1'000'000}, kCloseMost{1'000'000}, kClosePoll{1'000};

}  // namespace

/// Opens and closes the device, on a thread of its own that may be the last owner when the driver hangs.
struct OpenHapticsDevice::Keeper {
  explicit Keeper(const std::string& name) : config(name) {}

  std::string config, model;
  DriverExchange exchange{hd::kSchedulerHz};
  std::unique_ptr<hd::Session> session;
  std::atomic<bool> ends{false}, closed{false};
  std::thread thread;

  void run() noexcept {
    Micros away{};
    while (!ends) {
      std::this_thread::sleep_for(kKeeperPoll);
      away = session && !session->lost() ? Micros{} : away + kKeeperPoll;
      if (away < kOpenAgainEvery) continue;
      away = Micros{};
      open_again();
    }
    session.reset();
    closed = true;
  }

  void open_again() noexcept {
    session.reset();
    try {
      session = std::make_unique<hd::Session>(hd::functions(), config, exchange);
    } catch (const std::exception&) {
      return;  // still away; another try follows
    }
    // Another device has other limits than those known to the guard.
    if (session->caps().model != model) session.reset();
  }
};

OpenHapticsDevice::OpenHapticsDevice(const std::string& config) : keeper_(std::make_shared<Keeper>(config)) {
  keeper_->session = std::make_unique<hd::Session>(hd::functions(), config, keeper_->exchange);
  caps_ = keeper_->session->caps();
  keeper_->model = caps_.model;
  keeper_->thread = std::thread([keeper = keeper_] { keeper->run(); });
}

OpenHapticsDevice::~OpenHapticsDevice() {
  keeper_->exchange.halt();
  keeper_->ends = true;
  for (Micros waited{}; !keeper_->closed && waited < kCloseMost; waited += kClosePoll) std::this_thread::sleep_for(kClosePoll);
  if (keeper_->closed)
    keeper_->thread.join();
  else
    keeper_->thread.detach();
}

DeviceReading OpenHapticsDevice::read(Micros) noexcept { return keeper_->exchange.read(); }
void OpenHapticsDevice::write(const Wrench& wrench) noexcept { keeper_->exchange.write(wrench); }
void OpenHapticsDevice::stop() noexcept { keeper_->exchange.write({}); }
void OpenHapticsDevice::halt() noexcept { keeper_->exchange.halt(); }
void OpenHapticsDevice::resume() noexcept { keeper_->exchange.resume(); }

}  // namespace palpate
