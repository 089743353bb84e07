// A room's recording made from what a viewer receives: every shape, tools once a frame, links and costs as the panels show them.
//
// It differs from the server's own: no scene, vertices numbered as viewers are sent them and right to 0.04 mm, samples of tools
// only once a frame, no count of datagrams, patches without their size. Times are the server's clock.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/view/view_core.hpp"
#include "common/record/writer.hpp"

namespace palpate {

class ViewRecorder {
 public:
  /// `core` is ready(); `unix_time` is now on the wall clock.
  ViewRecorder(const ViewCore& core, const std::string& program, Micros unix_time);

  /// What came since the last time. Call at least every few frames: a playback keeps sixteen.
  void take(const ViewCore& core, Micros now);
  void finish() { writer_.finish(); }
  /// Bytes of the file that were not taken yet.
  std::vector<std::byte> bytes() { return writer_.take(); }
  /// The body has become another one, which this recording cannot hold.
  bool outlived(const ViewCore& core) const { return core.mesh_version() != mesh_version_; }

 private:
  static constexpr Micros kLinksEvery{250'000};

  void take_tools(const Tools& tools, const RoomView& room);
  void take_links(const RoomView& room);
  StationId station(const std::string& name, const RoomView& room);

  std::uint64_t mesh_version_;
  RecordingWriter writer_;
  std::map<std::string, StationId> stations_;   ///< that are here
  std::map<StationId, std::uint32_t> buttons_;  ///< that were pressed last
  StationId stations_ever_ = 0;
  Micros shape_until_ = Micros::min(), tools_until_ = Micros::min(), next_links_ = Micros::min();
};

}  // namespace palpate
