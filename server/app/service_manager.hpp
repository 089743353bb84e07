// What systemd hears of a server that it started with Type=notify (sd_notify(3)); nothing where it did not.
#pragma once

#include <optional>
#include <string>

#include "common/base/types.hpp"

namespace palpate {

class ServiceManager {
 public:
  ServiceManager();

  /// Whether it started this program.
  bool is_there() const { return is_there_; }
  /// Whether it wants to hear, within WatchdogSec, that all is well.
  bool watches() const { return watches_; }
  void ready(const std::string& status) const;
  void is_well() const;
  /// The end has begun, and may take `most`: longer than TimeoutStopSec is allowed when it is said.
  void stopping(const std::string& status, Micros most) const;

 private:
  bool is_there_ = false, watches_ = false;
};

}  // namespace palpate
