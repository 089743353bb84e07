// State of a running server as plain figures: made on its network thread, read by others as a copy.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "common/trust/server_channel.hpp"
#include "server/core/server_core.hpp"
#include "server/core/station_links.hpp"

namespace palpate {

enum class RecordingState : std::uint8_t { off, on, failed };

struct RoomState {
  std::string name;
  bool ended = false;      ///< true if its body failed
  double rate_hz = 0;      ///< configured frame rate
  Pace pace;               ///< pace that it achieves
  double core_share = 1;   ///< share of a core that its frames got lately
  Micros computing_for{};  ///< time since the frame being computed began, 0: there is none
  int hands = 0, shadows = 0, viewers = 0;
  ServerCounts counts;
  StationLinks links;
  RecordingState recording = RecordingState::off;
  std::uint64_t recorded_bytes = 0;
};

/// Datagrams as sent over the network: sealed if there are keys.
struct TrafficCounts {
  std::uint64_t datagrams_in = 0, bytes_in = 0, datagrams_out = 0, bytes_out = 0;
  std::uint64_t send_failed = 0;                                   ///< part of datagrams_out
  std::uint64_t bytes_from_strangers = 0, bytes_to_strangers = 0;  ///< from and to peers with an unproved address
};

struct ServerState {
  Micros at{};  ///< monotonic clock
  bool draining = false;
  std::vector<RoomState> rooms;
  TrafficCounts traffic;
  std::optional<ServerChannelCounts> channel;  ///< set if there are keys
  std::size_t sessions = 0;                    ///< sessions of the channel
};

}  // namespace palpate
