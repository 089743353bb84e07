// What a room's recording gets from its ServerCore and its body's frames. No file, thread or clock: bytes come out of take().
#pragma once

#include <map>

#include "common/record/writer.hpp"
#include "server/core/server_core.hpp"

namespace palpate {

class RoomRecorder {
 public:
  static constexpr Micros kLinksEvery{250'000}, kCheckpointEvery{1'000'000};  ///< checkpoints: at most
  static constexpr double kCheckpointBytesPerS = 96'000;  ///< those of a body of more than 4,000 vertices come less often

  explicit RoomRecorder(const RecordingHead& head);

  /// A frame is handed out. Asks for the body's shape when one is due.
  void begin_frame(FrameJob& job, Micros now);
  /// It is done; the core has not taken it yet. `absent`: tools on the body whose stations are not here (absent_hands.hpp).
  void end_frame(const FrameResult& result, const ServerCore& core, Micros now, const std::vector<RecordedHold>& absent = {});
  void event(const RecordedEvent& event) { writer_.add(event); }
  void buttons(StationId id, const ButtonChange& change) { writer_.add(RecordedButtons{change.t, id, change.pressed}); }
  /// Several times a second: links, the room's pace, blocks that are due.
  void tick(const ServerCore& core, Micros now);
  void finish() { writer_.finish(); }
  std::vector<std::byte> take() { return writer_.take(); }

 private:
  RecordedTouch touch_of(const StationFrame& frame, Micros stamp) const;
  void expect_checkpoints_of(double bytes);
  void add_checkpoint(const FrameResult& result, const ServerCore& core, std::vector<RecordedHold> holds);

  RecordingWriter writer_;
  Micros shape_every_{}, next_shape_{}, began_{}, next_links_{}, checkpoint_every_{}, next_checkpoint_{};
  Vector checkpoint_;  ///< x of the last one
  std::shared_ptr<const StressHistory> checkpoint_history_;
  bool wants_shape_ = false, slow_ = false;
  std::map<StationId, Micros> newest_;    ///< sample recorded
  std::map<StationId, StationJob> jobs_;  ///< of the frame that is out, without samples
  std::uint64_t skipped_before_ = 0;
};

/// What the head says of a room's body.
RecordedSurface recorded_surface(const Scene& scene);

}  // namespace palpate
