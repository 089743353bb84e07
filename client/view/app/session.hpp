// A server's room for the viewer: ViewCore on a real UDP socket and the real clock (client/io/udp_viewer.hpp), with what the
// window says about it, and its recording. One thread; the caller pumps it.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "client/io/udp_viewer.hpp"
#include "client/view/app/view_source.hpp"
#include "client/view/app/viewer_recording.hpp"

namespace palpate {

/// Monotonic time of this process's clock.
Micros now_us();

class ViewSession : public ViewSource {
 public:
  /// The arguments of UdpViewer. Throws what it throws.
  ViewSession(const std::string& server, const std::string& station, const std::string& room, bool alike,
              const std::optional<ClientKeys>& keys = {}, NameLookup::Ask ask = {});
  ~ViewSession() override;

  /// Handles everything that is due, the recording included. Never blocks.
  void pump();
  void pump_until(Micros time) override;

  bool ready() const override { return core().ready(); }
  const BodyMesh& mesh() const override { return core().mesh(); }
  const std::vector<Vec3f>& rest() const override { return core().rest(); }
  std::uint64_t mesh_version() const override { return core().mesh_version(); }
  std::span<const BodyName> bodies() const override { return core().room().bodies; }
  std::span<const PartMesh> parts() const override { return core().parts(); }
  std::uint64_t parts_version() const override { return core().parts_version(); }
  /// Shows no tools while the server is silent: their positions and forces are unknown then.
  bool show(Micros now, ViewMoment& moment) override;
  const ToolShape& tool_shape(const std::string& station) const override { return shape_held(core().room(), station); }
  void show_channel(ShapeChannel channel) override { core().show_channel(channel); }
  Scales scales() const override { return {}; }
  Hues hues() const override { return {}; }
  Caption caption(Micros now, const std::vector<ToolView>& tools) override;

  /// Records to this file as soon as there is a body. Throws InputError when the file exists already.
  void record(const std::string& file);
  /// Begins a recording in the current folder, or ends the current one. The status line shows the result.
  void toggle_recording();

  ViewCore& core() { return udp_.core(); }
  const ViewCore& core() const { return udp_.core(); }
  const std::string& server() const { return udp_.server(); }
  bool unanswered() const { return udp_.unanswered(); }
  std::string no_answer() const { return udp_.no_answer(); }

 private:
  void pump_recording();
  void remember(Micros now, const std::vector<ToolView>& tools);

  UdpViewer udp_;
  History forces_, patch_ages_;
  std::unique_ptr<ViewerRecording> recording_;
  std::string record_asked_;  ///< file that waits for a body
  std::string record_note_;   ///< note about the recording for the status line
};

/// Installs handlers: SIGINT and SIGTERM ask for the end.
void watch_signals();
bool stop_requested();

}  // namespace palpate
