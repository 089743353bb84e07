// What the server knows of one station, and what it still has to tell it.
#pragma once

#include <deque>
#include <optional>
#include <string>

#include "common/session/clock_sync.hpp"
#include "common/session/loss_meter.hpp"
#include "common/session/seq_tracker.hpp"
#include "common/wire/messages.hpp"
#include "server/core/detail_choice.hpp"
#include "server/core/jitter_buffer.hpp"
#include "server/core/shape_stream.hpp"
#include "server/core/timeline.hpp"

namespace palpate {

/// Whoever sent a datagram; the io side maps it to an address. Compared for equality only.
using PeerId = std::uint64_t;

struct StationCounts {
  std::uint64_t samples = 0;          ///< new ones
  std::uint64_t samples_late = 0;     ///< of these: too late for the body, which had gone past them
  std::uint64_t samples_refused = 0;  ///< from the future, or before the clocks were known
  std::uint64_t patches = 0, patch_bytes = 0;
  std::uint64_t lived_on = 0;       ///< frames whose patch it did not need
  std::uint64_t patch_too_big = 0;  ///< did not fit a datagram and were not sent
};

/// What waits to be sent. Only the newest of each kind: a patch or beat that is overtaken was never needed.
struct Outbox {
  bool welcome = false;
  std::size_t welcome_limit = 0;  ///< bytes of the Hello; its answer is not larger
  std::optional<Patch> patch;     ///< stamp already in the station's clock
  std::deque<PatchTerms> terms;   ///< pieces that go with the newest patch; after it
  int patch_copies = 1;           ///< datagrams that carry it
  std::optional<Beat> beat;
  int beat_copies = 1;  ///< datagrams that carry it: as many as a patch that it stands for
  std::deque<std::uint32_t> mesh_pieces;
  bool room = false;  ///< a RoomView is due
};

struct Station {
  StationId id = 0;
  PeerId peer = 0;
  Hello hello;          ///< under the name that it has in the room
  std::string asked;    ///< name that it asked for
  Micros heard{};       ///< newest datagram
  bool proven = false;  ///< it has answered with the id we gave it, so it gets what we send to its address
  ClockSync clock;      ///< its clock is the peer's
  SeqTracker seq;
  LossMeter loss;
  Micros patch_age{};       ///< that its patches in use reach, as it says; 0 = it has not said
  int patch_copies = 2;     ///< datagrams that carry each patch to it: what it loses decides, once it has said
  bool loss_known = false;  ///< it has said what it loses
  double lost = 0;          ///< share of the datagrams to it that get lost, as it says
  DetailChoice choice;      ///< where it left the scheme to us
  SchemeInUse in_use;       ///< in the frame that is out, or was last
  int longest_run = 0;      ///< of datagrams to it that got lost one after the other, as it says
  struct SentPatch {
    std::uint32_t seq = 0;
    Micros stamp{};  ///< server clock
  };
  std::deque<SentPatch> patches_sent;  ///< from the one that it plays, as far as is known, to the newest
  std::optional<Micros> playing;       ///< stamp of that one; nothing is known of a station that has not said
  Micros next_report{};                ///< when it gets a Beat beside a patch, a viewer a RoomView
  std::uint32_t seq_out = 0, patch_seq = 0;
  Timeline timeline;
  Micros sample_heard{};  ///< when the newest sample came
  Micros sample_lag{};    ///< how old it was then
  JitterBuffer buffer;
  bool contact_in_reach = false;
  std::uint32_t ticks_late = 0;  ///< of its haptic loop, as it says
  std::uint16_t states = 0;      ///< of its newest patch
  bool slow_known = false;       ///< it was told that the room falls behind
  ToolView shown;                ///< at the body time, for viewers
  bool has_shown = false;
  Orientation orientation;                 ///< of its tool, the newest that came
  ButtonChange buttons{Micros::min(), 0};  ///< the newest change; its clock
  Outbox outbox;
  ShapeViewer shape;  ///< what a viewer was sent
  StationCounts counts;

  bool pushes() const { return hello.role == Role::haptic && hello.shadow_of.empty(); }
  bool views() const { return hello.role == Role::viewer; }
  /// Whether it left the scheme to us.
  bool chosen() const { return !views() && !hello.scheme; }
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
  SeqCounts link;      ///< of the datagrams from it
  Micros horizon{};    ///< age that its patches are made to reach
  Micros patch_age{};  ///< that its patches reach, as it says; 0 = it has not said
  StationCounts counts;
};

}  // namespace palpate
