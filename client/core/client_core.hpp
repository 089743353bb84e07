// The station's side of a session without sockets, threads or clocks: take a datagram, tick, emit datagrams, say the deadline.
//
// Life of a station: joining (Hello every 250 ms until Welcome) -> joined (Samples up, patches down) -> joining again when the
// server refuses us as unknown or was not heard for kLostAfter (a server that restarted has another instance number); then it
// says Leave too, so that a server that still hears us frees the name. Refused for another reason (name taken, wrong version,
// ...): it says so and keeps asking, once a second.
//
// What another than the server sends in its name. Every datagram of a server says which of ours it got last, by the microsecond
// at which we sent it (ClockStamps::echo; a Refuse: that which it answers). One that names none of our last kSentKept says
// nothing that counts: who does not see our datagrams has to guess one of several hundred microseconds of the last second. That
// is no secret from somebody on the way, whom only a key keeps out.
//
// The force needs the server: it ends (HapticTick::server_until) when nothing has come for twice the longest pause in contact of
// the last 10 s, from kServerSilenceLeast to kServerSilenceMost, and at once when the server refuses us or is given up, until a
// patch comes. A shadow sends no samples, only beats: the tool it feels with is another station's. All calls but haptic() come
// from one thread; haptic() belongs to the haptic thread and shares only wait-free hand-offs.
#pragma once

#include <array>
#include <cstddef>
#include <deque>
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
  CouplingParameters coupling;  ///< between device and virtual tool; no stiffness: none
};

inline constexpr Micros kHelloEvery{250'000};
inline constexpr Micros kRetryEvery{1'000'000};  ///< Hello after a refusal
inline constexpr Micros kBeatEvery{50'000};      ///< when there are no samples to send
inline constexpr Micros kReportEvery{250'000};   ///< Beat beside the samples, that tells how the link does
inline constexpr Micros kLostAfter{3'000'000};   ///< a server silent for so long is gone

inline constexpr Micros kServerSilenceLeast{300'000}, kServerSilenceMost{1'000'000};  ///< of the server, that the force outlasts

enum class LinkState : std::uint8_t { joining, joined, refused };

struct ClientCounts {
  std::uint64_t sent = 0, received = 0, bytes_sent = 0, bytes_received = 0, joins = 0, stale = 0;
  std::uint64_t samples_outside = 0;                 ///< not finite or beyond the world: neither sent nor caught up with
  std::array<std::uint64_t, kWireFaults> dropped{};  ///< patches that did not pass check() among them
  std::uint64_t patch_bytes = 0, patches = 0;        ///< bytes of the datagrams that carried patches, with their terms
  std::uint64_t patches_accepted = 0;                ///< of these: new, and in time to be caught up with
  std::uint64_t renewed = 0;                         ///< beats that said so of the patch in use
  std::uint64_t unproven = 0;                        ///< in the server's name, but without an echo of ours
};

/// Frames a second that the room has time for (0: not said yet), and how old its newest state was when it was computed.
struct ServerPace {
  double rate_hz = 0, rate_min_hz = 0;  ///< the last one; the least since the last joining
  Micros behind{}, behind_max{};
  bool slow(double nominal_hz) const { return rate_hz > 0 && rate_hz < 0.95 * nominal_hz; }
};

struct SchemesFelt {
  std::array<std::uint64_t, kSchemeNames.size()> patches{};
  std::uint64_t changes = 0;
  /// Of most patches; nothing before the first.
  SchemeAsked mostly() const;
};

class ClientCore {
 public:
  explicit ClientCore(const ClientOptions& options, Micros now);

  void take(std::span<const std::byte> bytes, Micros now);
  void tick(Micros now);
  /// Bytes of the next datagram for the server written into `out`, 0 when there is none. Call until 0.
  std::size_t emit(std::span<std::byte> out, Micros now);
  Micros deadline() const;
  /// Have the body put back to rest, as soon as the server is there.
  void ask_reset() { reset_.ask(); }
  bool reset_pending() const { return reset_.pending(); }
  /// Say goodbye: the next emit() is a Leave.
  void leave(Micros now);

  HapticTick& haptic() { return haptic_; }
  const HapticTick& haptic() const { return haptic_; }

  LinkState link() const { return link_; }
  /// Meaningful when joined once; also of a server that does not say it, with the station's name.
  const Welcome& welcome() const { return welcome_; }
  /// Why, when refused; and while it joins again, why it had to; and why the body is not reset.
  const std::string& refusal() const { return refusal_.message; }
  RefuseReason refuse_reason() const { return refusal_.reason; }
  const ClockSync& clock() const { return clock_; }
  Micros last_heard() const { return heard_; }
  /// The newest datagram that answered one of ours, a refusal too; the beginning before the first.
  Micros last_answer() const { return answered_; }
  const UplinkPace& uplink_pace() const { return pace_; }
  /// What the server hears of the link.
  LinkReport link_report() const;
  /// What the server said last of the datagrams to it.
  const LinkReport& server_report() const { return server_report_; }
  const SeqCounts& loss() const { return seq_in_.counts(); }  ///< of the datagrams from the server
  const ClientCounts& counts() const { return counts_; }
  const IntakeCounts& intake_counts() const { return intake_.counts(); }
  /// Bytes that were received for a patch that was new: its copies and its terms count with it. 0 before the first.
  double patch_bytes_mean() const;
  const Patch& last_patch() const { return last_patch_; }  ///< the newest accepted patch, for reports
  const TermsAssembly& terms() const { return intake_.terms(); }
  const SampleHistory& samples() const { return intake_.history(); }  ///< of the haptic thread, as far as they came over
  /// From the last server message: a surface is near enough for patches.
  bool contact_in_reach() const { return contact_in_reach_; }
  /// What the server last said of its own pace.
  const ServerPace& server_pace() const { return server_pace_; }
  /// What the server last said that the station gets; of a server that says nothing, `not_said`.
  const SchemeInUse& in_use() const { return in_use_; }
  /// Patches accepted, by scheme, and how often a patch was of another scheme than the one before.
  const SchemesFelt& schemes_felt() const { return schemes_felt_; }

 private:
  static constexpr std::size_t kKept = 1024;     ///< samples at hand for sending and repeating
  static constexpr Micros kDrainEvery{100'000};  ///< at least; the ring between the threads holds a second

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
  std::size_t say(Body body, std::span<std::byte> out, Micros now);
  std::size_t emit_samples(std::span<std::byte> out, Micros now);

  ClientOptions options_;
  LinkState link_ = LinkState::joining;
  std::uint64_t instance_ = 0;
  StationId station_ = 0;
  std::uint32_t seq_out_ = 0;
  ClockSync clock_;
  SentStamps sent_;
  LongestPause pause_;
  bool vouched_ = false;               ///< a patch came since we joined, and nothing spoke against it
  std::uint64_t unproven_before_ = 0;  ///< when the server was last heard
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
  std::deque<ToolSample> recent_;             ///< newest last
  std::size_t unsent_ = 0;                    ///< of these, at the end
  Orientation orientation_;                   ///< newest
  std::vector<ButtonChange> button_changes_;  ///< newest last, kMaxButtonChanges at most: every datagram of samples repeats them
  Patch last_patch_;
  ClientCounts counts_;

  // the hand-offs to and from the haptic thread
  LatestSlot<PatchPlayer> patch_slot_;
  SampleRing sample_ring_;
  PatchIntake intake_;
  HapticTick haptic_;
};

}  // namespace palpate
