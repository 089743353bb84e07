#include "server/app/service_manager.hpp"

#include <spdlog/fmt/fmt.h>
#include <systemd/sd-daemon.h>

#include <cstdlib>

namespace palpate {
namespace {

constexpr Micros kToEnd{10'000'000};  // time for a running frame and for closing recordings, after all stations have left

}  // namespace

ServiceManager::ServiceManager()
    : is_there_(std::getenv("NOTIFY_SOCKET") != nullptr), watches_(::sd_watchdog_enabled(0, nullptr) > 0) {}

void ServiceManager::ready(const std::string& status) const { ::sd_notify(0, ("READY=1\nSTATUS=" + status).c_str()); }

void ServiceManager::is_well() const { ::sd_notify(0, "WATCHDOG=1"); }

void ServiceManager::stopping(const std::string& status, Micros most) const {
  ::sd_notify(0, fmt::format("STOPPING=1\nSTATUS={}\nEXTEND_TIMEOUT_USEC={}", status, (most + kToEnd).count()).c_str());
}

}  // namespace palpate
