// The command line of palpate-view.
#pragma once

#include <optional>
#include <string>

#include "client/view/camera.hpp"
#include "client/view/sight.hpp"
#include "common/trust/client_channel.hpp"

namespace palpate {

struct ViewOptions {
  std::string server, station = "viewer", room;
  std::string key, token;          ///< files; empty: none
  std::optional<ClientKeys> keys;  ///< contents of these files
  bool station_given = false;      ///< false: the server may assign a similar name
  std::string recording;           ///< file to play instead of joining a server; empty: none
  int width = 1280, height = 800;
  std::string touch;                       ///< name of the mouse's station; empty: view only
  std::string guide;                       ///< station that the mouse guides; empty: none
  std::string tool;                        ///< name of the tool that the mouse holds; empty: the scene's first
  std::string screenshot, frames, record;  ///< empty: none
  std::optional<double> after_s, duration_s;
  double at_s = 0;  ///< start time in the recording
  double fps = 30;
  std::uint16_t kbit_s = 0;
  Look look;
  Camera camera;  ///< at first
  bool offscreen() const { return !screenshot.empty() || !frames.empty(); }
};

}  // namespace palpate
