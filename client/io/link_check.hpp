// Tests a link and a machine: a trial of some seconds with the real sockets and the real haptic loop, reported in numbers and
// words.
//
// The trial joins as a viewer, so that it does not disturb the room, and sends the traffic of a station: samples at its pace. The
// replies (tools, shapes, beats after every frame) measure round trips and losses; the server reports the losses of the datagrams
// that it receives; the loop reports how late this machine is.
//
// Expected age of patches: a patch describes the body under the tool samples of one round trip ago, and is used until the next
// frame's: from the median round trip to the 99 % one plus a frame. The server's computing time is added to that.
#pragma once

#include <atomic>
#include <optional>
#include <string>
#include <vector>

#include "common/base/types.hpp"
#include "common/trust/client_channel.hpp"

namespace palpate {

struct LossFigures {
  double share = 0;     ///< share of lost datagrams
  int longest_run = 0;  ///< longest run of lost datagrams
};

struct LinkFigures {
  bool joined = false;
  std::string refusal;                  ///< reason, if the server gave one
  std::string no_answer = "no answer";  ///< no_answer_text() of a server that did not answer
  double rate_hz = 0;                   ///< frame rate of the server
  std::uint64_t round_trips = 0;
  double rtt_p50_ms = 0, rtt_p99_ms = 0;
  double spread_ms = 0;  ///< 99 % round trip minus the shortest
  double jitter_ms = 0;  ///< mean change between successive round trips (clock_sync.hpp), as shown by client and viewer
  LossFigures up, down;
  double datagrams_down_s = 0;                  ///< datagrams from the server per second
  std::uint64_t reordered = 0, duplicated = 0;  ///< among those from the server
  double uplink_kbit_s = 0, downlink_kbit_s = 0;
  std::uint64_t ticks = 0, late_ticks = 0, skipped_ticks = 0;  ///< late: by more than 0.2 ms
  double lateness_p99_ms = 0;

  double frame_ms() const { return rate_hz > 0 ? 1e3 / rate_hz : 0; }
  double youngest_patch_ms() const { return rtt_p50_ms; }
  double oldest_patch_ms() const { return rtt_p99_ms + frame_ms(); }
};

struct LinkVerdict {
  bool link_serves = false, machine_serves = false;
  std::vector<std::string> words;  ///< findings and recommended settings, one line each
  bool serves() const { return link_serves && machine_serves; }
};

/// Runs the trial. `server` is HOST:PORT (InputError when it is not). Ends early once `stop` is set.
LinkFigures measure_link(const std::string& server, const std::string& station, Micros duration, bool realtime,
                         const std::atomic<bool>& stop, const std::optional<ClientKeys>& keys = {});
LinkVerdict judge(const LinkFigures& figures);
/// Returns the numbers as a table.
std::string describe(const LinkFigures& figures);

}  // namespace palpate
