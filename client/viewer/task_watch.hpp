// Follows a training task at a viewer: the room's task, and the progress of every hand by the one rule (common/task/score.hpp),
// from the tools of the frames that arrived. A reset of the body begins a new attempt of all hands.
//
// A frame that is lost on the way is missing here and not in the server's recording, so that a score may differ in its last
// digits.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/task/score.hpp"
#include "common/wire/messages.hpp"

namespace palpate {

class TaskWatch {
 public:
  /// Accepts the task as the server repeats it; another one begins anew.
  void take(const Task& task);
  /// Accepts the tools of a frame; older ones than the last are ignored.
  void take(const Tools& tools);
  /// Accepts the server's count of resets.
  void take_resets(std::uint16_t resets);
  /// Forgets the task.
  void clear();

  /// Null: the room has none, or it is not known yet.
  const Task* task() const { return task_.get(); }
  struct Hand {
    std::string station;
    TaskProgress progress;
    double force_n = 0;  ///< now
  };
  /// Hands that have touched the body in this attempt, and those in the room, by name.
  std::vector<Hand> hands() const;
  /// True once a hand has marked the lump: from then on its place is shown.
  bool marked() const;

 private:
  struct Attempt {
    TaskScorer scorer;
    double force_n = 0;
  };
  std::shared_ptr<const Task> task_;  ///< stays in place for the scorers, of copies too
  std::map<std::string, Attempt> attempts_;
  std::optional<std::uint16_t> resets_;
};

}  // namespace palpate
