// The command line of palpate-view.
#pragma once

#include <optional>
#include <string>

#include "client/view/sight.hpp"
#include "common/trust/client_channel.hpp"

namespace palpate {

struct ViewOptions {
  std::string server, station = "viewer", room;
  std::string key, token;          ///< files; empty: none
  std::optional<ClientKeys> keys;  ///< what they hold
  bool station_given = false;      ///< otherwise a name like it will do
  std::string recording;           ///< in place of a server; empty: none
  int width = 1280, height = 800;
  std::string touch;                       ///< name of the mouse's station; empty: look only
  std::string screenshot, frames, record;  ///< empty: none
  std::optional<double> after_s, duration_s;
  double at_s = 0;  ///< of the recording
  double fps = 30;
  std::uint16_t kbit_s = 0;
  Look look;
  bool offscreen() const { return !screenshot.empty() || !frames.empty(); }
};

}  // namespace palpate
