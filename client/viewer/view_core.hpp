// A viewer's side of a session without sockets, threads or clocks: it receives datagrams, ticks, emits datagrams and states its
// next deadline. ClientSession joins and keeps the session.
//
// While joined, a viewer requests mesh pieces, each again after kMeshRetry, until all have arrived and the hash is right; then
// shapes count. Where a blade cuts the body, it requests the pieces that change the mesh in the same way. It sends a Beat every
// kBeatEvery, and a ViewState, which reports what arrived, kStateEvery after an arrival.
#pragma once

#include <cstddef>
#include <deque>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/core/client_session.hpp"
#include "client/viewer/mesh_assembly.hpp"
#include "client/viewer/playback.hpp"
#include "client/viewer/shape_assembly.hpp"
#include "client/viewer/task_watch.hpp"

namespace palpate {

/// A note of this viewer that was recorded or refused.
struct NoteOutcome {
  Note note;
  std::string refusal;  ///< reason; empty: it was recorded
};

/// The contents of a picture.
struct ViewMoment {
  Shape shape;
  std::vector<ToolView> tools;
};

class ViewCore : public ClientSession {
 public:
  static constexpr Micros kBeatEvery{250'000};
  static constexpr Micros kSilentAfter{500'000};  ///< ten frames at 20 Hz: older reports are out of date
  static constexpr Micros kMeshRetry{150'000}, kStateEvery{50'000};
  static constexpr std::size_t kMeshWindow = 16;  ///< pieces requested at a time
  static constexpr std::size_t kNotesMost = 16;   ///< notes that wait at most
  static constexpr Micros kNoteEvery{150'000};    ///< interval at which a note is repeated

  /// `alike`: the server may assign a similar name when `station` is in use.
  ViewCore(std::string station, Micros now, std::string room = {}, bool alike = false);

  void take(std::span<const std::byte> bytes, Micros now);
  void tick(Micros now);
  /// Writes the next datagram for the server into `out`. Returns its size, 0 when there is none. Call until it returns 0.
  std::size_t emit(std::span<std::byte> out, Micros now);
  Micros deadline() const;
  /// Says goodbye: the next emit() returns a Leave.
  using ClientSession::leave;
  /// Requests this channel in addition to the positions; position: none.
  void show_channel(ShapeChannel channel);
  /// Limits the data rate of shapes [kbit/s], 0 = the server's default.
  void limit(std::uint16_t kbit_s) { kbit_s_ = kbit_s; }

  /// Sends a note to the server; its `number` is assigned. Only when joined; returns false when kNotesMost are waiting.
  bool write_note(Note note);
  /// Returns what became of notes since the last call, in order. The end of a session refuses those that waited.
  std::vector<NoteOutcome> take_note_outcomes() { return std::exchange(note_outcomes_, {}); }
  /// The server's rooms that this viewer may join; empty when there is one alone, or they are not known yet.
  const RoomList& rooms() const { return rooms_; }

  /// True when the mesh and at least one shape have arrived: there is something to draw.
  bool ready() const { return mesh_.complete() && !playback_.empty(); }
  const BodyMesh& mesh() const { return mesh_.mesh(); }
  /// The body at rest: displacement is measured from it.
  const std::vector<Eigen::Vector3f>& rest() const { return rest_; }
  /// Version of the mesh, which grows with every new topology: data derived from the mesh is invalid then.
  std::uint64_t mesh_version() const { return mesh_version_; }
  /// Returns the moment that is due at `now` in `moment`; false while there is none.
  bool show(Micros now, ViewMoment& moment) const { return ready() && playback_.at(now, moment.shape, moment.tools); }
  /// Age of the body's displayed state: computing, network and the smoothing of playback(). Only when ready.
  Micros lateness(Micros now) const;
  /// State of the room from the server's newest report; empty before the first.
  const RoomView& room() const { return room_; }
  /// The room's training task and its progress.
  const TaskWatch& task() const { return task_; }
  /// Number of the body's frames received in the last second.
  int shapes_lately(Micros now) const;
  /// True while the server is heard: its newest report is valid.
  bool heard_lately(Micros now) const { return joined() && silence(now) < kSilentAfter; }
  /// Duration of the server's silence.
  Micros silence(Micros now) const { return now - last_heard(); }

  const Playback& playback() const { return playback_; }
  using ClientSession::counts;
  const ShapeCounts& shape_counts() const { return shapes_.counts(); }

 private:
  void begin(bool anew, Micros now);
  template <class Part>
  void take_shape(const Part& part, Micros now);
  void take_mesh(const MeshPiece& piece, Micros now);
  void take_mesh_change();
  void note(std::uint32_t seq, Micros now);
  void ask_for_mesh(Micros now);
  std::size_t say_state(std::span<std::byte> out, Micros now);
  void hear_notes(std::uint32_t recorded, Micros now);
  void end_note(const std::string& refusal);

  std::uint64_t mesh_version_ = 0;
  Micros next_beat_{}, next_mesh_{};
  bool beat_due_ = false, state_due_ = false;
  std::deque<std::uint32_t> asking_;  ///< mesh pieces to request now
  std::size_t asked_ = 0;             ///< requested pieces of the last round that have not arrived
  MeshAssembly mesh_;
  ShapeAssembly shapes_;
  Playback playback_;
  std::deque<Micros> shapes_came_;  ///< arrival times in the last second
  std::vector<Shape> finished_;
  std::vector<Eigen::Vector3f> rest_;
  RoomView room_;
  TaskWatch task_;
  ViewState state_;         ///< for the datagrams of this session
  bool heard_any_ = false;  ///< true: `state_` is in use
  Micros next_state_ = Micros::max();
  ShapeChannel channel_ = ShapeChannel::position;
  std::uint16_t kbit_s_ = 0;
  RoomList rooms_;
  std::deque<Note> notes_;   ///< those that wait; the first is being sent
  std::uint32_t noted_ = 0;  ///< number of notes of this session that were recorded
  Micros note_since_{};      ///< first time at which the first was sent; 0: not yet
  Micros next_note_{};       ///< time at which it is sent again
  std::vector<NoteOutcome> note_outcomes_;
};

}  // namespace palpate
