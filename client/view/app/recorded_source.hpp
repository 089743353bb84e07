// A recording for the viewer: its scene, the clock that plays it and its bar.
#pragma once

#include <string>

#include "client/view/app/view_source.hpp"
#include "client/viewer/recorded_scene.hpp"
#include "client/viewer/replay_clock.hpp"
#include "common/io/mapped_file.hpp"

namespace palpate {

class RecordedSource : public ViewSource {
 public:
  /// Starts paused at the beginning. Throws InputError when the file is no recording of a room with a body to draw.
  explicit RecordedSource(const std::string& file);

  void pump_until(Micros time) override;
  bool ready() const override { return true; }
  const BodyMesh& mesh() const override { return scene_.mesh(); }
  const std::vector<Vec3f>& rest() const override { return scene_.rest(); }
  std::uint64_t mesh_version() const override { return scene_.mesh_version(); }
  std::span<const BodyName> bodies() const override { return scene_.bodies(); }
  std::span<const PartMesh> parts() const override { return scene_.parts(); }
  std::uint64_t parts_version() const override { return 1; }
  bool show(Micros now, ViewMoment& moment) override;
  const ToolShape& tool_shape(const std::string& station) const override { return shape_held(room_, station); }
  /// Selects a channel. Only displacement is recorded: the status line reports that for other channels.
  void show_channel(ShapeChannel channel) override { channel_ = channel; }
  Scales scales() const override;
  Hues hues() const override { return Hues(scene_.hands()); }
  Caption caption(Micros now, const std::vector<ToolView>&) override;

  ReplayClock& clock() { return clock_; }
  /// Starts `at_s` seconds after the beginning of the recording. Throws InputError when it has ended by then.
  void begin_at(double at_s);
  ReplayState state(Micros now) const;
  /// Steps by frames from the moment shown, and pauses.
  void step(int frames, Micros now);
  /// Returns a line for a person about missing parts; empty when nothing is missing.
  std::string damage() const;

 private:
  MappedFile bytes_;
  RecordingReader recording_;
  RecordedScene scene_;
  ReplayClock clock_;
  ShapeChannel channel_ = ShapeChannel::position;
  RoomView room_;
  TaskWatch task_;
  History forces_, patch_ages_;
};

}  // namespace palpate
