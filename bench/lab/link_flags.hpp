// Flags shared by several experiments: the scheme and the link.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "bench/fidelity/replay.hpp"
#include "common/link/link_model.hpp"
#include "common/patch/scheme.hpp"

namespace palpate {

/// Schemes that a server offers, in the order of the names.
std::vector<Scheme> available_schemes();
/// Throws InputError, with their names, for another name. `also`: a further name that the caller accepts there.
Scheme available_scheme(const std::string& name, std::string_view also = {});
/// Schemes of these names, or all available ones if there are none.
std::vector<Scheme> schemes_named(const std::vector<std::string>& names);

struct LinkFlags {
  double rate_hz = 20, rtt_ms = 0, jitter_ms = 0, loss_pct = 0, burst = 0, compute_ms = 0;
  std::uint64_t seed = 1;

  /// This object must not move until the command line is parsed.
  void add_to(CLI::App& command);
  /// Adds the flags but --rtt-ms.
  void add_to_sweep(CLI::App& command);
  /// One-way link. Throws InputError for inconsistent numbers.
  LinkSpec one_way() const;
};

/// Options common to all replays: scheme of a server, states, link. Throws InputError for another scheme.
ReplayOptions replay_options(const std::string& scheme, int order, const LinkFlags& link);

}  // namespace palpate
