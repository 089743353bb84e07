// Scenarios in a world whose datagrams pass through the trust channel, with frequent rekeying and an attacker on the path of all
// of them (adversary.hpp).
#pragma once

#include "bench/world/adversary.hpp"
#include "bench/world/run.hpp"

namespace palpate {

enum class Attacker : std::uint8_t {
  none,
  stranger,  ///< has no key
  thief      ///< has the key of a station for another room
};

struct AttackedRun {
  WorldReport report;
  AttackCounts counts;
};

/// New keys about once a second, the shortest interval for a client; old ones remain valid for as long as anything is in flight.
ChannelTimes quick_keys();

/// One run, with its handshakes over the links. A seed always gives the same attacker.
AttackedRun run_with_keys(const Scenario& scenario, Attacker attacker, Manner manner, RunOptions options = {});

/// Runs the scenario of this seed, attacked by a stranger or, if the seed is even, by a thief:
///
///     - with all faults that are drawn, under all checks, attacking first handshakes and those after silence as well, by a
///       stranger ruthlessly;
///     - without faults and losses, attacked carefully from the first handshake on, until all could have joined and kReplayAfter
///       beyond `healed`: the felt forces must equal, to the bit, those of the same seed without the attacker. Otherwise there is
///       a violation named `attack` with the first tick that differs; so there is if the server sent more to addresses of no
///       station than it got, or if the attack never began. Frames that are the same in both are computed once (frame_log.hpp).
///
/// The report is that of the first run.
WorldReport run_attacked(DrawOptions draw, bool keep_rows = false);

/// First tick of `b` that differs from `a`; empty if both are the same to the bit, with every datagram of the sessions.
std::optional<std::size_t> first_difference(const WorldReport& a, const WorldReport& b);

}  // namespace palpate
