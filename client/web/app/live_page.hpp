// A server's room for browsers: palpate-web is one viewer of the server, however many browsers look.
#pragma once

#include <optional>
#include <set>
#include <string>

#include "client/io/udp_viewer.hpp"
#include "client/viewer/history.hpp"
#include "client/web/app/page.hpp"

namespace palpate {

class LivePage final : public Page {
 public:
  /// Throws InputError when the server's name does not parse or resolve. `alike`: the server may assign a similar name.
  LivePage(const std::string& server, const std::string& station, const std::string& room, bool alike,
           const std::optional<ClientKeys>& keys, std::uint16_t kbit_s);

  Micros tick(WebServer& web, Micros now) override;
  void joined(BrowserId id) override;
  void said(BrowserId, std::string_view) override {}
  void left(BrowserId id) override;

 private:
  void renew_mesh();
  PageState state(Micros now) const;

  UdpViewer link_;
  ViewCore& core_ = link_.core();
  std::set<BrowserId> browsers_, fresh_;  ///< fresh: those that have not been told anything yet
  History forces_;
  Micros shown_{}, next_shape_{}, next_room_{};
  std::uint64_t mesh_version_ = 0;
  float unit_m_ = 0;
  Packet mesh_;
};

}  // namespace palpate
