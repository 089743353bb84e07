// The mouse as a station: its own session with the server, its own 1 kHz loop, beside the viewer's.
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
  static constexpr const char* kName = "mouse";  ///< which gets a number where another has it
  /// Throws InputError when the server's name is not HOST:PORT or does not resolve.
  TouchStation(const std::string& server, const std::string& station, const std::string& room,
               const std::optional<ClientKeys>& keys = {});
  ~TouchStation();

  /// Starts the loop once the server has let us in. Call often.
  void poll();
  bool touching() const { return loop_ != nullptr; }
  /// Where the tool is to go; nothing before touching().
  void aim(const Vec3& target);
  /// The tool as it is now, without the delay of shapes. Meaningful when touching().
  const ToolView& tool() const { return tool_; }
  /// What the patch in use said of the frame last passed at `moment`; nullptr when there is none.
  const Foresight* foresight(Micros moment);
  /// Why the server does not let us in; empty while it may.
  std::string refusal() const;
  /// A line about the loop. After the window has closed.
  std::string summary();

 private:
  ClientCore core_;
  PatchPairs pairs_;                ///< of the network thread
  LatestSlot<PatchPair> followed_;  ///< from there to the window's
  Foresights foresights_;
  UdpClient udp_;
  std::unique_ptr<MouseDevice> mouse_;
  std::unique_ptr<HapticLoop> loop_;
  ToolView tool_;
};

}  // namespace palpate
