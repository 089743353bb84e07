// What the server knows of one station, and what it still has to tell it. Of the parts of a Station each is written by one class:
// who it is by Sessions, the frames that it gets by FrameScheduler, what it is sent by PatchSender and ViewSender.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "common/base/rate_limit.hpp"
#include "common/session/clock_sync.hpp"
#include "common/session/loss_meter.hpp"
#include "common/session/seq_tracker.hpp"
#include "common/wire/messages.hpp"
#include "server/core/detail_choice.hpp"
#include "server/core/handshakes.hpp"
#include "server/core/link_said.hpp"
#include "server/core/shape_stream.hpp"
#include "server/core/tool_input.hpp"

namespace palpate {

inline constexpr Micros kLinkReportEvery{250'000};  ///< how often a station is told how link and room do

struct PatchCounts {
  std::uint64_t patches = 0, patch_bytes = 0;
  std::uint64_t renewed = 0;        ///< frames whose patch it did not need
  std::uint64_t patch_too_big = 0;  ///< did not fit a datagram and were not sent
};
struct StationCounts : SampleCounts, PatchCounts {};

/// What waits to be sent. Only the newest of each kind: a patch or beat that is overtaken was never needed.
struct Outbox {
  std::optional<Patch> patch;    ///< stamp already in the station's clock
  std::deque<PatchTerms> terms;  ///< pieces that go with the newest patch; after it
  int patch_copies = 1;          ///< datagrams that carry it
  std::optional<Beat> beat;
  int beat_copies = 1;  ///< datagrams that carry it: as many as a patch that it stands for
  std::deque<std::uint32_t> mesh_pieces;
  std::optional<double> mesh_bytes = {};  ///< that it may still get of the mesh; nothing before the first piece
  Micros mesh_bytes_at{};                 ///< when that was so
  bool room = false;                      ///< a RoomView is due
};

struct Station {
  // Sessions
  StationId id = 0;
  std::uint64_t secret = 0;  ///< what its datagrams and ours carry as instance
  PeerId peer = 0;
  Hello hello;        ///< under the name that it has in the room
  std::string asked;  ///< name that it asked for
  Micros heard{};     ///< newest datagram
  Micros echoed{};    ///< newest datagram of ours that it has shown to have received: when we sent it
  struct Claim {
    PeerId by = 0;
    Micros since{};
  };
  Claim claim;      ///< of the newest successor that asked for its name
  ClockSync clock;  ///< its clock is the peer's
  SeqTracker seq;
  LossMeter loss;
  LinkSaid link;
  std::uint32_t seq_out = 1;  ///< Welcome was 0

  // FrameScheduler
  ToolInput tool;
  DetailChoice choice;            ///< where it left the scheme to us
  SchemeInUse in_use;             ///< in the frame that is out, or was last
  Micros horizon{};               ///< age that its patches reach, by the last frame
  bool served = true;             ///< there is time for its patch in the frame that is out, or was last
  Micros served_at{};             ///< when there was last
  std::optional<Micros> touched;  ///< when it last had a patch, or would have had one but for time

  // PatchSender
  struct SentPatch {
    std::uint32_t seq = 0;
    Micros stamp{};  ///< server clock
  };
  std::deque<SentPatch> patches_sent;  ///< from the one that it plays, as far as is known, to the newest
  std::optional<Micros> playing;       ///< stamp of that one; nothing is known of a station that has not said
  Micros next_report{};                ///< when it gets a Beat beside a patch, a viewer a RoomView
  std::uint32_t patch_seq = 0;
  bool contact_in_reach = false;
  std::uint16_t states = 0;  ///< of its newest patch
  bool slow_known = false;   ///< it was told that the room falls behind
  ToolView shown;            ///< at the body time, for viewers
  bool has_shown = false;
  PatchCounts counts;
  Outbox outbox;

  // ViewSender
  ShapeViewer shape;  ///< what a viewer was sent

  // ServerCore
  RateLimit resets{2, Micros{30'000'000}};  ///< that it may have of the body

  bool pushes() const { return hello.role == Role::haptic && hello.shadow_of.empty(); }
  bool views() const { return hello.role == Role::viewer; }
  /// Whether it left the scheme to us.
  bool chosen() const { return !views() && !hello.scheme; }
};

/// Ordered, so that every run emits in the same order.
class Stations : public std::map<StationId, Station> {
 public:
  const Station* named(const std::string& name) const;
  Station* named(const std::string& name) { return const_cast<Station*>(std::as_const(*this).named(name)); }
  /// The station whose samples say where the tool of this one is; none where that one has left.
  const Station* tool_of(const Station& station) const;
  /// From the server's clock into the station's, by the samples of its tool where there are any.
  Micros station_time(const Station& station, Micros server_time) const;
};

/// For reports.
struct StationReport {
  StationId id = 0;
  std::string name;
  Role role = Role::haptic;
  Scheme scheme = Scheme::port;
  std::string shadow_of;
  RttStats rtt;
  Micros offset{};  ///< its clock minus ours
  double drift_ppm = 0;
  SeqCounts link;                            ///< of the datagrams from it
  Micros horizon{};                          ///< age that its patches are made to reach
  Micros patch_age{};                        ///< that its patches reach, as it says; 0 = it has not said
  std::optional<double> lost_up, lost_down;  ///< share of the newest datagrams each way that got lost; nothing until it is known
  std::uint32_t ticks_late = 0;              ///< of its haptic loop
  StationCounts counts;
};

/// The next datagram for a station, 0 where it does not fit.
std::size_t encode_for(Station& station, Body body, std::span<std::byte> out, Micros now);

}  // namespace palpate
