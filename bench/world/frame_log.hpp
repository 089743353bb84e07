// Log of a world's frames, for its twin under attack. While the twin's body receives exactly the same jobs in the same order, it
// would compute the same results, so these are copied from the log. From the first different frame on, the twin's body steps
// itself, from the state it would have.
#pragma once

#include <functional>
#include <vector>

#include "server/room/room.hpp"

namespace palpate {

using FrameRunner = std::function<FrameResult(Room&, const FrameJob&)>;

class FrameLog {
 public:
  /// Returns a runner for the world whose frames are logged. Runners refer to the log.
  FrameRunner recorder();
  /// Returns a runner for a twin with the same body, from its beginning on.
  FrameRunner player();
  std::size_t frames() const { return frames_.size(); }
  std::size_t taken() const { return taken_; }  ///< frames copied by the last player

 private:
  struct Frame {
    std::uint64_t hash = 0;  ///< hash of the job
    FrameJob job;
    FrameResult result;
  };
  std::vector<Frame> frames_;
  std::size_t taken_ = 0;
  bool apart_ = false;
};

/// Hash of everything in a job.
std::uint64_t hash_of(const FrameJob& job);

}  // namespace palpate
