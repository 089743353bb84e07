// The station's side of a session without sockets, threads or clocks: it receives datagrams, ticks, emits datagrams and states
// its next deadline.
//
// Life of a station: joining (Hello every 250 ms until Welcome) -> joined (Samples up, patches down) -> joining again when the
// server refuses the station as unknown or has been silent for kLostAfter (a restarted server has another instance number). In
// that case the station also sends Leave, so that a server that still receives us frees the name. A station refused for another
// reason (name in use, wrong version, ...) reports the reason and retries once a second.
//
// Forged datagrams: every datagram of a server echoes the microsecond at which we sent the newest one that it received
// (ClockStamps::echo; a Refuse echoes the one that it answers). A datagram that echoes none of our last kSentKept is ignored: an
// attacker off the path has to guess one of several hundred microseconds of the last second. An attacker on the path sees them;
// only a key keeps out that one.
//
// The force needs the server. It ends (HapticTick::server_until) when nothing has arrived for twice the longest pause in contact
// of the last 10 s, clamped to kServerSilenceLeast..kServerSilenceMost. It ends at once when the server refuses us or is given
// up, until a patch arrives. A shadow sends no samples, only beats: it uses the tool of another station. All calls but haptic()
// come from one thread; haptic() belongs to the haptic thread and shares only wait-free hand-offs.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>

#include "client/core/haptic_tick.hpp"
#include "client/core/longest_pause.hpp"
#include "client/core/sent_stamps.hpp"
#include "client/core/uplink_pace.hpp"
#include "client/intake/intake.hpp"
#include "common/session/clock_sync.hpp"
#include "common/session/loss_meter.hpp"
#include "common/session/reset_request.hpp"
#include "common/session/seq_tracker.hpp"
#include "common/wire/codec.hpp"
#include "common/wire/messages.hpp"

