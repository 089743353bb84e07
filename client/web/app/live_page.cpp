#include "client/web/app/live_page.hpp"

#include <algorithm>

#include "client/viewer/status_line.hpp"
#include "common/io/monotonic.hpp"

namespace palpate {

LivePage::LivePage(const std::string& server, const std::string& station, const std::string& room, bool alike,
                   const std::optional<ClientKeys>& keys, std::uint16_t kbit_s)
    : link_(server, station, room, alike, keys) {
  core_.limit(kbit_s);
}

void LivePage::joined(BrowserId id) {
  browsers_.insert(id);
  fresh_.insert(id);
}

void LivePage::left(BrowserId id) {
  browsers_.erase(id);
  fresh_.erase(id);
}

void LivePage::renew_mesh() {
  mesh_version_ = core_.mesh_version();
  unit_m_ = shape_unit_m(core_.mesh().triangles, core_.rest());
  mesh_ = binary_packet(mesh_frame(core_.mesh(), core_.rest(), static_cast<std::uint32_t>(mesh_version_), unit_m_));
  fresh_ = browsers_;
}

PageState LivePage::state(Micros now) const {
  PageState state;
  state.heard = core_.heard_lately(now);
  state.t_s = seconds(shown_);
  if (core_.ready()) {
    state.title = core_.welcome().scene;
    state.status = status_line(core_, now);
    state.room = &core_.room();
    state.task = &core_.task();
  } else {
    state.title = "palpate";
    state.status = (link_.nobody_listens() ? "nothing listens at " : "waiting for ") + link_.server();
  }
  if (core_.link() == LinkState::refused) {
    state.status = core_.refusal();
    state.room = nullptr;
    state.task = nullptr;
  }
  return state;
}

Micros LivePage::tick(WebServer& web, Micros now) {
  link_.pump();
  if (now >= next_shape_) {
    next_shape_ = std::max(next_shape_ + kShapeEvery, now);
    ViewMoment moment;
    Packet shape;
    if (core_.show(now, moment)) {
      if (!core_.heard_lately(now)) moment.tools.clear();  // where they are, and what they feel, is unknown
      if (mesh_version_ != core_.mesh_version()) renew_mesh();
      if (moment.shape.body_time + History::kSpan < shown_) forces_ = {};  // another server's clock
      shown_ = moment.shape.body_time;
      for (const ToolView& tool : moment.tools) forces_.add(shown_, tool.station, static_cast<float>(tool.force.norm()));
      forces_.forget(shown_);
      shape = binary_packet(shape_frame(moment, core_.rest(), static_cast<std::uint32_t>(mesh_version_), unit_m_));
    }
    if (!fresh_.empty()) {
      const Packet hello = text_packet(hello_message({.program = kPageProgram})), history = text_packet(history_message(forces_));
      for (const BrowserId id : fresh_) {
        web.send(id, Slot::hello, hello);
        if (mesh_.bytes) web.send(id, Slot::mesh, mesh_);
        web.send(id, Slot::history, history);
      }
      next_room_ = now;
      fresh_.clear();
    }
    if (shape.bytes)
      for (const BrowserId id : browsers_) web.send(id, Slot::shape, shape);
  }
  if (now >= next_room_) {
    next_room_ = now + kRoomEvery;
    const Packet room = text_packet(room_message(state(now)));
    for (const BrowserId id : browsers_) web.send(id, Slot::room, room);
  }
  return std::min({next_shape_, next_room_, link_.deadline()});
}

}  // namespace palpate
