// Notifies systemd about a server started with Type=notify (sd_notify(3)); without systemd it does nothing.
#pragma once

#include <optional>
#include <string>

#include "common/base/types.hpp"

namespace palpate {

class ServiceManager {
 public:
  ServiceManager();

  /// Returns true if systemd started this program with Type=notify.
  bool is_there() const { return is_there_; }
  /// Returns true if systemd expects a sign of life within WatchdogSec.
  bool watches() const { return watches_; }
  void ready(const std::string& status) const;
  void is_well() const;
  /// Announces a shutdown that may last up to `most`; the announcement extends TimeoutStopSec.
  void stopping(const std::string& status, Micros most) const;

 private:
  bool is_there_ = false, watches_ = false;
};

}  // namespace palpate
