// A room's recording from the datagrams that a viewer receives: every shape, tools once a frame, links and costs as in the
// panels.
//
// Differences from the server's own recording: no scene, vertices in the viewers' numbering and accurate to 0.04 mm, samples of
// tools only once a frame, no count of datagrams, no size of patches. Times are on the server's clock.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/viewer/view_core.hpp"
#include "common/record/writer.hpp"

namespace palpate {

class ViewRecorder {
 public:
  /// `core` is ready() and has all parts; `unix_time`: the current time of the wall clock.
  ViewRecorder(const ViewCore& core, const std::string& program, Micros unix_time);

  /// Records everything since the last call. Call at least every few frames: a playback keeps sixteen.
  void take(const ViewCore& core, Micros now);
  void finish() { writer_.finish(); }
  /// Returns the bytes of the file that were not returned yet.
  std::vector<std::byte> bytes() { return writer_.take(); }
  /// True when the mesh is that of another body, or not all there: this recording cannot hold it.
  bool outlived(const ViewCore& core) const {
    return core.welcome().mesh_hash != mesh_hash_ || core.mesh().vertices.size() < vertices_;
  }

 private:
  static constexpr Micros kLinksEvery{250'000};

  void take_tools(const Tools& tools, const RoomView& room);
  void take_links(const RoomView& room);
  StationId station(const std::string& name, const RoomView& room);

  std::uint64_t mesh_version_, mesh_hash_;
  std::size_t vertices_;
  RecordingWriter writer_;
  std::map<std::string, StationId> stations_;   ///< stations that are present
  std::map<StationId, std::uint32_t> buttons_;  ///< buttons pressed last
  StationId stations_ever_ = 0;
  Micros shape_until_ = Micros::min(), tools_until_ = Micros::min(), next_links_ = Micros::min();
};

}  // namespace palpate
