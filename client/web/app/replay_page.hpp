// A recording for browsers, each of which plays and scrubs for itself.
#pragma once

#include <map>
#include <string>

#include "client/viewer/recorded_scene.hpp"
#include "client/viewer/replay_clock.hpp"
#include "client/web/app/page.hpp"
#include "common/io/mapped_file.hpp"
#include "common/record/reader.hpp"

namespace palpate {

class ReplayPage final : public Page {
 public:
  /// Throws InputError when the file is no recording of a room with a body to draw.
  explicit ReplayPage(const std::string& file);

  Micros tick(WebServer& web, Micros now) override;
  void joined(BrowserId id) override;
  void said(BrowserId id, std::string_view text) override;
  void left(BrowserId id) override { browsers_.erase(id); }
  /// Returns a line for a person about missing parts; empty when nothing is missing.
  std::string damage() const;

 private:
  struct Watcher {
    ReplayClock clock;
    Micros shown = Micros::min();  ///< moment sent last
    std::uint32_t mesh = 0;        ///< version of the mesh sent last; 0: it has not been told anything yet
    bool sought = true;            ///< true: the plots begin anew
  };
  void greet(WebServer& web, BrowserId id);
  void show(WebServer& web, BrowserId id, Watcher& watcher);
  void say_room(WebServer& web, BrowserId id, const ReplayClock& clock, Micros now) const;

  MappedFile bytes_;
  RecordingReader recording_;
  RecordedScene scene_;
  std::map<BrowserId, Watcher> browsers_;
  Micros next_shape_{}, next_room_{};
  float unit_m_;
  Packet notes_, summary_;
};

}  // namespace palpate
