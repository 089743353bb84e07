// State of one station at the server, and its queue of outgoing messages. Each part is written by one class: identity by
// Sessions, frames by FrameScheduler, messages by PatchSender and ViewSender.
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
#include "server/core/handshakes.hpp"
#include "server/core/hysteresis_switch.hpp"
#include "server/core/reported_link.hpp"
#include "server/core/shape_stream.hpp"
#include "server/core/tool_input.hpp"

namespace palpate {

inline constexpr Micros kLinkReportEvery{250'000};  ///< interval of the reports on link and room to a station

struct PatchCounts {
  std::uint64_t patches = 0, patch_bytes = 0;
  std::uint64_t renewed = 0;        ///< frames whose patch it did not need
  std::uint64_t patch_too_big = 0;  ///< patches that did not fit into a datagram and were not sent
};
struct StationCounts : SampleCounts, PatchCounts {};

/// Messages that wait to be sent. Only the newest of each kind is kept, as a patch or beat that was overtaken is never needed.
struct Outbox {
  std::optional<Patch> patch;    ///< stamp already in the station's clock
  std::deque<PatchTerms> terms;  ///< pieces that belong to the newest patch and follow it
  int patch_copies = 1;          ///< datagrams that carry the patch; as often are its pieces in `terms`
  std::optional<Beat> beat;
  int beat_copies = 1;  ///< datagrams that carry the beat: as many as for the patch that it replaces
  std::deque<std::uint32_t> mesh_pieces;
  std::optional<double> mesh_bytes = {};  ///< remaining budget for the mesh; empty before the first piece
  Micros mesh_bytes_at{};                 ///< time of that budget
  bool room = false;                      ///< true while a RoomView is due
  bool task = false;                      ///< true while the Task is due
  bool rooms = false;                     ///< true while the Rooms are due
};

/// State of a station with regard to guidance (guidance_relay.hpp).
struct GuidanceSeat {
  GuidanceReport report;                         ///< newest one of the station
  StationId partner = 0;                         ///< station that it guides, or that guides it; 0: none
  GuidanceHand obstacle = GuidanceHand::absent;  ///< guide: reason why it has no partner; `ready` with one
  Micros next{};                                 ///< earliest time of its next message
  bool due = false;                              ///< true while a message is due
  bool held = false;                             ///< guide: it holds the tool of its partner
};

/// Limit of the resets of the body by one station, or by one key.
inline const RateLimit kResetsOfOne{2, Micros{30'000'000}};

struct Station {
  // Sessions
  StationId id = 0;
  std::uint64_t secret = 0;  ///< instance number in its datagrams and ours
  PeerId peer = 0;
  Hello hello;            ///< with the name that it has in the room
  std::string asked;      ///< name that it asked for
  std::uint8_t held = 0;  ///< number of its tool in the scene, or of the one that it shares
  HeldTool tool_held;     ///< that tool
  Micros heard{};         ///< arrival of its newest datagram
  Micros echoed{};        ///< send time of our newest datagram that it has proved to have received
  struct Claim {
    PeerId by = 0;
    Micros since{};
  };
  Claim claim;      ///< claim of the newest successor that asked for its name
  ClockSync clock;  ///< the peer of this clock is the station
  SeqTracker seq;
  LossMeter loss;
  ReportedLink link;
  std::uint32_t seq_out = 1;  ///< Welcome was 0

  // FrameScheduler
  ToolInput tool;
  HysteresisSwitch choice;        ///< used if it left the scheme to us
  SchemeInUse in_use;             ///< scheme in the frame that is being computed, or in the last one
  Micros horizon{};               ///< age that its patches reach, by the last frame
  bool served = true;             ///< true if its patch had time in the frame that is being computed, or in the last one
  Micros served_at{};             ///< time when it was last served
  std::optional<Micros> touched;  ///< time when it last had a patch, or would have had one with enough time

  // PatchSender
  struct SentPatch {
    std::uint32_t seq = 0;
    Micros stamp{};  ///< server clock
  };
  std::deque<SentPatch> patches_sent;  ///< from the one that it plays, as far as is known, to the newest
  std::optional<Micros> playing;       ///< stamp of the patch that it plays; empty until it reports one
  Micros next_report{};                ///< time of its next Beat in addition to patches, or of a viewer's next RoomView
  std::uint32_t patch_seq = 0;
  bool contact_in_reach = false;
  std::uint16_t states = 0;  ///< states of its newest patch
  bool released = false;     ///< true: its tool cost too much, was released, and may not touch yet
  bool slow_known = false;   ///< true if it was sent that the room is behind
  ToolView shown;            ///< its tool at body time, for viewers
  bool has_shown = false;
  PatchCounts counts;
  Outbox outbox;

  // ViewSender
  ShapeViewer shape;   ///< state of the stream to a viewer
  Micros next_task{};  ///< time when the room's task and the server's rooms are sent again

  // GuidanceRelay
  GuidanceSeat guidance;

  // ServerCore
  RateLimit resets = kResetsOfOne;  ///< limit of its resets of the body, where it has no key
  RateLimit note_limit{8, Micros{2'000'000}};
  std::uint32_t notes = 0;  ///< number of its notes that were recorded

  bool pushes() const { return hello.role == Role::haptic && hello.shadow_of.empty(); }
  bool views() const { return hello.role == Role::viewer; }
  /// Returns true if it left the scheme to us.
  bool chosen() const { return !views() && !hello.scheme; }
};

/// Ordered by id, so that every run emits in the same order.
class Stations : public std::map<StationId, Station> {
 public:
  const Station* named(const std::string& name) const;
  Station* named(const std::string& name) { return const_cast<Station*>(std::as_const(*this).named(name)); }
  /// Station whose samples drive the tool of `station`; nullptr if that one has left.
  const Station* tool_of(const Station& station) const;
  /// Converts server time to the station's clock, by the samples of its tool if there are any.
  Micros station_time(const Station& station, Micros server_time) const;
};

/// Figures of a station for reports.
struct StationReport {
  StationId id = 0;
  std::string name;
  Role role = Role::haptic;
  Scheme scheme = Scheme::port;
  std::string shadow_of;
  RttStats rtt;
  Micros offset{};  ///< its clock minus ours
  double drift_ppm = 0;
  SeqCounts link;                            ///< counts of the datagrams from it
  Micros horizon{};                          ///< age that its patches are made to reach
  Micros patch_age{};                        ///< age that its patches reach, as it reports; 0 = not reported
  std::optional<double> lost_up, lost_down;  ///< share of the newest datagrams in each direction that got lost; empty until known
  std::uint32_t ticks_late = 0;              ///< late ticks of its haptic loop
  StationCounts counts;
  StationId guided = 0;         ///< station whose tool it guides now, 0: none
  double guidance_force_n = 0;  ///< mean force of guidance over the last 0.1 s, as it reports
  HeldTool tool = {};           ///< that it holds, or shares
};

/// Encodes the next datagram for a station; returns its bytes, 0 if it does not fit.
std::size_t encode_for(Station& station, Payload body, std::span<std::byte> out, Micros now);

}  // namespace palpate
