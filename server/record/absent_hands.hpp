// Tools that stay on a body that was taken up again (resume.hpp), for stations that are not back yet.
//
// A server that was killed with hands on its body has none of them when it is there again: without their tools the body would
// spring back before they come. So each tool rests where it was until its station, known by its name, has samples in a frame;
// from that frame on the hand has the body itself. Who is not back kLongest after the first frame has let go, and so has
// everybody when the body is put back to rest.
//
// They are stations of the body's frames alone, with numbers that no station gets: nobody feels them, no datagram knows them.
#pragma once

#include <vector>

#include "server/core/server_core.hpp"

namespace palpate {

class AbsentHands {
 public:
  static constexpr Micros kLongest{10'000'000};

  AbsentHands() = default;
  explicit AbsentHands(std::vector<RecordedHold> holds);

  /// Before the room gets it: those who are still away.
  void add_to(FrameJob& job, const std::vector<StationReport>& here);
  /// Before anybody else gets it.
  void take_out(FrameResult& result) const;
  /// Of those who are away.
  std::vector<RecordedHold> holds() const;

 private:
  struct Hand {
    StationId id = 0;
    RecordedHold hold;
  };
  std::vector<Hand> hands_;
  std::optional<Micros> until_;
};

}  // namespace palpate
