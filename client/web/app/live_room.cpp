#include "client/web/app/live_room.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "client/viewer/status_line.hpp"
#include "common/base/limits.hpp"
#include "common/base/plain_text.hpp"

namespace palpate {
namespace {

/// Returns the reason for which a note cannot be sent; empty if it can.
std::string fault_of(const PageRequest& note) {
  if (note.author.size() > static_cast<std::size_t>(kMaxNameBytes) || !is_plain_name(note.author))
    return fmt::format("a name has at most {} bytes of {}", kMaxNameBytes, kNameCharacters);
  if (note.text.size() > kMaxNoteBytes || !is_plain_text(note.text))
    return fmt::format("a note has at most {} bytes of UTF-8 on one line, without characters that cannot be seen", kMaxNoteBytes);
  return {};
}

}  // namespace

LiveRoom::LiveRoom(const LiveSession& session, const std::string& room)
    : link_(session.server, session.station, room, session.alike, session.keys) {
  core_.limit(session.kbit_s);
}

void LiveRoom::add(BrowserId id) {
  browsers_.insert(id);
  fresh_.insert(id);
}

void LiveRoom::remove(BrowserId id) {
  browsers_.erase(id);
  fresh_.erase(id);
}

void LiveRoom::list(PageNote note) {
  if (notes_.size() >= kNotesMost) notes_.erase(notes_.begin());
  notes_.push_back(std::move(note));
  notes_changed_ = true;
}

void LiveRoom::write_note(const PageRequest& request) {
  PageNote note{request.value, request.author, request.text};
  note.refusal = fault_of(request);
  if (!note.refusal.empty()) {
    note.author.clear();
    note.text.clear();
  } else if (note.author.empty()) {
    note.author = core_.welcome().station;
  }
  constexpr double kMostS = 1e9;
  const Micros at = from_seconds(std::clamp(request.value, -kMostS, kMostS));
  if (note.refusal.empty() && !core_.write_note({0, at, request.author, request.text}))
    note.refusal = "the server is not there, or too many notes wait for it";
  note.waiting = note.refusal.empty();
  list(std::move(note));
}

/// Notes end in the order in which they were written.
void LiveRoom::take_notes() {
  for (const NoteOutcome& outcome : core_.take_note_outcomes()) {
    const auto first = std::find_if(notes_.begin(), notes_.end(), [](const PageNote& note) { return note.waiting; });
    notes_changed_ = true;
    if (first == notes_.end()) continue;
    first->waiting = false;
    first->refusal = outcome.refusal;
  }
}

void LiveRoom::print_trouble() {
  std::string trouble;
  if (core_.link() == LinkState::refused) trouble = link_.server() + " refuses: " + core_.refusal();
  if (link_.unanswered()) trouble = link_.no_answer();
  if (trouble != printed_ && !trouble.empty()) fmt::print(stderr, "palpate-web: {}\n", trouble);
  if (core_.link() == LinkState::joined || !trouble.empty()) printed_ = trouble;
}

void LiveRoom::renew_mesh() {
  mesh_version_ = core_.mesh_version();
  unit_m_ = shape_unit_m(core_.mesh().triangles, core_.rest());
  mesh_ = binary_packet(mesh_frame(core_.mesh(), core_.rest(), static_cast<std::uint32_t>(mesh_version_), unit_m_));
  fresh_ = browsers_;
}

PageState LiveRoom::state(Micros now) const {
  PageState state;
  state.heard = core_.heard_lately(now);
  state.t_s = seconds(shown_);
  state.rooms = &core_.rooms();
  if (core_.ready()) {
    state.title = core_.welcome().scene;
    state.status = status_line(core_, now);
    state.room = &core_.room();
    state.task = &core_.task();
  } else {
    state.title = "palpate";
    state.status = link_.unanswered() ? link_.no_answer() : "waiting for " + link_.server();
  }
  if (core_.link() == LinkState::refused) {
    state.status = core_.refusal();
    state.refused = true;
    state.room = nullptr;
    state.task = nullptr;
  }
  return state;
}

void LiveRoom::greet(WebServer& web, Micros now) {
  if (fresh_.empty()) return;
  const Packet hello = text_packet(hello_message({.program = kPageProgram})), history = text_packet(history_message(forces_));
  for (const BrowserId id : fresh_) {
    web.send(id, Slot::hello, hello);
    if (mesh_.bytes) web.send(id, Slot::mesh, mesh_);
    if (parts_.bytes) web.send(id, Slot::parts, parts_);
    web.send(id, Slot::history, history);
  }
  next_room_ = now;
  notes_changed_ = true;
  fresh_.clear();
}

void LiveRoom::show_shape(WebServer& web, Micros now) {
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
  if (std::exchange(parts_version_, core_.parts_version()) != core_.parts_version()) {
    parts_ = binary_packet(parts_frame(core_.parts()));
    for (const BrowserId id : browsers_) web.send(id, Slot::parts, parts_);
  }
  greet(web, now);
  if (shape.bytes)
    for (const BrowserId id : browsers_) web.send(id, Slot::shape, shape);
}

Micros LiveRoom::tick(WebServer& web, Micros now) {
  link_.pump();
  take_notes();
  print_trouble();
  if (now >= next_shape_) {
    next_shape_ = std::max(next_shape_ + kShapeEvery, now);
    show_shape(web, now);
  }
  if (now >= next_room_) {
    next_room_ = now + kRoomEvery;
    const Packet room = text_packet(room_message(state(now)));
    for (const BrowserId id : browsers_) web.send(id, Slot::room, room);
  }
  if (std::exchange(notes_changed_, false)) {
    const Packet notes = text_packet(notes_message(notes_));
    for (const BrowserId id : browsers_) web.send(id, Slot::notes, notes);
  }
  return std::min({next_shape_, next_room_, link_.deadline()});
}

}  // namespace palpate
