// Which colour each station has: the same as long as it is there, whoever else comes and goes.
#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/view/color.hpp"
#include "common/wire/messages.hpp"

namespace palpate {

class Hues {
 public:
  static constexpr std::size_t kHues = kStationColors;

  Hues() = default;
  /// These are known beforehand.
  explicit Hues(std::vector<std::string> stations) : stations_(std::move(stations)) {}
  /// A station that is new takes the next colour, or when all are given that of one without a tool.
  void see(std::span<const ToolView> tools);
  /// In the order of their colours; also of some that are gone.
  const std::vector<std::string>& stations() const { return stations_; }

 private:
  std::vector<std::string> stations_;
};

/// The place of each tool's station among `stations`.
std::vector<std::size_t> hues_of(std::span<const ToolView> tools, std::span<const std::string> stations);

}  // namespace palpate
