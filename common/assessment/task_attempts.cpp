#include "common/assessment/task_attempts.hpp"

#include <map>
#include <utility>

#include "common/base/sort_stably.hpp"

namespace palpate {
namespace {

class Judge {
 public:
  explicit Judge(const RecordingReader& recording) : recording_(recording), task_(*recording.head().task) {}

  void add(const RecordedBlock& block) {
    std::size_t button = 0, event = 0;
    for (const RecordedTouch& touch : block.touches) {
      for (; event < block.events.size() && block.events[event].t <= touch.t; ++event) add(block.events[event]);
      for (; button < block.buttons.size() && block.buttons[button].t <= touch.t; ++button) add(block.buttons[button]);
      add(touch);
    }
    for (; event < block.events.size(); ++event) add(block.events[event]);
    for (; button < block.buttons.size(); ++button) add(block.buttons[button]);
  }

  std::vector<TaskAttempt> finish() {
    for (auto& [name, hand] : hands_) end_attempt(name, hand);
    sort_stably(done_.begin(), done_.end(), [](const auto& a, const auto& b) { return a.station < b.station; });
    return std::move(done_);
  }

 private:
  struct Hand {
    explicit Hand(const Task& task) : scorer(task) {}
    TaskScorer scorer;
    int attempts = 0;
    double begin_s = 0;
    std::uint32_t down = 0, pressed = 0;  ///< buttons now, and at any time since the last frame
  };

  double t_s(Micros t) const { return seconds(t - recording_.begin()); }
  Hand& hand_of(StationId id) { return hands_.try_emplace(recording_.name_of(id), task_).first->second; }

  void add(const RecordedEvent& event) {
    if (event.kind != RecordedEventKind::reset) return;
    for (auto& [name, hand] : hands_) end_attempt(name, hand);
  }
  void add(const RecordedButtons& buttons) {
    Hand& hand = hand_of(buttons.station);
    hand.down = buttons.pressed;
    hand.pressed |= buttons.pressed;
  }
  void add(const RecordedTouch& touch) {
    Hand& hand = hand_of(touch.station);
    const bool begun = hand.scorer.begun();
    hand.scorer.add({t_s(touch.t), touch.tool, touch.force, touch.contact, std::exchange(hand.pressed, hand.down)});
    if (!begun && hand.scorer.begun()) hand.begin_s = t_s(touch.t);
  }
  void end_attempt(const std::string& name, Hand& hand) {
    if (hand.scorer.begun()) done_.push_back({name, ++hand.attempts, hand.begin_s, hand.scorer.progress()});
    hand.scorer = TaskScorer(task_);
  }

  const RecordingReader& recording_;
  const Task& task_;
  std::map<std::string, Hand> hands_;
  std::vector<TaskAttempt> done_;
};

}  // namespace

std::vector<TaskAttempt> task_attempts(const RecordingReader& recording) {
  if (!recording.head().task) return {};
  Judge judge(recording);
  for (std::size_t k = 0; k < recording.blocks().size(); ++k)
    if (const auto block = recording.read(k)) judge.add(*block);
  return judge.finish();
}

}  // namespace palpate
