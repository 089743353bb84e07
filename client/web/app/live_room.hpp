// One room of a server for the browsers that watch it: a viewer in the room, and the messages made of what it receives.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "client/io/udp_viewer.hpp"
#include "client/viewer/history.hpp"
#include "client/web/app/page.hpp"

namespace palpate {

/// The part of a viewer's options that is the same in every room.
struct LiveSession {
  std::string server, station;
  bool alike = true;  ///< the server may assign a similar name
  std::optional<ClientKeys> keys;
  std::uint16_t kbit_s = 0;
};

class LiveRoom {
 public:
  static constexpr std::size_t kNotesMost = 200;  ///< the newest are listed

  /// `room`: its name; empty: the server's first. Throws InputError when the server's name does not parse or resolve.
  LiveRoom(const LiveSession& session, const std::string& room);

  /// Handles what is due and sends it. Returns the time of the next call; an earlier one does no harm.
  Micros tick(WebServer& web, Micros now);
  void add(BrowserId id);
  void remove(BrowserId id);
  /// Sends a note of a browser to the server, or lists it as refused.
  void write_note(const PageRequest& request);

  bool watched() const { return !browsers_.empty(); }
  /// The server's rooms; empty until they are known.
  const RoomList& rooms() const { return core_.rooms(); }

 private:
  void renew_mesh();
  void greet(WebServer& web, Micros now);
  void take_notes();
  void print_trouble();
  void list(PageNote note);
  void show_shape(WebServer& web, Micros now);
  PageState state(Micros now) const;

  UdpViewer link_;
  ViewCore& core_ = link_.core();
  std::set<BrowserId> browsers_, fresh_;  ///< fresh: those that have not been told anything yet
  History forces_;
  std::vector<PageNote> notes_;  ///< of this session, those that wait last
  bool notes_changed_ = false;
  Micros shown_{}, next_shape_{}, next_room_{};
  std::uint64_t mesh_version_ = 0;
  float unit_m_ = 0;
  Packet mesh_, parts_;
  std::uint64_t parts_version_ = 0;
  std::string printed_;  ///< newest refusal, or reason of silence, as it was printed
};

}  // namespace palpate
