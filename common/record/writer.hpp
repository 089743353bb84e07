// Writes a recording: accepts events, returns the bytes of the file, in order.
//
// Added data gathers in a block of at most kBlock; then the block is closed and its bytes can be taken. The caller calls tick() a
// few times a second and writes the result of take(): a program that dies loses what was not taken yet. No file, thread or clock
// here.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "common/record/recording.hpp"

namespace palpate {

class RecordingWriter {
 public:
  static constexpr Micros kBlock{400'000};
  static constexpr Micros kMeshEvery{10'000'000};
  static constexpr std::size_t kBlockBytes = 1u << 20;  ///< a block of about this size is closed early

  /// Produces the bytes of the head at once.
  explicit RecordingWriter(const RecordingHead& head);
  ~RecordingWriter();

  void add(const RecordedPath& path);
  void add(const RecordedFrame& frame);
  void add(const RecordedTouch& touch);
  /// Adds a shape. `positions` are of all vertices of the body; the recorded ones among them are kept.
  void add_shape(Micros t, const std::vector<Vec3>& positions);
  /// Adds a change of the surface, which shapes have from then on. `mesh` has the recorded vertices and more at the end;
  /// `vertex_of`: of the body, at each of them. It is stated again as a whole every kMeshEvery, so that a damaged block costs no
  /// more.
  void add_mesh(Micros t, const BodyMesh& mesh, const std::vector<std::uint32_t>& vertex_of);
  void add(const RecordedEvent& event);
  void add(const RecordedNote& note);
  void add(const RecordedLink& link);
  void add(const RecordedTick& tick);
  void add(const RecordedHandOver& hand_over);
  void add(const RecordedPacket& packet);
  // Each block begins with the newest of these of every station that has not left, so that it can be read by itself.
  void add(const RecordedTurn& turn);
  void add(const RecordedButtons& buttons);
  void add(const RecordedGuidance& guidance);

  /// Adds a checkpoint; one with a number that cannot be encoded is skipped: there is an earlier one.
  void add(const RecordedCheckpoint& checkpoint);

  /// Closes the block when it is due; `now` in any clock that advances.
  void tick(Micros now);
  /// Closes the last block and appends index and trailer. Nothing is added afterwards.
  void finish();
  /// Returns the bytes of the file that were not returned yet.
  std::vector<std::byte> take();
  /// Size of the file so far, taken or not.
  std::size_t bytes() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Selects the vertices of a body to record, from its rest positions and triangles; all count as nodes, and no mark is set.
RecordedSurface recorded_surface(const std::vector<Vec3>& rest, const std::vector<Triangle>& triangles, std::uint64_t mesh_hash);

}  // namespace palpate