namespace palpate {

struct ClientOptions {
  Hello hello;  ///< name, scheme, order, shadow_of
  GuardLimits guard;
  CouplingParameters coupling;  ///< between device and virtual tool; no stiffness: no coupling
};

inline constexpr Micros kHelloEvery{250'000};
inline constexpr Micros kRetryEvery{1'000'000};  ///< Hello after a refusal
inline constexpr Micros kBeatEvery{50'000};      ///< interval when there are no samples to send
inline constexpr Micros kReportEvery{250'000};   ///< interval of the Beat that reports the link while samples are sent
inline constexpr Micros kLostAfter{3'000'000};   ///< silence after which a server counts as gone

inline constexpr Micros kServerSilenceLeast{300'000}, kServerSilenceMost{1'000'000};  ///< range of the tolerated silence

enum class LinkState : std::uint8_t { joining, joined, refused };

struct ClientCounts {
  std::uint64_t sent = 0, received = 0, bytes_sent = 0, bytes_received = 0, joins = 0, stale = 0;
  std::uint64_t samples_outside = 0;                 ///< not finite or beyond the world: neither sent nor replayed
  std::array<std::uint64_t, kWireFaults> dropped{};  ///< includes the patches that did not pass check()
  std::uint64_t patch_bytes = 0, patches = 0;        ///< bytes of the datagrams with patches and their terms; patches received
  std::uint64_t patches_accepted = 0;                ///< of these: new, and recent enough to be replayed up to now
  std::uint64_t renewed = 0;                         ///< beats that renewed the patch in use
  std::uint64_t unproven = 0;                        ///< in the server's name, but without an echo of our own stamps
};

/// Frame rate that the room achieves (0: not reported yet), and the age of its newest state at the time it was computed.
struct ServerPace {
  double rate_hz = 0, rate_min_hz = 0;  ///< the newest rate; the lowest since the last join
  Micros behind{}, behind_max{};
  bool slow(double nominal_hz) const { return rate_hz > 0 && rate_hz < 0.95 * nominal_hz; }
};

struct SchemesFelt {
  std::array<std::uint64_t, kSchemeNames.size()> patches{};
  std::uint64_t changes = 0;
  /// Returns the scheme of most patches; empty before the first.
  SchemeAsked mostly() const;
};

class ClientCore {
 public:
  explicit ClientCore(const ClientOptions& options, Micros now);

  void take(std::span<const std::byte> bytes, Micros now);
  void tick(Micros now);
  /// Writes the next datagram for the server into `out`. Returns its size, 0 when there is none. Call until it returns 0.
  std::size_t emit(std::span<std::byte> out, Micros now);
  Micros deadline() const;
  /// Requests a reset of the body to rest, sent as soon as the server is there.
  void ask_reset() { reset_.ask(); }
  bool reset_pending() const { return reset_.pending(); }
  /// Says goodbye: the next emit() returns a Leave.
  void leave(Micros now);

  HapticTick& haptic() { return haptic_; }
  const HapticTick& haptic() const { return haptic_; }

  LinkState link() const { return link_; }
  /// The last Welcome, valid after the first join. Where the server assigned no name it carries the requested one.
  const Welcome& welcome() const { return welcome_; }
  /// Reason of the refusal; while joining again, the reason for that; also the reason why a reset was refused.
  const std::string& refusal() const { return refusal_.message; }
  RefuseReason refuse_reason() const { return refusal_.reason; }
  const ClockSync& clock() const { return clock_; }
  Micros last_heard() const { return heard_; }
  /// Time of the newest datagram that answered one of ours, refusals included; the start of the session before the first.
  Micros last_answer() const { return answered_; }
  const UplinkPace& uplink_pace() const { return pace_; }
  /// Returns the link report that is sent to the server.
  LinkReport link_report() const;
  /// Returns the server's newest report about the datagrams that it receives.
  const LinkReport& server_report() const { return server_report_; }
  const SeqCounts& loss() const { return seq_in_.counts(); }  ///< losses of the datagrams from the server
  const ClientCounts& counts() const { return counts_; }
  const IntakeCounts& intake_counts() const { return intake_.counts(); }
  /// Mean bytes received per new patch, its copies and its terms included. 0 before the first.
  double patch_bytes_mean() const;
  const Patch& last_patch() const { return last_patch_; }  ///< the newest accepted patch, for reports
  const TermsAssembly& terms() const { return intake_.terms(); }
  const SampleHistory<ToolSample>& samples() const {
    return intake_.history();
  }  ///< the haptic thread's samples that have been handed over
  /// True when the newest server message said that a surface is near enough for patches.
  bool contact_in_reach() const { return contact_in_reach_; }
  /// The server's newest report of its own pace.
  const ServerPace& server_pace() const { return server_pace_; }
  /// The scheme that the server last reported for this station; `not_said` when the server reports none.
  const SchemeInUse& in_use() const { return in_use_; }
  /// Patches accepted, by scheme, and the number of changes of scheme between successive patches.
  const SchemesFelt& schemes_felt() const { return schemes_felt_; }

 private:
  static constexpr std::size_t kUnsentMost = 1024;  ///< samples that wait for being sent; older ones are not sent any more
  static constexpr Micros kDrainEvery{100'000};     ///< longest interval; the ring between the threads holds a second

  void drain();
  void drain_hold();
  void take_clock(const ClockStamps& stamps, Micros now);
  void take_fault(WireFault fault);
  bool is_ours(const Message& message) const;
  void hear(Micros now);
  void take_welcome(const Message& message, Micros now);
  void take_refuse(const Message& message, Micros now);
  void take_patch(const Patch& patch, std::size_t bytes, Micros now);
  void take_terms(const PatchTerms& piece, std::size_t bytes);
  void take_beat(const Beat& beat, Micros now);
  void renew(const Beat& beat, Micros now);
  void join_again(Micros now);
  void let_go();
  bool has_unsent() const { return unsent_ > 0 && options_.hello.shadow_of.empty(); }
  std::size_t say(Payload body, std::span<std::byte> out, Micros now);
  std::size_t emit_samples(std::span<std::byte> out, Micros now);

  ClientOptions options_;
  LinkState link_ = LinkState::joining;
  std::uint64_t instance_ = 0;
  StationId station_ = 0;
  std::uint32_t seq_out_ = 0;
  ClockSync clock_;
  SentStamps sent_;
  LongestPause pause_;
  bool vouched_ = false;               ///< true: a patch arrived since the join, and nothing has contradicted it
  std::uint64_t unproven_before_ = 0;  ///< value of the counter when the server was last heard
  SeqTracker seq_in_;
  LossMeter loss_in_;
  UplinkPace pace_;
  ResetRequest reset_;
  Welcome welcome_;
  Refuse refusal_;
  Micros heard_{}, answered_{}, next_hello_{}, next_send_{}, next_beat_{}, next_report_{}, ticked_{};
  bool hello_due_ = false, send_due_ = false, beat_due_ = false, leave_due_ = false, left_ = false;
  bool contact_in_reach_ = false;
  ServerPace server_pace_;
  LinkReport server_report_;
  SchemeInUse in_use_;
  SchemesFelt schemes_felt_;
  std::size_t unsent_ = 0;                    ///< number of the newest samples() that are not sent yet
  Orientation orientation_;                   ///< newest orientation
  std::vector<ButtonChange> button_changes_;  ///< newest last, kMaxButtonChanges at most; every datagram of samples repeats them
  Patch last_patch_;
  ClientCounts counts_;

  // hand-offs to and from the haptic thread
  LatestSlot<PatchPlayer> patch_slot_;
  SampleRing sample_ring_;
  PatchIntake intake_;
  HapticTick haptic_;
};

}  // namespace palpate
