#include "server/record/reserved_tools.hpp"

#include <algorithm>
#include <limits>

namespace palpate {
namespace {

constexpr StationId kLastId = std::numeric_limits<StationId>::max();

}  // namespace

ReservedTools::ReservedTools(std::vector<RecordedHold> holds, const Scene& scene) {
  for (RecordedHold& hold : holds)
    if (const auto held = scene.tool_named(hold.held))
      hands_.push_back({kLastId - static_cast<StationId>(hands_.size()), std::move(hold), *held});
}

void ReservedTools::add_to(FrameJob& job, const std::vector<StationReport>& here) {
  if (hands_.empty()) return;
  if (!until_) until_ = job.begin + kLongest;
  if (job.reset || job.target >= *until_) hands_.clear();
  for (const StationReport& station : here)
    for (StationJob& moves : job.stations)
      if (moves.id == station.id && moves.shadow_of == 0)
        std::erase_if(hands_, [&](const Hand& hand) {
          const bool is_back = hand.hold.station == station.name;
          if (is_back) moves.needle = hand.hold.needle;
          return is_back;
        });
  for (const Hand& hand : hands_) {
    StationJob rests;
    rests.id = hand.id;
    rests.scheme = Scheme::hold;
    const RecordedHold& hold = hand.hold;
    rests.samples = {{job.begin, hold.tool, hold.orientation, hold.opening},
                     {job.target, hold.tool, hold.orientation, hold.opening}};
    rests.needle = hold.needle;
    rests.held = hand.held;
    rests.wants_patch = false;
    job.stations.push_back(std::move(rests));
  }
}

void ReservedTools::take_out(FrameResult& result) const {
  std::erase_if(result.stations, [this](const StationFrame& frame) {
    return std::any_of(hands_.begin(), hands_.end(), [&](const Hand& hand) { return hand.id == frame.id; });
  });
}

std::vector<RecordedHold> ReservedTools::holds() const {
  std::vector<RecordedHold> holds;
  for (const Hand& hand : hands_) holds.push_back(hand.hold);
  return holds;
}

}  // namespace palpate
