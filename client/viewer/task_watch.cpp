#include "client/viewer/task_watch.hpp"

#include <algorithm>

namespace palpate {

void TaskWatch::take(const Task& task) {
  if (task_ && *task_ == task) return;
  attempts_.clear();
  task_ = std::make_shared<const Task>(task);
}

void TaskWatch::take(const Tools& tools) {
  if (!task_) return;
  for (const ToolView& tool : tools.tools) {
    Attempt& attempt = attempts_.try_emplace(tool.station, Attempt{TaskScorer(*task_)}).first->second;
    attempt.scorer.add({seconds(tools.body_time), tool.position, tool.force, tool.contact, tool.buttons});
    attempt.force_n = tool.force.norm();
  }
  std::erase_if(attempts_, [&](const auto& entry) {
    const auto present = [&](const ToolView& tool) { return tool.station == entry.first; };
    return !entry.second.scorer.begun() && std::none_of(tools.tools.begin(), tools.tools.end(), present);
  });
  while (attempts_.size() > kMaxStations) attempts_.erase(attempts_.begin());
}

void TaskWatch::take_resets(std::uint16_t resets) {
  if (resets_ && *resets_ != resets) attempts_.clear();
  resets_ = resets;
}

void TaskWatch::clear() {
  attempts_.clear();
  task_.reset();
  resets_.reset();
}

std::vector<TaskWatch::Hand> TaskWatch::hands() const {
  std::vector<Hand> hands;
  for (const auto& [station, attempt] : attempts_) hands.push_back({station, attempt.scorer.progress(), attempt.force_n});
  return hands;
}

bool TaskWatch::marked() const {
  return std::any_of(attempts_.begin(), attempts_.end(),
                     [](const auto& entry) { return entry.second.scorer.progress().mark.has_value(); });
}

}  // namespace palpate
