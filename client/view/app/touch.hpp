// The mouse as a station: a session with the server and a 1 kHz loop of its own, separate from the viewer's.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "client/core/client_core.hpp"
#include "client/device/mouse_device.hpp"
#include "client/io/haptic_loop.hpp"
#include "client/io/udp_client.hpp"
#include "client/view/foresight.hpp"

namespace palpate {

class TouchStation {
 public:
  static constexpr const char* kName = "mouse";  ///< gets a number appended where the name is in use
  /// Throws InputError when the server's name is not HOST:PORT or does not resolve.
  /// `guides`: station that the mouse guides; empty: none. `tool`: name of the tool that it holds; empty: the scene's first.
  TouchStation(const std::string& server, const std::string& station, const std::string& room,
               const std::optional<ClientKeys>& keys = {}, const std::string& guides = {}, const std::string& tool = {});
  ~TouchStation();

  /// Starts the loop once the server has admitted the station. Call often.
  void poll();
  bool touching() const { return loop_ != nullptr; }
  /// Sets the target of the tool; no effect before touching().
  void aim(const Vec3& target);
  /// Presses the tool's button for a moment: marks a place.
  void click();
  /// The tool as it is now, without the delay of shapes. Valid when touching().
  const ToolView& tool() const { return tool_; }
  /// Returns the prediction of the patch in use for the frame last passed at `moment`; nullptr when there is none.
  const Foresight* foresight(Micros moment);
  /// Reason for which the server refuses the station; empty otherwise.
  std::string refusal() const;
  /// True while the server keeps the mouse's tool off the body, because it cost too much.
  bool released() const { return udp_.status().tool_released; }
  /// Returns a line about the loop. After the window has closed.
  std::string summary();

 private:
  ClientCore core_;
  PatchPairs pairs_;                ///< owned by the network thread
  LatestSlot<PatchPair> followed_;  ///< hand-off from there to the window's thread
  Foresights foresights_;
  UdpClient udp_;
  std::unique_ptr<MouseDevice> mouse_;
  std::unique_ptr<HapticLoop> loop_;
  ToolView tool_;
};

}  // namespace palpate
