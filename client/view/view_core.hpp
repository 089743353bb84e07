// A viewer's side of a session without sockets, threads or clocks: take a datagram, tick, emit datagrams, say the deadline.
//
// Life of a viewer: joining (Hello every 250 ms until Welcome) -> joined (mesh pieces asked for, each again after 150 ms, until
// all are in and the hash is right; then shapes count; a Beat every 250 ms; a ViewState, which says what came, 50 ms after
// something did) -> joining again when the server does not know us or was not
// heard for kLostAfter. Refused for another reason: it says so and keeps asking, once a second.
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
  std::uint64_t unproven = 0;  ///< in the server's name, but without an echo of ours (client_core.hpp)
  std::array<std::uint64_t, kWireFaults> dropped{};
};

/// What a picture shows.
struct ViewMoment {
  Shape shape;
  std::vector<ToolView> tools;
};

class ViewCore {
 public:
  static constexpr Micros kHelloEvery{250'000}, kRetryEvery{1'000'000}, kBeatEvery{250'000}, kLostAfter{2'000'000};
  static constexpr Micros kSilentAfter{500'000};  ///< ten frames at 20 Hz: what was said last need not hold any more
  static constexpr Micros kMeshRetry{150'000}, kStateEvery{50'000};
  static constexpr std::size_t kMeshWindow = 16;  ///< pieces asked for at a time

  /// `alike`: another name like `station` will do where that is taken.
  ViewCore(std::string station, Micros now, std::string room = {}, bool alike = false);

  void take(std::span<const std::byte> bytes, Micros now);
  void tick(Micros now);
  /// Bytes of the next datagram for the server written into `out`, 0 when there is none. Call until 0.
  std::size_t emit(std::span<std::byte> out, Micros now);
  Micros deadline() const;
  /// Say goodbye: the next emit() is a Leave.
  void leave();
  /// Have the body put back to rest, as soon as the server is there.
  void ask_reset() { reset_.ask(); }
  bool reset_pending() const { return reset_.pending(); }
  /// Show this channel beside the positions; position: none.
  void show_channel(ShapeChannel channel);
  /// Most that shapes may take, 0 = the server's default.
  void limit(std::uint16_t kbit_s) { kbit_s_ = kbit_s; }

  ViewLink link() const { return link_; }
  const std::string& refusal() const { return refusal_; }
  const Welcome& welcome() const { return welcome_; }  ///< meaningful when joined once

  /// Mesh and at least one shape are here: there is something to draw.
  bool ready() const { return mesh_.complete() && !playback_.empty(); }
  const BodyMesh& mesh() const { return mesh_.mesh(); }
  /// The body at rest, what displacement is measured from.
  const std::vector<Eigen::Vector3f>& rest() const { return rest_; }
  /// Grows with every new topology: whoever keeps something about the mesh forgets it then.
  std::uint64_t mesh_version() const { return mesh_version_; }
  /// The moment that is due at `now`; false while there is none.
  bool show(Micros now, ViewMoment& moment) const { return ready() && playback_.at(now, moment.shape, moment.tools); }
  /// How long ago the body was as it is shown: what computing, the way here and the smoothing of playback() take. Only when
  /// ready.
  Micros lateness(Micros now) const;
  /// How the room does, as the server last said; empty before.
  const RoomView& room() const { return room_; }
  /// Frames of the body that came in the last second.
  int shapes_lately(Micros now) const;
  /// The server is heard: what it said last still holds.
  bool heard_lately(Micros now) const { return link_ == ViewLink::joined && now - heard_ < kSilentAfter; }
  /// The newest datagram that answered one of ours, a refusal too; the beginning before the first.
  Micros last_answer() const { return answered_; }
  /// The last of them said that the server is shutting down.
  bool sent_away() const { return sent_away_; }
  /// How long it has been silent.
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
  std::size_t say(Body body, std::span<std::byte> out, Micros now);

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
  std::deque<std::uint32_t> asking_;  ///< mesh pieces to ask for now
  std::size_t asked_ = 0;             ///< pieces still expected of the last round
  ClockSync clock_;
  ResetRequest reset_;
  MeshAssembly mesh_;
  ShapeAssembly shapes_;
  Playback playback_;
  std::deque<Micros> shapes_came_;  ///< in the last second
  std::vector<Shape> finished_;
  std::vector<Eigen::Vector3f> rest_;
  RoomView room_;
  ViewState state_;         ///< of the datagrams of this session
  bool heard_any_ = false;  ///< `state_` holds something
  Micros next_state_ = Micros::max();
  ShapeChannel channel_ = ShapeChannel::position;
  std::uint16_t kbit_s_ = 0;
  ViewCounts counts_;
};

}  // namespace palpate
