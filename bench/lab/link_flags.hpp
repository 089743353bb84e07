// Flags that several experiments share: the scheme, and the link over which it works.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>
#include <vector>

#include "bench/fidelity/replay.hpp"
#include "common/link/link_model.hpp"
#include "common/port/scheme.hpp"

namespace palpate {

/// What this build serves, in the order of the names.
std::vector<Scheme> available_schemes();
/// InputError, which names them, for another name.
Scheme available_scheme(const std::string& name);
/// For flags that name schemes: what is typed counts, and is recorded, as today's name.
CLI::Validator current_name();

struct LinkFlags {
  double rate_hz = 20, rtt_ms = 0, jitter_ms = 0, loss_pct = 0, burst = 0, compute_ms = 0;
  std::uint64_t seed = 1;

  /// Also --route, which sets rtt_ms to that of a measured route. The flags must stay where they are until the line is parsed.
  void add_to(CLI::App& command);
  /// One way. InputError when the numbers do not go together.
  LinkSpec one_way() const;
};

/// What every replay is told: scheme, states, link. InputError for a scheme that is not there.
ReplayOptions replay_options(const std::string& scheme, int order, const LinkFlags& link);

}  // namespace palpate
