#include "client/viewer/hues.hpp"

#include <algorithm>

namespace palpate {

void Hues::see(std::span<const ToolView> tools) {
  for (const ToolView& tool : tools) {
    if (std::find(stations_.begin(), stations_.end(), tool.station) != stations_.end()) continue;
    const auto gone = std::find_if(stations_.begin(), stations_.end(), [&](const std::string& station) {
      return std::none_of(tools.begin(), tools.end(), [&](const ToolView& other) { return other.station == station; });
    });
    if (stations_.size() < kHues || gone == stations_.end())
      stations_.push_back(tool.station);
    else
      *gone = tool.station;
  }
}

std::vector<std::size_t> hues_of(std::span<const ToolView> tools, std::span<const std::string> stations) {
  std::vector<std::size_t> hues;
  for (const ToolView& tool : tools) {
    const auto place = std::find(stations.begin(), stations.end(), tool.station);
    hues.push_back(static_cast<std::size_t>(place - stations.begin()));
  }
  return hues;
}

}  // namespace palpate
