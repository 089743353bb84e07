// What a recording of a session says, as plain structs. docs/reference/recording.md states the file.
//
// There are two kinds. A room's is made at the server, in the server's clock: the samples that the body was driven with, the
// frames, what every tool met in them, links and shapes. A station's is made at the client, in the client's clock: every haptic
// tick and every patch as it came. SI units, frame W; forces act on the tool.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/tool_pose.hpp"
#include "common/base/types.hpp"
#include "common/port/patch.hpp"

namespace palpate {

enum class RecordingKind : std::uint8_t { room, station };

/// Which of a body's vertices are recorded: those of its triangles; all of a body without triangles.
struct RecordedSurface {
  std::uint32_t body_vertices = 0;
  std::uint64_t mesh_hash = 0;       ///< as in Welcome
  std::vector<std::uint32_t> nodes;  ///< indices of the recorded vertices in the body, ascending
  std::vector<Vec3> rest;            ///< of these, settled under gravity or not: as the scene makes them
  std::vector<Triangle> triangles;   ///< indices into `nodes`
  std::vector<std::uint32_t> fixed;  ///< which of `nodes` are held fast, ascending
};

struct RecordingHead {
  RecordingKind kind = RecordingKind::room;
  std::string program;                ///< and its version
  std::string name;                   ///< of the room or station
  Micros unix_time{}, clock_time{};   ///< one moment: microseconds since 1970 (UTC), and in the recording's clock
  double rate_hz = 0, shapes_hz = 0;  ///< frames or ticks, shapes a second as asked for
  std::string scene;                  ///< JSON with all defaults; a station does not know it
  std::string scene_file;             ///< paths inside the scene are relative to it
  RecordedSurface surface;            ///< of a room's recording
};

/// The samples of a tool that a frame was given, at the resolution at which they came, each once.
struct RecordedPath {
  StationId station = 0;
  std::vector<ToolSample> samples;
};

struct RecordedFrame {
  Micros t{};                 ///< body time that it reached
  Micros took{}, behind{};    ///< computing time; age of the body's state when it was ready
  std::uint32_t skipped = 0;  ///< frames left out since the last one for lack of time
  int steps = 0, cut_steps = 0, newton_iterations = 0;
  bool failed = false;
};

/// A tool at the end of a frame, and the patch that was made for it.
struct RecordedTouch {
  Micros t{};
  StationId station = 0;
  Vec3 tool = Vec3::Zero(), force = Vec3::Zero();
  bool contact = false, has_patch = false;
  Scheme scheme = Scheme::hold;
  int states = 0;
  std::uint32_t bytes = 0;  ///< of its datagrams, with its terms
  Micros horizon{};         ///< age that it was made to reach
};

struct RecordedShape {
  Micros t{};
  std::vector<Vec3> positions;  ///< of the recorded vertices
};

enum class RecordedEventKind : std::uint8_t {
  joined,    ///< a room: this station came; a station: the server let it in
  left,      ///< said goodbye
  silent,    ///< was not heard for too long
  refused,   ///< `text` says why
  motion,    ///< the motion of a replayed or simulated hand starts
  overrun,   ///< the server cannot keep its frame rate; `text` has the figures
  kept_up,   ///< it keeps up again
  left_out,  ///< something could not be recorded; `text` says what
  reset,     ///< this station had the body put back to rest
};
inline constexpr std::size_t kRecordedEventKinds = 9;
const char* name_of(RecordedEventKind kind);

enum class RecordedRole : std::uint8_t { hand, viewer, shadow };  ///< a shadow feels with the tool of another hand

struct RecordedEvent {
  Micros t{};
  RecordedEventKind kind = RecordedEventKind::joined;
  StationId station = 0;  ///< 0: nobody's
  RecordedRole role = RecordedRole::hand;
  Scheme scheme = Scheme::port;
  std::string name, text;  ///< the station's name
};

/// How the link does, four times a second.
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
  Vec3 model_force = Vec3::Zero();  ///< what the patch gives, before the guard
  Vec3 force = Vec3::Zero();        ///< what the device was told
  Micros patch_age{};
  bool has_patch = false, contact = false;
  bool broken = false;  ///< a number was not finite, or outside of the world: it is recorded as 0
};

struct RecordedHandOver {
  Micros t{}, stamp{};  ///< tick of the swap; stamp of the patch that took over
  double step_n = 0;    ///< before the cross-fade
};

/// How a tool is held from then on, until the next.
struct RecordedTurn {
  Micros t{};
  StationId station = 0;
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  ///< R_WT, of unit length (common/base/tool_pose.hpp)
};

/// Which buttons of a tool are pressed from then on, until the next; none before the first.
struct RecordedButtons {
  Micros t{};
  StationId station = 0;
  std::uint32_t pressed = 0;  ///< bit n: button n
};

/// A datagram with a patch or its terms, as it came.
struct RecordedPacket {
  Micros t{};
  std::vector<std::byte> bytes;
};

/// The tool of a station that was on the body.
struct RecordedHold {
  std::string station;
  Vec3 tool = Vec3::Zero();
};

/// The whole body at a moment: from here it can be taken up again.
struct RecordedCheckpoint {
  Micros t{};                               ///< body time
  std::vector<Vec3> positions, velocities;  ///< of all vertices, those inside as well [m], [m/s]
  std::vector<RecordedHold> holds;
  /// Of a solid whose stress fades: the relaxed stress of each element, branch after branch (server/body/relaxation.hpp); right
  /// to 1.5e-5 of the largest number of each.
  Eigen::MatrixXf relaxed = {};
};

/// Half a second or so of everything, each list in the order in which it happened.
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
};

}  // namespace palpate
