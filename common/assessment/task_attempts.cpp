#include "common/assessment/task_attempts.hpp"

#include <deque>
#include <map>
#include <utility>

#include "common/base/sort_stably.hpp"

namespace palpate {
namespace {

class Judge {
 public:
  explicit Judge(const RecordingReader& recording) : recording_(recording), task_(*recording.head().task) {}

  /// A frame is written when it ends: an event before its stamp may be in an earlier block, and one after it too.
  void add(const RecordedBlock& block) {
    events_.insert(events_.end(), block.events.begin(), block.events.end());
    buttons_.insert(buttons_.end(), block.buttons.begin(), block.buttons.end());
    for (const RecordedTouch& touch : block.touches) {
      take_until(touch.t);
      add(touch);
    }
  }

  std::vector<TaskAttempt> finish() {
    take_until(Micros::max());
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

  void take_until(Micros t) {
    for (; !events_.empty() && events_.front().t <= t; events_.pop_front()) add(events_.front());
    for (; !buttons_.empty() && buttons_.front().t <= t; buttons_.pop_front()) add(buttons_.front());
  }
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
  std::deque<RecordedEvent> events_;  ///< after the last frame so far
  std::deque<RecordedButtons> buttons_;
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
