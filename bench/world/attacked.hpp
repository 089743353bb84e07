// Scenarios in a world whose datagrams go through the trust channel, new keys all the time, with somebody on the way of all of
// them (adversary.hpp).
#pragma once

#include "bench/world/adversary.hpp"
#include "bench/world/run.hpp"

namespace palpate {

enum class Attacker : std::uint8_t {
  none,
  stranger,  ///< has no key
  thief      ///< has that of a station for another room
};

struct AttackedRun {
  WorldReport report;
  AttackCounts counts;
};

/// New keys about once a second, as often as a client may; old ones open for as long as anything is under way.
ChannelTimes quick_keys();

/// One run, its handshakes over the links. The attacker of a seed is always the same.
AttackedRun run_with_keys(const Scenario& scenario, Attacker attacker, Manner manner, RunOptions options = {});

/// What this seed draws, attacked by a stranger or, if it is even, by a thief:
///
///     - while everything goes wrong that is drawn, under all checks, first handshakes and those after silence attacked too, by a
///       stranger ruthlessly;
///     - where nothing goes wrong and no link loses anything, carefully from the first handshake on, until all could be in and
///       kReplayAfter beyond `healed`, it feels to the bit what the same seed feels without the attacker: otherwise there is a
///       violation named `attack` that says the first tick that differs, and also where the server sent more to addresses of no
///       station than it got, or where the attack never began. What the body is asked for in both is computed once
///       (frame_log.hpp).
///
/// The report is of the first.
WorldReport run_attacked(DrawOptions draw, bool keep_rows = false);

/// The first tick of `b` that is not as in `a`; nothing where both are the same to the bit, with every datagram of the sessions.
std::optional<std::size_t> first_difference(const WorldReport& a, const WorldReport& b);

}  // namespace palpate
