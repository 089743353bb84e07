// Whether a link and a machine serve: a trial of some seconds over the real sockets, with the real haptic loop, in numbers and
// words.
//
// The trial joins as a viewer, so that nobody in the room feels it, and sends what a station would: samples at its pace. What
// comes back (tools, shapes, beats after every frame) measures round trips and losses; the server says how the datagrams to it
// fare; the loop says how late this machine is.
//
// Expected age of patches: a patch holds the body as the tool's newest samples made it one round trip ago, and is used until the
// next frame's: from the median round trip to the 99 % one and a frame. What the server computes comes on top.
#pragma once

#include <atomic>
#include <optional>
#include <string>
#include <vector>

#include "common/base/types.hpp"
#include "common/trust/client_channel.hpp"

namespace palpate {

struct LossFigures {
  double share = 0;     ///< of the datagrams that did not come
  int longest_run = 0;  ///< datagrams
};

struct LinkFigures {
  bool joined = false;
  std::string refusal;  ///< why not, when the server said so
  double rate_hz = 0;   ///< the server's frames
  std::uint64_t round_trips = 0;
  double rtt_p50_ms = 0, rtt_p99_ms = 0;
  double spread_ms = 0;  ///< 99 % round trip beyond the shortest
  double jitter_ms = 0;  ///< mean change from one round trip to the next (clock_sync.hpp), as client and viewer show it
  LossFigures up, down;
  double datagrams_down_s = 0;                  ///< from the server, a second
  std::uint64_t reordered = 0, duplicated = 0;  ///< of those from the server
  double uplink_kbit_s = 0, downlink_kbit_s = 0;
  std::uint64_t ticks = 0, late_ticks = 0, skipped_ticks = 0;  ///< late: by more than 0.2 ms
  double lateness_p99_ms = 0;

  double frame_ms() const { return rate_hz > 0 ? 1e3 / rate_hz : 0; }
  double youngest_patch_ms() const { return rtt_p50_ms; }
  double oldest_patch_ms() const { return rtt_p99_ms + frame_ms(); }
};

struct LinkVerdict {
  bool link_serves = false, machine_serves = false;
  std::vector<std::string> words;  ///< what was found, and what to set; a line each
  bool serves() const { return link_serves && machine_serves; }
};

/// `server` is HOST:PORT (InputError when it is not). Ends early once `stop` is set.
LinkFigures measure_link(const std::string& server, const std::string& station, Micros duration, bool realtime,
                         const std::atomic<bool>& stop, const std::optional<ClientKeys>& keys = {});
LinkVerdict judge(const LinkFigures& figures);
/// The numbers as a table.
std::string describe(const LinkFigures& figures);

}  // namespace palpate
