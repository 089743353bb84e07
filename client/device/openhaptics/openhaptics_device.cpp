#include "client/device/openhaptics/openhaptics_device.hpp"

#include "client/device/openhaptics/hd_session.hpp"
#include "common/base/error.hpp"

namespace palpate {

namespace {

constexpr Micros kKeeperPoll{50'000}, kOpenAgainEvery{1'000'000}, kStuckAfter{200'000};

}  // namespace

/// What a driver that hangs may still touch when the device is gone.
struct OpenHapticsDevice::Shared {
  DriverExchange exchange{hd::kSchedulerHz};
  std::unique_ptr<hd::Session> session;
};

OpenHapticsDevice::OpenHapticsDevice(const std::string& config) : config_(config), shared_(std::make_unique<Shared>()) {
  shared_->session = std::make_unique<hd::Session>(hd::functions(), config_, shared_->exchange);
  caps_ = shared_->session->caps();
  keeper_ = std::thread([this] { keep_open(); });
}

OpenHapticsDevice::~OpenHapticsDevice() {
  shared_->exchange.halt();
  ends_ = true;
  keeper_.join();
  if (stuck()) static_cast<void>(shared_.release());
}

DeviceReading OpenHapticsDevice::read(Micros) noexcept { return shared_->exchange.read(); }
void OpenHapticsDevice::write(const Vec3& force) noexcept { shared_->exchange.write(force); }
void OpenHapticsDevice::stop() noexcept { shared_->exchange.write(Vec3::Zero()); }
void OpenHapticsDevice::halt() noexcept { shared_->exchange.halt(); }
void OpenHapticsDevice::resume() noexcept { shared_->exchange.resume(); }

/// The scheduler's thread is in one call for kStuckAfter.
bool OpenHapticsDevice::stuck() const {
  const hd::Session* session = shared_->session.get();
  if (!session) return false;
  const std::uint64_t turns = session->turns();
  for (Micros waited{}; waited < kStuckAfter; waited += Micros{1'000}) {
    if (!session->inside() || session->turns() != turns) return false;
    std::this_thread::sleep_for(Micros{1'000});
  }
  return true;
}

void OpenHapticsDevice::keep_open() noexcept {
  Micros since_try{};
  while (!ends_) {
    std::this_thread::sleep_for(kKeeperPoll);
    const bool open = shared_->session && !shared_->session->lost();
    since_try = open ? Micros{} : since_try + kKeeperPoll;
    if (since_try < kOpenAgainEvery || stuck()) continue;
    since_try = Micros{};
    open_again();
  }
}

void OpenHapticsDevice::open_again() noexcept {
  shared_->session.reset();
  try {
    shared_->session = std::make_unique<hd::Session>(hd::functions(), config_, shared_->exchange);
  } catch (const std::exception&) {
    return;  // still away; the next try comes
  }
  // Another device has other limits than those that the guard was given.
  if (shared_->session->caps().model != caps_.model) shared_->session.reset();
}

}  // namespace palpate
