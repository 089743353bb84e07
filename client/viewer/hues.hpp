// Assigns a colour to each station: it stays the same while the station is there, whoever else comes and goes.
#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/viewer/color.hpp"
#include "common/wire/messages.hpp"

namespace palpate {

class Hues {
 public:
  static constexpr std::size_t kHues = kStationColors;

  Hues() = default;
  /// Starts with stations that are known beforehand.
  explicit Hues(std::vector<std::string> stations) : stations_(std::move(stations)) {}
  /// Assigns the next colour to each new station, or when all are in use that of a station without a tool.
  void see(std::span<const ToolView> tools);
  /// Stations in the order of their colours; includes some that are gone.
  const std::vector<std::string>& stations() const { return stations_; }

 private:
  std::vector<std::string> stations_;
};

/// Returns the index of each tool's station in `stations`.
std::vector<std::size_t> hues_of(std::span<const ToolView> tools, std::span<const std::string> stations);

}  // namespace palpate
