// The frames of a world, for its twin in which somebody attacks: while the twin asks its body for the same, to the bit and in the
// same order, the same would come out, and is taken from here. From the first frame that is another one on the twin's body steps
// itself, from where it would be.
#pragma once

#include <functional>
#include <vector>

#include "server/room/room.hpp"

namespace palpate {

using FrameRunner = std::function<FrameResult(Room&, const FrameJob&)>;

class FrameLog {
 public:
  /// Of the world whose frames are kept. Runners refer to the log.
  FrameRunner recorder();
  /// Of a twin from its beginning on, whose body is the same.
  FrameRunner player();
  std::size_t frames() const { return frames_.size(); }
  std::size_t taken() const { return taken_; }  ///< by the last player

 private:
  struct Frame {
    std::uint64_t hash = 0;  ///< of the job
    FrameJob job;
    FrameResult result;
  };
  std::vector<Frame> frames_;
  std::size_t taken_ = 0;
  bool apart_ = false;
};

/// Of all that a room is asked for.
std::uint64_t hash_of(const FrameJob& job);

}  // namespace palpate
