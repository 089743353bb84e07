// Permissions of a key or of a token.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

inline constexpr int kStreamsUsual = 8;  ///< per key: stations and viewers at the same time
inline constexpr int kKbitUsual = 900;   ///< data rate of shapes for a viewer, kbit/s
inline constexpr int kMostStreams = 64, kMostKbit = 65535;
inline constexpr std::size_t kMostRoomsNamed = 16;
/// Separators between a name and a station's suffix. Not a view of a literal: each object file has a literal of its own, and the
/// two ends of a loop over it need not be of the same.
inline constexpr std::array<char, 2> kAfterName{'-', '/'};

struct Rights {
  std::string name;  ///< name of its stations, alone or followed by one of kAfterName and a suffix
  bool hand = false, viewer = false;
  std::vector<std::string> rooms = {};  ///< empty: any room
  int kbit_s = kKbitUsual;
  int streams = kStreamsUsual;
  bool guide = false;  ///< a hand of this key may guide the tools of others
  bool note = false;   ///< a viewer of this key may write notes into the recording

  bool operator==(const Rights&) const = default;
  /// True for the name itself and with a suffix: "OR 3" has "OR 3", "OR 3-2" and "OR 3/port".
  bool has_name(std::string_view station) const {
    if (!station.starts_with(name)) return false;
    return station.size() == name.size() || std::ranges::find(kAfterName, station[name.size()]) != kAfterName.end();
  }
};

}  // namespace palpate
