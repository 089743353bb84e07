// A viewer's recording and its file, from one press of R to the next, or from --record on.
#pragma once

#include <optional>
#include <string>

#include "client/viewer/view_recorder.hpp"
#include "common/io/record_file.hpp"

namespace palpate {

class ViewerRecording {
 public:
  /// `core` is ready(). Throws InputError when the file exists already or cannot be written.
  ViewerRecording(const ViewCore& core, const std::string& file);
  /// Completes the recording.
  ~ViewerRecording();

  /// Records what arrived. Returns the reason when the recording has failed, once.
  std::optional<std::string> pump(const ViewCore& core, Micros now);
  const std::string& file() const { return name_; }

 private:
  static constexpr Micros kWriteEvery{200'000};

  std::string name_;
  ViewRecorder recorder_;
  RecordFile file_;
  Micros next_write_{};
};

/// Returns a default file name: the room's name and the time of day, in the current folder.
std::string file_for_now(const std::string& room);

}  // namespace palpate
