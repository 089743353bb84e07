// Messages from palpate-web to the page in a browser (client/web/page/protocol.ts reads them; docs/reference/web.md has the
// bytes).
//
// A shape's frame stands alone: a browser that missed all earlier ones draws it right, so a slow browser gets the newest one in
// place of a queue. Displacements from rest are whole multiples of the unit (shape_unit_m()), in blocks of 64 vertices
// (common/wire/shape_blocks.hpp); blocks that are at rest are left out. Little-endian.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "client/viewer/history.hpp"
#include "client/viewer/view_core.hpp"

namespace palpate {

/// Unit of displacements [m]: 2^-13 of the diagonal of the body at rest, 18 um for a body of 150 mm.
float shape_unit_m(std::span<const Triangle> triangles, std::span<const Eigen::Vector3f> rest);

/// Returns the topology and the positions at rest [m, single precision].
std::string mesh_frame(const BodyMesh& mesh, std::span<const Eigen::Vector3f> rest, std::uint32_t version, float unit_m);

/// Returns the rigid parts of the scene.
std::string parts_frame(std::span<const PartMesh> parts);

/// Returns shape and tools of a moment. `rest`: those of the mesh_frame() of this version. `unit_m` > 0.
std::string shape_frame(const ViewMoment& moment, std::span<const Eigen::Vector3f> rest, std::uint32_t version, float unit_m);

/// State of the source as its line of text says it, and of the page's clock.
struct PageState {
  std::string title, status;
  bool live = true;            ///< false: a recording
  bool heard = true;           ///< false: the figures are out of date and omitted
  bool refused = false;        ///< true: the server refuses, for the reason in `status`
  bool late_known = true;      ///< true: the number of late ticks is known
  double t_s = 0;              ///< time of the moment shown, that of shape_frame()
  double speed = 1;            ///< of a recording
  bool playing = true;         ///< false: a recording is paused
  const RoomView* room = {};   ///< null: unknown
  const RoomList* rooms = {};  ///< the server's; null, or without names: this one alone
  const TaskWatch* task = {};  ///< null, or without a task: none
};
/// Returns the stations, their links, the body's figures and the training task, as JSON of type "room". The place of a lump that
/// is to be found is part of it: the page is for an instructor.
std::string room_message(const PageState& state);

/// A note as the page lists it.
struct PageNote {
  double t_s = 0;  ///< moment that it is about, in the time of PageState
  std::string author, text;
  std::string refusal = {};  ///< reason for which it was not recorded
  bool waiting = false;      ///< true: neither recorded nor refused yet
};
/// Returns the notes as JSON of type "notes".
std::string notes_message(std::span<const PageNote> notes);

/// Returns the plots of the last History::kSpan as JSON of type "history".
std::string history_message(const History& forces);

/// Contents of the first message to a browser.
struct PageGreeting {
  std::string program;  ///< name and version
  bool live = true;     ///< false: a recording, with these:
  double begin_s = 0, end_s = 0, period_s = 0.05;
  std::vector<float> course = {};       ///< RecordedScene::course()
  std::vector<std::string> hands = {};  ///< RecordedScene::hands(): they have the marks that a live page gave them
  float force_max_n = 0, displacement_max_m = 0;
};
/// Returns the viewer's colours and the extent of a recording, as JSON of type "hello".
std::string hello_message(const PageGreeting& greeting);

/// A request of a browser.
struct PageRequest {
  enum class Kind : std::uint8_t { none, seek, play, pause, speed, step, room, note };
  Kind kind = Kind::none;
  double value = 0;         ///< seek, note: time [s]; speed: doublings; step: frames
  std::string text = {};    ///< room: its name; note: its words
  std::string author = {};  ///< of a note
};
/// Returns kind none for a text that is no request, or whose value is no finite number.
PageRequest read_request(std::string_view text);

}  // namespace palpate
