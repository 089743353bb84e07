// A server's state as Prometheus metrics, and its health.
//
// docs/reference/operation.md lists the names, the labels and the meaning of each. They follow
// https://prometheus.io/docs/practices/naming/: base units, _total for values that only grow, labels of few values (a room, a
// reason), never a station's name or address.
//
//     well    the network loop turned less than kLoopMost before `now`, no frame has been computed for longer than kFrameMost
//     ready   well, its scenes are loaded, and newcomers are let in
#pragma once

#include <prometheus/metric_family.h>

#include <optional>
#include <string>
#include <vector>

#include "server/io/server_state.hpp"

namespace palpate {

inline constexpr Micros kLoopMost{2'000'000}, kFrameMost{5'000'000};

/// `version` is that of the program.
std::vector<prometheus::MetricFamily> metrics_of(const ServerState& state, const std::string& version);

/// Returns the reason why the server is not well (ready), in a line; empty if it is. Without a state the scenes are still being
/// loaded: well, but not ready.
std::optional<std::string> not_well(const std::optional<ServerState>& state, Micros now);
std::optional<std::string> not_ready(const std::optional<ServerState>& state, Micros now);

}  // namespace palpate
