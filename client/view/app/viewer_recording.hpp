// A viewer's recording and its file, from a press of R to the next one, or from --record on.
#pragma once

#include <optional>
#include <string>

#include "client/view/view_recorder.hpp"
#include "common/io/record_file.hpp"

namespace palpate {

class ViewerRecording {
 public:
  /// `core` is ready(). Throws InputError when the file is there already or cannot be written.
  ViewerRecording(const ViewCore& core, const std::string& file);
  /// Ends the recording well.
  ~ViewerRecording();

  /// Takes what came. Why nothing is recorded any more, once it is so.
  std::optional<std::string> pump(const ViewCore& core, Micros now);
  const std::string& file() const { return name_; }

 private:
  static constexpr Micros kWriteEvery{200'000};

  std::string name_;
  ViewRecorder recorder_;
  RecordFile file_;
  Micros next_write_{};
};

/// For a recording that nobody named: the room's name and the time of day, in the current folder.
std::string file_for_now(const std::string& room);

}  // namespace palpate
