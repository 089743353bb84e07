// The contents of a recording, as plain structs. docs/reference/recording.md describes the file.
//
// There are two kinds. A room's is made at the server, in the server's clock: the input samples of the body, the frames, the
// contacts of every tool, links and shapes. A station's is made at the client, in the client's clock: every haptic tick and every
// patch as received. SI units, frame W; forces act on the tool.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/tool_pose.hpp"
#include "common/base/tool_shape.hpp"
#include "common/base/types.hpp"
#include "common/patch/needle_in_body.hpp"
#include "common/patch/patch.hpp"
#include "common/task/task.hpp"
#include "common/wire/messages.hpp"

namespace palpate {

enum class RecordingKind : std::uint8_t { room, station };

/// The recorded vertices of a body: those of its triangles; all of a body without triangles.
struct RecordedSurface {
  std::uint32_t body_vertices = 0, body_nodes = 0;
  std::uint64_t mesh_hash = 0;       ///< as in Welcome
  std::vector<std::uint32_t> nodes;  ///< indices of the recorded vertices in the body, ascending
  std::vector<Vec3> rest;            ///< rest positions of these from the scene, before gravity
  std::vector<Triangle> triangles;   ///< indices into `nodes`
  std::vector<std::uint8_t> marks;   ///< mark_of() each of these
};

struct RecordingHead {
  RecordingKind kind = RecordingKind::room;
  std::string program;                ///< program and version
  std::string name;                   ///< name of the room or station
  Micros unix_time{}, clock_time{};   ///< one moment: microseconds since 1970 (UTC), and in the recording's clock
  double rate_hz = 0, shapes_hz = 0;  ///< frames or ticks, shapes a second as requested
  std::string scene;                  ///< JSON with all defaults; empty in a station's recording
  std::string scene_file;             ///< paths inside the scene are relative to it
  RecordedSurface surface;            ///< only in a room's recording
  std::optional<Task> task = {};      ///< of a room, the training task that its scene states
  ToolShape tool = {};                ///< of a room, the body of its scene's first tool; empty: a point
  std::vector<PartMesh> parts = {};   ///< of a room, the rigid parts of its scene
  std::vector<BodyName> bodies = {};  ///< of a room whose scene has several
};

/// The samples of a tool that were passed to a frame, at their original resolution, each once.
struct RecordedPath {
  StationId station = 0;
  std::vector<ToolSample> samples;
};

struct RecordedFrame {
  Micros t{};                 ///< body time at its end
  Micros took{}, behind{};    ///< computing time; age of the body's state when it was ready
  std::uint32_t skipped = 0;  ///< frames skipped since the last one for lack of time
  int steps = 0, cut_steps = 0, newton_iterations = 0;
  bool failed = false;
};

/// A tool at the end of a frame, and its patch.
struct RecordedTouch {
  Micros t{};
  StationId station = 0;
  Vec3 tool = Vec3::Zero(), force = Vec3::Zero();
  bool contact = false, has_patch = false;
  Scheme scheme = Scheme::hold;
  int states = 0;
  std::uint32_t bytes = 0;     ///< size of its datagrams, with its terms
  Micros horizon{};            ///< its prediction horizon
  Vec3 torque = Vec3::Zero();  ///< on a tool with a body, about the tool point [N m]
};

struct RecordedShape {
  Micros t{};
  std::vector<Vec3> positions;  ///< positions of the recorded vertices
  std::uint32_t mesh = 0;       ///< number of the RecordedMeshChange that made its surface; 0: that of the head
};

/// A change of the surface by a blade.
struct RecordedMeshChange {
  Micros t{};
  std::uint32_t number = 0;  ///< 1, 2 ... in the recording
  bool whole = false;        ///< true: it changes the surface of the head, else that of the number before
  MeshPiece piece;
};

enum class RecordedEventKind : std::uint8_t {
  joined,    ///< a room: this station joined; a station: the server admitted it
  left,      ///< said goodbye
  silent,    ///< was silent for too long
  refused,   ///< `text` has the reason
  motion,    ///< the motion of a replayed or simulated hand starts
  overrun,   ///< the server cannot keep its frame rate; `text` has the figures
  kept_up,   ///< the server keeps its frame rate again
  left_out,  ///< something could not be recorded; `text` names it
  reset,     ///< this station reset the body to rest
  released,  ///< its tool was released, as it leaps or costs the body more than a hand does
};
inline constexpr std::size_t kRecordedEventKinds = 10;
const char* name_of(RecordedEventKind kind);

enum class RecordedRole : std::uint8_t { hand, viewer, shadow };  ///< a shadow uses the tool of another hand

struct RecordedEvent {
  Micros t{};
  RecordedEventKind kind = RecordedEventKind::joined;
  StationId station = 0;  ///< 0: no station
  RecordedRole role = RecordedRole::hand;
  Scheme scheme = Scheme::port;
  std::string name, text;  ///< the station's name
  HeldTool tool = {};      ///< of one that joined; without a name: the scene's first
};

/// State of the link, four times a second.
struct RecordedLink {
  Micros t{};
  StationId station = 0;
  Micros rtt{}, rtt_min{}, jitter{}, patch_age{};
  Micros offset{};                       ///< the other side's clock minus the recording's
  std::uint64_t received = 0, lost = 0;  ///< datagrams from the other side, so far
};

struct RecordedTick {
  Micros t{};
  Vec3 position = Vec3::Zero();
  Vec3 model_force = Vec3::Zero();  ///< force of the patch, before the guard
  Vec3 force = Vec3::Zero();        ///< force written to the device
  Micros patch_age{};
  bool has_patch = false, contact = false;
  bool broken = false;  ///< true: a number was not finite, or outside the world: it is recorded as 0
  // on a tool with a body, about the tool point [N m]
  Vec3 model_torque = Vec3::Zero();  ///< of the patch, before the guard
  Vec3 torque = Vec3::Zero();        ///< written to the device
};

struct RecordedHandOver {
  Micros t{}, stamp{};  ///< tick of the swap; stamp of the patch that took over
  double step_n = 0;    ///< force step before the cross-fade
};

/// Orientation of a tool and opening of its jaws from then on, until the next. A tool that is held without orientation is
/// upright.
struct RecordedTurn {
  Micros t{};
  StationId station = 0;
  Rotation orientation = Rotation::Identity();  ///< R_WT, of unit length (common/base/tool_pose.hpp)
  double opening = 0;                           ///< 0 to 1
};

/// Buttons of a tool that are pressed from then on, until the next; none before the first.
struct RecordedButtons {
  Micros t{};
  StationId station = 0;
  std::uint32_t pressed = 0;  ///< bit n: button n
};

/// A hold in which one station guides the other, four times a second.
struct RecordedGuidance {
  Micros t{};
  StationId guide = 0, guided = 0;
  double guide_force_n = 0, guided_force_n = 0;  ///< of the coupling on each tool, mean over 0.1 s, as the two report
};

/// Remark of a person at a viewer about a moment of the session.
struct RecordedNote {
  Micros t{};             ///< when it came
  StationId station = 0;  ///< the viewer
  Micros about{};         ///< moment that it is about
  std::string author;     ///< name of the person, or of the viewer's station
  std::string text;       ///< one line; empty: a mark without words
};

/// A datagram with a patch or its terms, as received.
struct RecordedPacket {
  Micros t{};
  std::vector<std::byte> bytes;
};

/// Tool of a station that was on the body.
struct RecordedHold {
  std::string station;
  Vec3 tool = Vec3::Zero();
  Rotation orientation = Rotation::Identity();  ///< R_WT, of unit length
  double opening = 0;                           ///< 0 to 1
  std::optional<NeedleInBody> needle = {};      ///< that is inside
  std::string held = {};                        ///< name of the tool; empty: the scene's first
};

/// A cut that a blade began or went on with, in the body at rest (server/scene/cuts.hpp).
struct RecordedCut {
  std::uint32_t number = 0;  ///< of the cut, from 0 on
  bool parts = false;        ///< true: the body was parted after it
  std::vector<Vec3> path;    ///< of one end of the blade's edge [m], exact
  Vec3 direction = Vec3::Zero();
  double depth_m = 0;  ///< the edge is depth_m * direction
};

/// A thread through the body, or what was cut off one (server/body/sutures.hpp).
struct RecordedThread {
  static constexpr std::size_t kMostBites = 8;  ///< as kMaxBites of suture.hpp
  struct Bite {
    std::uint32_t number = 0, cell = 0;
    Vec3 at = Vec3::Zero();  ///< in the body at rest [m], exact
  };
  std::uint32_t suture = 0;
  bool first_tied = false, last_tied = false, has_end = true;
  std::vector<double> length_m;  ///< one more than bites
  std::vector<Bite> bites;
};

/// State of the whole body at a moment, from which a simulation can continue.
struct RecordedCheckpoint {
  Micros t{};                               ///< body time
  std::vector<Vec3> positions, velocities;  ///< all vertices, including inner ones [m], [m/s]
  std::vector<RecordedHold> holds;
  /// For a solid whose stress relaxes: the relaxed stress of each element, branch after branch (server/body/relaxation.hpp);
  /// accurate to 1.5e-5 of the largest number of each.
  Eigen::MatrixXf relaxed = {};
  std::vector<RecordedCut> cuts = {};  ///< of the scene's body into that of the checkpoint, in order
  std::vector<RecordedThread> threads = {};
};

/// All contents of about half a second, each list in order of time.
struct RecordedBlock {
  std::vector<RecordedPath> paths;
  std::vector<RecordedFrame> frames;
  std::vector<RecordedTouch> touches;
  std::vector<RecordedShape> shapes;
  std::vector<RecordedEvent> events;
  std::vector<RecordedLink> links;
  std::vector<RecordedTick> ticks;
  std::vector<RecordedHandOver> hand_overs;
  std::vector<RecordedPacket> packets;
  std::vector<RecordedTurn> turns;
  std::vector<RecordedButtons> buttons;
  std::vector<RecordedCheckpoint> checkpoints;
  std::vector<RecordedGuidance> guidances;
  std::vector<RecordedNote> notes;
  std::vector<RecordedMeshChange> mesh_changes;
};

}  // namespace palpate
