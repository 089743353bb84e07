// What a running server knows of itself, as plain figures: made on its network thread, read by others as a copy.
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
  bool ended = false;      ///< its body failed
  double rate_hz = 0;      ///< as asked for
  Pace pace;               ///< what there is time for
  double core_share = 1;   ///< that frames got lately
  Micros computing_for{};  ///< how long the frame that is out has been so, 0: none is
  int hands = 0, shadows = 0, viewers = 0;
  ServerCounts counts;
  StationLinks links;
  RecordingState recording = RecordingState::off;
  std::uint64_t recorded_bytes = 0;
};

/// Datagrams as they go over the network: sealed, where there are keys.
struct TrafficCounts {
  std::uint64_t datagrams_in = 0, bytes_in = 0, datagrams_out = 0, bytes_out = 0;
  std::uint64_t send_failed = 0;                                   ///< of those out
  std::uint64_t bytes_from_strangers = 0, bytes_to_strangers = 0;  ///< who has not shown yet that it receives at its address
};

struct ServerState {
  Micros at{};  ///< monotonic clock
  bool draining = false;
  std::vector<RoomState> rooms;
  TrafficCounts traffic;
  std::optional<ServerChannelCounts> channel;  ///< where there are keys
  std::size_t sessions = 0;                    ///< of the channel
};

}  // namespace palpate
