// The training task of a recorded room, and how every hand did: the samples of the recording, judged by common/task/score.hpp.
#pragma once

#include <string>
#include <vector>

#include "common/record/reader.hpp"
#include "common/task/score.hpp"

namespace palpate {

/// A hand from its first contact to the next reset of the body, or to the end.
struct TaskAttempt {
  std::string station;
  int number = 1;      ///< of this hand, from 1 on
  double begin_s = 0;  ///< first contact, since the recording's begin()
  TaskProgress progress;
};

/// Returns the attempts by station, then in order; none for a recording without a task. A hand that rejoined under its name
/// continues its attempt.
std::vector<TaskAttempt> task_attempts(const RecordingReader& recording);

}  // namespace palpate
