// Tools that stay on a resumed body (resume.hpp) for stations that are not back yet.
//
// After a crash with hands on the body, the restarted server has no stations, and without their tools the body would spring back
// before they rejoin. So each tool rests where it was until its station, identified by its name, has samples in a frame; from
// that frame on the real hand holds the body. A tool whose station is not back kLongest after the first frame is released; a
// reset of the body to rest releases all.
//
// They exist as stations in the body's frames only, with numbers that no station gets: they receive no patches, and no datagram
// refers to them.
#pragma once

#include <vector>

#include "server/core/server_core.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

class ReservedTools {
 public:
  static constexpr Micros kLongest{10'000'000};

  ReservedTools() = default;
  /// A tool that the scene has no longer is left out.
  ReservedTools(std::vector<RecordedHold> holds, const Scene& scene);

  /// Adds the tools of absent stations to a job, before the room gets it.
  void add_to(FrameJob& job, const std::vector<StationReport>& here);
  /// Removes their results, before anything else uses them.
  void take_out(FrameResult& result) const;
  /// Holds of the tools whose stations are absent.
  std::vector<RecordedHold> holds() const;

 private:
  struct Hand {
    StationId id = 0;
    RecordedHold hold;
    std::uint8_t held = 0;  ///< number of its tool in the scene
  };
  std::vector<Hand> hands_;
  std::optional<Micros> until_;
};

}  // namespace palpate
