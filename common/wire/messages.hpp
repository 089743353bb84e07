// The contents of one datagram, as plain structs. docs/reference/wire.md specifies bytes, ranges and behaviour over time.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "common/base/tool_pose.hpp"
#include "common/base/types.hpp"
#include "common/patch/patch.hpp"
#include "common/patch/terms_pieces.hpp"
#include "common/task/task.hpp"
#include "common/wire/body_mesh.hpp"
#include "common/wire/scheme_in_use.hpp"
#include "common/wire/shape_blocks.hpp"

namespace palpate {

inline constexpr std::uint16_t kWireVersion = 1;

enum class Role : std::uint8_t { haptic, viewer };

/// Four-timestamp clock exchange, carried by every datagram of both directions. All zero when nothing was heard yet.
struct ClockStamps {
  Micros sent{};       ///< sender's clock when it sent this datagram
  Micros echo{};       ///< `sent` of the newest datagram received from the peer (peer's clock)
  Micros echo_hold{};  ///< time from receiving that datagram to sending this one
};

/// Client -> server: join. Padded on the wire so that the answer is never larger.
struct Hello {
  std::string station;  ///< its name, unique in the room
  Role role = Role::haptic;
  SchemeAsked scheme = Scheme::port;
  std::uint16_t order = 0;  ///< requested number of states, 0 = the server's default
  std::string shadow_of;    ///< name of a station whose tool this one shares: it receives patches but does not push
  std::string room = {};    ///< one of the server's rooms; empty: its first
  /// true: the server may assign a similar name ("hand-2"), given in Welcome, when the name is in use. false: it refuses the
  /// station then.
  bool alike = false;
  std::string guides = {};  ///< name of a station whose tool this one guides; empty: none
  std::string tool = {};    ///< name of the scene's tool that it holds; empty: the first
  /// Rooms that the sender's key has a right to; empty: any. Not on the wire: the server's gate fills it in.
  std::vector<std::string> may_join = {};
};

/// Server -> client: joined.
struct Welcome {
  std::string scene;
  ContactKind contact = ContactKind::attach;
  double rate_hz = 0;
  Vec3 home = Vec3::Zero();                   ///< attach: the node's rest position; touch: a point just above the surface
  std::uint32_t vertices = 0, triangles = 0;  ///< those of the surface, for viewers
  std::uint64_t mesh_hash = 0;
  double deadband = 0;           ///< patches that would change the force by a smaller share are not sent, 0 = all are
  std::string station = {};      ///< name of the station in the room
  bool turns = false;            ///< true: each sample needs its orientation, as the station's tool has a body
  std::uint64_t scene_hash = 0;  ///< server/core/scene_hash.hpp, 0 = not known
  bool jaws = false;             ///< true: each sample needs its opening, as that has jaws
  std::uint8_t parts = 0;        ///< number of the scene's rigid parts
  double coupling_n_m = 0;       ///< contact stiffness of the station's tool with parts; as `tool` not set without parts
  ToolShape tool = {};           ///< body of the station's tool; empty: a point
};

enum class RefuseReason : std::uint8_t {
  version,
  name_taken,
  room_full,
  bad_request,
  node_taken,
  unknown_station,
  shutting_down
};

/// Server -> client: not joined, or no longer.
struct Refuse {
  RefuseReason reason = RefuseReason::bad_request;
  std::string message;  ///< one line for a person
};

inline constexpr int kMaxButtonChanges = 4;  ///< changes of a tool's buttons in one datagram

/// Client -> server: the newest tool samples (client clock, ascending), repeating those of the last datagrams. The last of them
/// has the tool's orientation, if the device has one, or all of them have, at most kMaxTurnsPerDatagram then; where
/// jaws are not closed in all of them, at most kMaxOpeningsPerDatagram.
struct Samples {
  std::vector<ToolSample> samples;
  std::uint32_t playing = 0;  ///< seq of the patch that is played with all its terms; 0 = none, or the server has no deadband
  std::vector<ButtonChange> buttons = {};  ///< the newest changes, ascending, at most kMaxButtonChanges; client's clock
};

/// Server -> client: the newest patch.
struct PatchMessage {
  Patch patch;
};

/// Report of one side about the link: among the newest datagrams that it judged, the number of lost ones and their longest run.
/// judged = 0: nothing known yet.
struct LinkReport {
  std::uint16_t judged = 0, lost = 0, longest_run = 0;
  Micros patch_age{};  ///< client -> server: age that patches in use reach before the next takes over, 0 = not known
};

/// State of a hand with regard to guidance: the coupling of its tool to that of another station (client/core/guidance.hpp).
enum class GuidanceHand : std::uint8_t {
  ready,     ///< does not object
  holds,     ///< renders the force of the coupling
  released,  ///< broke away, and has not come back yet
  refuses,   ///< does not let itself be guided
  busy,      ///< has another partner, or guides (server -> client)
  absent     ///< is not in the room (server -> client)
};

/// Report of a station about guidance.
struct GuidanceReport {
  GuidanceHand hand = GuidanceHand::ready;
  Micros reach{};      ///< longest delay of its partner's tool in this hold, 0 = unknown
  double force_n = 0;  ///< mean force of the coupling over the last 0.1 s
};

/// Server -> client: the newest sample of the other hand of a pair. While a guide has no partner it states the reason.
struct Guidance {
  std::string partner;
  bool guides = false;                       ///< true: the receiver guides the partner; false: it is guided
  GuidanceHand hand = GuidanceHand::absent;  ///< state of the partner
  Micros reach{};                            ///< GuidanceReport::reach of the partner
  Micros stamp{};                            ///< moment of `position`, in the receiver's clock
  Vec3 position = Vec3::Zero();              ///< tool of the partner
};

/// Either way: keep-alive and report of the link. Server -> client also when there is no patch to send (no contact in reach), and
/// occasionally in addition to patches.
struct Beat {
  Micros body_time{};  ///< moment up to which the body is simulated, in the client's clock (server -> client)
  bool contact_in_reach = false;
  double rate_hz = 0;  ///< frame rate that the room achieves (server -> client), 0 = not reported
  Micros behind{};     ///< age of the body's newest state at the time it was computed (server -> client)
  LinkReport link = {};
  std::uint32_t ticks_late = 0;  ///< late ticks of the client's haptic loop since it began (client -> server)
  /// Every patch from this seq on is as good as one stamped `body_time` would be (server -> client), 0 = not reported.
  std::uint32_t renewed_from = 0;
  std::uint16_t resets = 0;      ///< number of resets of the body so far (server -> client)
  SchemeInUse in_use = {};       ///< current scheme of the station, and its reason (server -> client)
  GuidanceReport guidance = {};  ///< client -> server
  std::uint32_t notes = 0;       ///< number of the station's notes that were recorded (server -> client)
  bool released = false;  ///< true: the station's tool cost too much, was released, and may not touch yet (server -> client)
};

struct Leave {};

/// Station -> server: send piece `piece` of the topology; of rigid part p, from 1 on, p kPartPieces + its piece.
struct MeshRequest {
  std::uint32_t piece = 0;
};
inline constexpr std::uint32_t kPartPieces = 1u << 24;

/// Server -> station: vertices or triangles of a rigid part.
struct PartPiece {
  std::uint8_t part = 1;
  std::string name;
  std::uint32_t colour = 0;  ///< 0xrrggbb
  double friction = 0;
  std::uint32_t all_vertices = 0, all_triangles = 0;  ///< numbers of the whole part
  std::uint32_t piece = 0;                            ///< those with vertices come first, each full but the last
  std::vector<MeshVertex> vertices = {};
  std::vector<Triangle> triangles = {};
};

/// Server -> viewer: one piece of the mesh, vertices or triangles [first, first + size); or one that changes the mesh
/// (mesh_change.hpp), where a blade has cut the body: vertices or triangles after those so far, or numbers of triangles that go.
struct MeshPiece {
  std::uint64_t mesh_hash = 0;
  std::uint32_t piece = 0, pieces = 0, first = 0;
  std::vector<MeshVertex> vertices = {};
  std::vector<Triangle> triangles = {};
  std::vector<std::uint32_t> removed = {};
};

/// Largest unit of a shape's numbers: for a stress of 25 GPa.
inline constexpr double kMaxShapeUnit = 1e8;

/// Server -> viewer: blocks of vertices (shape_blocks.hpp) of one channel that changed up to one moment.
struct ShapePiece {
  std::uint32_t frame = 0;  ///< grows by one a frame
  Micros body_time{};       ///< server's clock: only differences are meaningful to a viewer
  ShapeChannel channel = ShapeChannel::position;
  double unit = 0;                   ///< value = unit * whole number, 0 to kMaxShapeUnit
  std::vector<std::uint8_t> blocks;  ///< output of append_block()
};

/// Viewer -> server: received datagrams, so that lost ones are sent again, and the requested contents.
struct ViewState {
  std::uint32_t newest = 0;   ///< head.seq of the newest datagram from the server
  std::uint64_t have = 0;     ///< bit k: the datagram of seq newest - k arrived
  std::uint8_t channels = 0;  ///< one bit for each ShapeChannel requested in addition to the positions
  std::uint16_t kbit_s = 0;   ///< limit for shapes, 0 = the server's default
};

/// Server -> viewer, the last datagram of a frame: the tools in the room, and the number of shape pieces sent before.
struct ToolView {
  std::string station;
  Vec3 position = Vec3::Zero(), force = Vec3::Zero();  ///< [m], force on the tool [N]
  bool contact = false;
  Orientation orientation = {};  ///< newest one received from the station
  std::uint32_t buttons = 0;     ///< bit n: button n is pressed
  std::string guides = {};       ///< name of the station whose tool it guides; empty: none
  double opening = 0;            ///< of its jaws, the newest one received
  Vec3 torque = Vec3::Zero();    ///< on a tool with a body, about the tool point [N m]
};
struct Tools {
  std::uint32_t frame = 0;
  Micros body_time{};  ///< server's clock
  std::uint16_t pieces = 0;
  std::vector<ToolView> tools;
  std::uint32_t mesh_pieces = 0;  ///< MeshPieces of the body's present mesh
};

/// Server -> viewer, occasionally: state of the room and its stations.
struct StationView {
  std::string station;
  Micros rtt{}, jitter{};
  Micros patch_age{};                  ///< age that patches in use reach, reported by the station
  std::uint16_t judged = 0, lost = 0;  ///< among the newest datagrams from it
  std::uint32_t ticks_late = 0;        ///< late ticks of its haptic loop, reported by the station
  std::uint16_t states = 0;            ///< states of its newest patch
  SchemeInUse in_use = {};
  HeldTool tool = {};  ///< without a name: the room's
};
struct RoomView {
  std::uint32_t nodes = 0;
  // over the frames of the last second that stepped the body; 0 without any:
  Micros frame_time{};          ///< mean time from the begin of a frame to its patches: steps, linearisation, reduction
  double rate_hz = 0;           ///< number of those frames
  double real_time_factor = 0;  ///< body time simulated per computing time
  std::vector<StationView> stations;
  bool asleep = false;                ///< true: the body rests and is not stepped
  bool starved = false;               ///< true: other load on the server's machine leaves the frames too little of a core
  ToolShape tool = {};                ///< body of the scene's first tool; empty: a point
  std::vector<BodyName> bodies = {};  ///< of a scene with several; empty: one
};

/// Returns the body of the tool that a station holds; the room's where the view has no such station.
inline const ToolShape& shape_held(const RoomView& room, const std::string& station) {
  const auto view = std::ranges::find(room.stations, station, &StationView::station);
  return view == room.stations.end() || view->tool.name.empty() ? room.tool : view->tool.shape;
}

/// Client -> server: reset the body to rest. A request with another count than the server's refers to an earlier reset and is
/// ignored.
struct Reset {
  std::uint16_t resets = 0;  ///< count in the newest Beat
};

inline constexpr std::size_t kMaxNoteBytes = 240;

/// Viewer -> server: remark of a person, for the room's recording; repeated until Beat::notes has its number.
struct Note {
  std::uint32_t number = 0;  ///< one more with each note of the session, from 1 on
  Micros at{};               ///< moment that it is about, server's clock: body time of a frame
  std::string author;        ///< name of the person; empty: that of the station
  std::string text;          ///< one line of plain text, at most kMaxNoteBytes; empty: a mark without words
};

/// Server -> viewer, every few seconds: names of the server's rooms that the viewer may join, where there are several.
struct RoomList {
  std::string here;  ///< name of the viewer's room
  std::vector<std::string> names;
};

/// A Task: server -> viewer, every few seconds: the task that the scene states.
using Payload = std::variant<Hello, Welcome, Refuse, Samples, PatchMessage, Beat, Leave, MeshRequest, MeshPiece, ShapePiece,
                             Tools, PatchTerms, ViewState, RoomView, Reset, Guidance, Task, Note, RoomList, PartPiece>;

struct Message {
  std::uint64_t instance = 0;  ///< secret of the session, drawn by the server; in a Hello: of the former session, or 0
  StationId station = 0;       ///< assigned by the server; in a Hello: of the former session, or 0
  std::uint32_t seq = 0;       ///< per direction and station, incremented with every datagram
  ClockStamps clock;
  Payload body;
};

}  // namespace palpate
