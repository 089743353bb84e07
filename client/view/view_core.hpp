// A viewer's side of a session without sockets, threads or clocks: it receives datagrams, ticks, emits datagrams and states its
// next deadline.
//
// Life of a viewer: joining (Hello every 250 ms until Welcome) -> joined (requests mesh pieces, each again after 150 ms, until
// all have arrived and the hash is right; then shapes count; a Beat every 250 ms; a ViewState, which reports what arrived, 50 ms
// after an arrival) -> joining again when the server does not know the viewer or has been silent for kLostAfter. A viewer refused
// for another reason reports it and retries once a second.
#pragma once

#include <array>
#include <cstddef>
#include <deque>
#include <span>
#include <string>

#include "client/core/sent_stamps.hpp"
#include "client/view/mesh_assembly.hpp"
#include "client/view/playback.hpp"
#include "client/view/shape_assembly.hpp"
#include "common/session/clock_sync.hpp"
#include "common/session/reset_request.hpp"
#include "common/wire/codec.hpp"
#include "common/wire/messages.hpp"

namespace palpate {

enum class ViewLink : std::uint8_t { joining, joined, refused };

struct ViewCounts {
  std::uint64_t sent = 0, received = 0, bytes_received = 0, joins = 0, stale = 0;
  std::uint64_t unproven = 0;  ///< in the server's name, but without an echo of our own stamps (client_core.hpp)
  std::array<std::uint64_t, kWireFaults> dropped{};
};

/// The contents of a picture.
struct ViewMoment {
  Shape shape;
  std::vector<ToolView> tools;
};

class ViewCore {
 public:
  static constexpr Micros kHelloEvery{250'000}, kRetryEvery{1'000'000}, kBeatEvery{250'000}, kLostAfter{2'000'000};
  static constexpr Micros kSilentAfter{500'000};  ///< ten frames at 20 Hz: older reports are out of date
  static constexpr Micros kMeshRetry{150'000}, kStateEvery{50'000};
  static constexpr std::size_t kMeshWindow = 16;  ///< pieces requested at a time

  /// `alike`: the server may assign a similar name when `station` is in use.
  ViewCore(std::string station, Micros now, std::string room = {}, bool alike = false);

  void take(std::span<const std::byte> bytes, Micros now);
  void tick(Micros now);
  /// Writes the next datagram for the server into `out`. Returns its size, 0 when there is none. Call until it returns 0.
  std::size_t emit(std::span<std::byte> out, Micros now);
  Micros deadline() const;
  /// Says goodbye: the next emit() returns a Leave.
  void leave();
  /// Requests a reset of the body to rest, sent as soon as the server is there.
  void ask_reset() { reset_.ask(); }
  bool reset_pending() const { return reset_.pending(); }
  /// Requests this channel in addition to the positions; position: none.
  void show_channel(ShapeChannel channel);
  /// Limits the data rate of shapes [kbit/s], 0 = the server's default.
  void limit(std::uint16_t kbit_s) { kbit_s_ = kbit_s; }

  ViewLink link() const { return link_; }
  const std::string& refusal() const { return refusal_; }
  const Welcome& welcome() const { return welcome_; }  ///< valid after the first join

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
  /// Number of the body's frames received in the last second.
  int shapes_lately(Micros now) const;
  /// True while the server is heard: its newest report is valid.
  bool heard_lately(Micros now) const { return link_ == ViewLink::joined && now - heard_ < kSilentAfter; }
  /// Time of the newest datagram that answered one of ours, refusals included; the start of the session before the first.
  Micros last_answer() const { return answered_; }
  /// True when that datagram said that the server is shutting down.
  bool sent_away() const { return sent_away_; }
  /// Duration of the server's silence.
  Micros silence(Micros now) const { return now - heard_; }

  const Playback& playback() const { return playback_; }
  const ClockSync& clock() const { return clock_; }
  const ViewCounts& counts() const { return counts_; }
  const ShapeCounts& shape_counts() const { return shapes_.counts(); }

 private:
  void take_welcome(const Message& message, Micros now);
  void take_refuse(const Message& message, Micros now);
  template <class Part>
  void take_shape(const Part& part, Micros now);
  void take_mesh(const MeshPiece& piece, Micros now);
  void note(std::uint32_t seq, Micros now);
  void join_again(Micros now);
  void ask_for_mesh(Micros now);
  std::size_t say_state(std::span<std::byte> out, Micros now);
  std::size_t say(Payload body, std::span<std::byte> out, Micros now);

  Hello hello_;
  ViewLink link_ = ViewLink::joining;
  std::string refusal_;
  Welcome welcome_;
  SentStamps sent_;
  std::uint64_t instance_ = 0, mesh_version_ = 0;
  StationId station_ = 0;
  std::uint32_t seq_out_ = 0;
  Micros heard_, answered_, next_hello_, next_beat_, next_mesh_;
  bool hello_due_ = false, beat_due_ = false, state_due_ = false, leave_due_ = false, left_ = false, sent_away_ = false;
  std::deque<std::uint32_t> asking_;  ///< mesh pieces to request now
  std::size_t asked_ = 0;             ///< requested pieces of the last round that have not arrived
  ClockSync clock_;
  ResetRequest reset_;
  MeshAssembly mesh_;
  ShapeAssembly shapes_;
  Playback playback_;
  std::deque<Micros> shapes_came_;  ///< arrival times in the last second
  std::vector<Shape> finished_;
  std::vector<Eigen::Vector3f> rest_;
  RoomView room_;
  ViewState state_;         ///< for the datagrams of this session
  bool heard_any_ = false;  ///< true: `state_` is in use
  Micros next_state_ = Micros::max();
  ShapeChannel channel_ = ShapeChannel::position;
  std::uint16_t kbit_s_ = 0;
  ViewCounts counts_;
};

}  // namespace palpate
