// Makes a recording: takes what happened, gives the bytes of the file, in order.
//
// What is added gathers in a block of at most kBlock; then the block is closed and its bytes can be taken. Whoever drives the
// writer calls tick() a few times a second and writes what take() gives: a program that dies loses what was not taken yet. No
// file, thread or clock in here.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "common/record/recording.hpp"

namespace palpate {

class RecordingWriter {
 public:
  static constexpr Micros kBlock{400'000};
  static constexpr std::size_t kBlockBytes = 1u << 20;  ///< a block that has gathered about so much is closed early

  /// The head's bytes can be taken at once.
  explicit RecordingWriter(const RecordingHead& head);
  ~RecordingWriter();

  void add(const RecordedPath& path);
  void add(const RecordedFrame& frame);
  void add(const RecordedTouch& touch);
  /// `positions` are of all vertices of the body; the recorded ones among them are kept.
  void add_shape(Micros t, const std::vector<Vec3>& positions);
  void add(const RecordedEvent& event);
  void add(const RecordedLink& link);
  void add(const RecordedTick& tick);
  void add(const RecordedHandOver& hand_over);
  void add(const RecordedPacket& packet);
  // Each block begins with what was last added of every station that has not left, so that it can be read by itself.
  void add(const RecordedTurn& turn);
  void add(const RecordedButtons& buttons);

  /// One that holds a number that cannot be carried is left out: there is one before it.
  void add(const RecordedCheckpoint& checkpoint);

  /// Closes the block when it is due; `now` in any clock that goes forward.
  void tick(Micros now);
  /// Closes the last block and appends index and trailer. Nothing is added afterwards.
  void finish();
  /// Bytes of the file that were not taken yet.
  std::vector<std::byte> take();
  /// Of the file so far, taken or not.
  std::size_t bytes() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Which vertices of a body are worth recording, from its rest positions and triangles.
RecordedSurface recorded_surface(const std::vector<Vec3>& rest, const std::vector<Triangle>& triangles, std::uint64_t mesh_hash);

}  // namespace palpate
