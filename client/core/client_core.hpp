// The station's side of a session without sockets, threads or clocks: it receives datagrams, ticks, emits datagrams and states
// its next deadline. ClientSession joins and keeps the session; while joined, samples go up and patches come down.
//
// The force needs the server. It ends (HapticTick::server_until) when nothing has arrived for twice the longest pause in contact
// of the last 10 s, clamped to kServerSilenceLeast..kServerSilenceMost. It ends at once when the server refuses us or is given
// up, until a patch arrives. A shadow sends no samples, only beats: it uses the tool of another station. All calls but haptic()
// come from one thread; haptic() belongs to the haptic thread and shares only wait-free hand-offs.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "client/core/client_session.hpp"
#include "client/core/haptic_tick.hpp"
#include "client/core/longest_pause.hpp"
#include "client/core/uplink_pace.hpp"
#include "client/intake/intake.hpp"
#include "common/session/loss_meter.hpp"
#include "common/session/seq_tracker.hpp"

namespace palpate {

struct ClientOptions {
  Hello hello;  ///< name, scheme, order, shadow_of
  GuardLimits guard;
  CouplingParameters coupling;    ///< between device and virtual tool; no stiffness: no coupling
  bool refuses_guidance = false;  ///< true: nobody may guide this hand
};

inline constexpr Micros kBeatEvery{50'000};     ///< interval when there are no samples to send
inline constexpr Micros kReportEvery{250'000};  ///< interval of the Beat that reports the link while samples are sent

inline constexpr Micros kServerSilenceLeast{300'000}, kServerSilenceMost{1'000'000};  ///< range of the tolerated silence

struct TouchCounts {
  std::uint64_t samples_outside = 0;           ///< not finite or beyond the world: neither sent nor replayed
  std::uint64_t patch_bytes = 0, patches = 0;  ///< bytes of the datagrams with patches and their terms; patches received
  std::uint64_t patches_accepted = 0;          ///< of these: new, and recent enough to be replayed up to now
  std::uint64_t renewed = 0;                   ///< beats that renewed the patch in use
};

struct ClientCounts : ClientTraffic, TouchCounts {};

/// The pair of a guidance, as far as it concerns this hand.
struct GuidanceStatus {
  std::string partner;                        ///< empty: there is none
  bool guides = false;                        ///< true: this hand guides the partner
  GuidanceHand other = GuidanceHand::absent;  ///< state of the partner
  GuidanceHand own = GuidanceHand::ready;
  bool held() const { return own == GuidanceHand::holds && other == GuidanceHand::holds; }
  bool operator==(const GuidanceStatus&) const = default;
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

class ClientCore : public ClientSession {
 public:
  explicit ClientCore(const ClientOptions& options, Micros now);

  void take(std::span<const std::byte> bytes, Micros now);
  void tick(Micros now);
  /// Writes the next datagram for the server into `out`. Returns its size, 0 when there is none. Call until it returns 0.
  std::size_t emit(std::span<std::byte> out, Micros now);
  Micros deadline() const;
  /// Says goodbye: the next emit() returns a Leave.
  void leave();

  HapticTick& haptic() { return haptic_; }
  const HapticTick& haptic() const { return haptic_; }

  const UplinkPace& uplink_pace() const { return pace_; }
  /// Returns the link report that is sent to the server.
  LinkReport link_report() const;
  /// Returns the server's newest report about the datagrams that it receives.
  const LinkReport& server_report() const { return server_report_; }
  /// Patches that check() refused.
  std::uint64_t patches_refused() const { return counts().dropped[static_cast<std::size_t>(WireFault::patch_refused)]; }
  const SeqCounts& loss() const { return seq_in_.counts(); }  ///< losses of the datagrams from the server
  ClientCounts counts() const { return {ClientSession::counts(), counts_}; }
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
  /// True while the server keeps the tool off the body, because it cost too much; by its newest report.
  bool tool_released() const { return tool_released_; }
  /// State of guidance; there is no partner when nothing has come about it for a second.
  GuidanceStatus guidance(Micros now) const;
  /// The server's newest report of its own pace.
  const ServerPace& server_pace() const { return server_pace_; }
  /// The scheme that the server last reported for this station; `unknown` when the server reports none.
  const SchemeInUse& in_use() const { return in_use_; }
  /// Patches accepted, by scheme, and the number of changes of scheme between successive patches.
  const SchemesFelt& schemes_felt() const { return schemes_felt_; }

 private:
  static constexpr std::size_t kUnsentMost = 1024;  ///< samples that wait for being sent; older ones are not sent any more
  static constexpr Micros kDrainEvery{100'000};     ///< longest interval; the ring between the threads holds a second
  static constexpr Micros kPartnerGone{1'000'000};  ///< silence after which there is no partner of a guidance

  void drain();
  void drain_buttons();
  void forget_server();
  void begin(const Message& message, Micros now);
  void hear(Micros now);
  void meet_parts(Micros now);
  void take_patch(const Patch& patch, std::size_t bytes, Micros now);
  void take_terms(const PatchTerms& piece, std::size_t bytes);
  void take_beat(const Beat& beat, Micros now);
  void take_guidance(const Guidance& guidance, Micros now);
  GuidanceReport guidance_report() const;
  void renew(const Beat& beat, Micros now);
  void stop_force();
  bool has_unsent() const { return unsent_ > 0 && hello().shadow_of.empty(); }
  std::size_t emit_beat(std::span<std::byte> out, Micros now);
  std::size_t emit_samples(std::span<std::byte> out, Micros now);

  LongestPause pause_;
  bool vouched_ = false;  ///< true: a patch arrived since the join, and nothing has contradicted it
  SeqTracker seq_in_;
  LossMeter loss_in_;
  UplinkPace pace_;
  Micros next_send_{}, next_beat_{}, next_report_{}, ticked_{};
  bool send_due_ = false, beat_due_ = false;
  bool contact_in_reach_ = false;
  bool tool_released_ = false;
  ServerPace server_pace_;
  LinkReport server_report_;
  SchemeInUse in_use_;
  SchemesFelt schemes_felt_;
  std::size_t unsent_ = 0;                    ///< number of the newest samples() that are not sent yet
  std::vector<ButtonChange> button_changes_;  ///< newest last, kMaxButtonChanges at most; every datagram of samples repeats them
  std::vector<std::unique_ptr<const PartWalls>> walls_;  ///< of all scenes so far, as the tick may still use the one before
  std::uint64_t walls_of_ = 0, walls_since_ = 0;         ///< of the newest: Welcome::scene_hash, number of the join
  Patch last_patch_;
  bool refuses_guidance_;
  std::optional<Guidance> guidance_;  ///< newest message about guidance
  Micros guidance_at_{};
  GuidanceHand hand_said_ = GuidanceHand::ready;  ///< state in the last Beat
  TouchCounts counts_;

  // hand-offs to and from the haptic thread
  LatestSlot<PatchPlayer> patch_slot_;
  SampleRing sample_ring_;
  PatchIntake intake_;
  HapticTick haptic_;
};

}  // namespace palpate
