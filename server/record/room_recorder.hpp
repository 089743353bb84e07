// Records a room from its ServerCore and its body's frames. No file, thread or clock: the bytes are obtained with take().
#pragma once

#include <map>

#include "common/record/writer.hpp"
#include "server/core/server_core.hpp"
#include "server/core/surface_mesh.hpp"

namespace palpate {

class RoomRecorder {
 public:
  static constexpr Micros kLinksEvery{250'000}, kCheckpointEvery{1'000'000};  ///< kCheckpointEvery is the shortest interval
  static constexpr double kCheckpointBytesPerS = 96'000;  ///< larger interval for bodies of more than 4,000 vertices

  explicit RoomRecorder(const RecordingHead& head);

  /// Call when a frame is handed out; requests the body's shape if one is due.
  void begin_frame(FrameJob& job, Micros now);
  /// Call when the frame is done, before the core gets it. `absent`: tools on the body whose stations are not present
  /// (reserved_tools.hpp).
  void end_frame(const FrameResult& result, const ServerCore& core, Micros now, const std::vector<RecordedHold>& absent = {});
  void event(const RecordedEvent& event) { writer_.add(event); }
  void note(const RecordedNote& note) { writer_.add(note); }
  void buttons(StationId id, const ButtonChange& change) { writer_.add(RecordedButtons{change.t, id, change.pressed}); }
  /// Records links, the room's pace, and blocks that are due; call several times a second.
  void tick(const ServerCore& core, Micros now);
  void finish() { writer_.finish(); }
  std::vector<std::byte> take() { return writer_.take(); }

 private:
  RecordedTouch touch_of(const StationFrame& frame, Micros stamp) const;
  void add_links(const std::vector<StationReport>& stations, Micros now);
  void expect_checkpoints_of(double bytes);
  void add_checkpoint(const FrameResult& result, const ServerCore& core, std::vector<RecordedHold> holds);

  RecordingWriter writer_;
  Micros shape_every_{}, next_shape_{}, began_{}, next_links_{}, checkpoint_every_{}, next_checkpoint_{};
  SurfaceMesh surface_;
  std::shared_ptr<const BodySurface> surface_taken_;
  Vector checkpoint_;  ///< x of the last checkpoint
  std::shared_ptr<const StressHistory> checkpoint_history_;
  std::shared_ptr<const SutureState> checkpoint_threads_;
  bool wants_shape_ = false, slow_ = false;
  std::map<StationId, Micros> newest_;    ///< newest recorded sample
  std::map<StationId, StationJob> jobs_;  ///< jobs of the frame that is out, without samples
  std::uint64_t skipped_before_ = 0;
};

/// Describes a room's body for the head of the recording.
RecordedSurface recorded_surface(const Scene& scene);

}  // namespace palpate
