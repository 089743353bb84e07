// What one datagram says, as plain structs. docs/reference/wire.md states bytes, ranges and behaviour over time.
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "common/base/tool_pose.hpp"
#include "common/base/types.hpp"
#include "common/port/patch.hpp"
#include "common/port/terms_pieces.hpp"
#include "common/wire/body_mesh.hpp"
#include "common/wire/scheme_in_use.hpp"
#include "common/wire/shape_blocks.hpp"

namespace palpate {

inline constexpr std::uint16_t kWireVersion = 5;

enum class Role : std::uint8_t { haptic, viewer };

/// Four-timestamp clock exchange, carried by every datagram of both directions. All zero when nothing was heard yet.
struct ClockStamps {
  Micros sent{};       ///< sender's clock when it sent this datagram
  Micros echo{};       ///< `sent` of the newest datagram that the sender got from its peer (peer's clock)
  Micros echo_hold{};  ///< how long the sender held that datagram before sending this one
};

/// Client -> server: join. Padded on the wire so that the answer is never larger.
struct Hello {
  std::string station;  ///< its name, unique in the room
  Role role = Role::haptic;
  SchemeAsked scheme = Scheme::port;
  std::uint16_t order = 0;  ///< states wanted, 0 = the server's default
  std::string shadow_of;    ///< name of a station whose tool this one shares: it gets patches, it does not push
  std::string room = {};    ///< of the server's rooms; empty: its first
  /// Where the name is taken another like it will do ("hand-2"): Welcome says which. Otherwise the station is refused.
  bool alike = false;
};

/// Server -> client: joined.
struct Welcome {
  std::string scene;
  ContactKind contact = ContactKind::attach;
  double rate_hz = 0;
  Vec3 home = Vec3::Zero();                   ///< attach: the node's rest position; touch: a point just above the surface
  std::uint32_t vertices = 0, triangles = 0;  ///< of the surface, for viewers
  std::uint64_t mesh_hash = 0;
  double deadband = 0;       ///< patches that would change the force by less than this share of it are not sent, 0 = all are
  std::string station = {};  ///< name that the station has in the room
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

/// Server -> client: not joined, or not any more.
struct Refuse {
  RefuseReason reason = RefuseReason::bad_request;
  std::string message;  ///< one line for a person
};

inline constexpr int kMaxButtonChanges = 4;  ///< of a tool's buttons in one datagram

/// Client -> server: the newest tool samples (client clock, ascending), repeating those of the last datagrams.
struct Samples {
  std::vector<ToolSample> samples;
  std::uint32_t playing = 0;     ///< seq of the patch that is played, all of it; 0 = none, or the server has no deadband
  Orientation orientation = {};  ///< at the last sample
  std::vector<ButtonChange> buttons = {};  ///< the newest changes, ascending, at most kMaxButtonChanges; client's clock
};

/// Server -> client: the newest patch.
struct PatchMessage {
  Patch patch;
};

/// What one side says of the link: of the newest datagrams that it judged, how many did not come, and the longest run of those.
/// judged = 0: nothing known yet.
struct LinkReport {
  std::uint16_t judged = 0, lost = 0, longest_run = 0;
  Micros patch_age{};  ///< client -> server: age that patches in use reach before the next takes over, 0 = not known
};

/// Either way: alive, and how the link does. Server -> client also when there is no patch to send (no contact in reach), and
/// beside patches now and then.
struct Beat {
  Micros body_time{};  ///< moment up to which the body is simulated, in the client's clock (server -> client)
  bool contact_in_reach = false;
  double rate_hz = 0;  ///< frames a second that the room has time for (server -> client), 0 = not said
  Micros behind{};     ///< how old the body's newest state was when it was computed (server -> client)
  LinkReport link = {};
  std::uint32_t ticks_late = 0;  ///< of the client's haptic loop since it began (client -> server)
  /// Every patch from this seq on is as good as one stamped `body_time` would be (server -> client), 0 = not said.
  std::uint32_t renewed_from = 0;
  std::uint16_t resets = 0;  ///< of the body so far (server -> client)
  SchemeInUse in_use = {};   ///< what the station gets now, and why (server -> client)
};

struct Leave {};

/// Viewer -> server: send piece `piece` of the topology.
struct MeshRequest {
  std::uint32_t piece = 0;
};

/// Server -> viewer: one piece of the mesh, vertices or triangles [first, first + size).
struct MeshPiece {
  std::uint64_t mesh_hash = 0;
  std::uint32_t piece = 0, pieces = 0, first = 0;
  std::vector<MeshVertex> vertices;
  std::vector<Triangle> triangles;
};

/// Largest unit of a shape's numbers: of a stress of 25 GPa.
inline constexpr double kMaxShapeUnit = 1e8;

/// Server -> viewer: blocks of vertices (shape_blocks.hpp) of one channel that changed up to one moment.
struct ShapePiece {
  std::uint32_t frame = 0;  ///< grows by one a frame
  Micros body_time{};       ///< server's clock: only differences mean something to a viewer
  ShapeChannel channel = ShapeChannel::position;
  double unit = 0;                   ///< value = unit * whole number, 0 to kMaxShapeUnit
  std::vector<std::uint8_t> blocks;  ///< as append_block() wrote them
};

/// Viewer -> server: which datagrams came, so that what was lost is sent again, and what it wants to see.
struct ViewState {
  std::uint32_t newest = 0;   ///< head.seq of the newest datagram from the server
  std::uint64_t have = 0;     ///< bit k: the datagram of seq newest - k came
  std::uint8_t channels = 0;  ///< bit of each ShapeChannel that is wanted beside the positions
  std::uint16_t kbit_s = 0;   ///< most that shapes may take, 0 = the server's default
};

/// Server -> viewer, the last datagram of a frame: the tools in the room, and how many pieces of shape went before.
struct ToolView {
  std::string station;
  Vec3 position = Vec3::Zero(), force = Vec3::Zero();  ///< [m], force on the tool [N]
  bool contact = false;
  Orientation orientation = {};  ///< the newest that came from the station
  std::uint32_t buttons = 0;     ///< bit n: button n is pressed
};
struct Tools {
  std::uint32_t frame = 0;
  Micros body_time{};  ///< server's clock
  std::uint16_t pieces = 0;
  std::vector<ToolView> tools;
};

/// Server -> viewer, now and then: how room and stations do.
struct StationView {
  std::string station;
  Micros rtt{}, jitter{};
  Micros patch_age{};                  ///< that patches in use reach, as the station says
  std::uint16_t judged = 0, lost = 0;  ///< of the newest datagrams from it
  std::uint32_t ticks_late = 0;        ///< of its haptic loop, as it says
  std::uint16_t states = 0;            ///< of its newest patch
  SchemeInUse in_use = {};
};
struct RoomView {
  std::uint32_t nodes = 0;
  // Of the frames of the last second that stepped the body; 0 where there were none:
  Micros frame_time{};          ///< mean time from a frame's begin to its patches: steps, linearising, reducing
  double rate_hz = 0;           ///< how many they were
  double real_time_factor = 0;  ///< body time simulated per time spent on it
  std::vector<StationView> stations;
  bool asleep = false;  ///< the body rests and is not stepped
};

/// Client -> server: put the body back to rest. Who says another count than the server's asked for one that is done.
struct Reset {
  std::uint16_t resets = 0;  ///< as the newest Beat said
};

using Body = std::variant<Hello, Welcome, Refuse, Samples, PatchMessage, Beat, Leave, MeshRequest, MeshPiece, ShapePiece, Tools,
                          PatchTerms, ViewState, RoomView, Reset>;

struct Message {
  std::uint64_t instance = 0;  ///< secret of the session, drawn by the server; 0 in a Hello
  StationId station = 0;       ///< given by the server; 0 in a Hello
  std::uint32_t seq = 0;       ///< per direction and station, grows by one a datagram
  ClockStamps clock;
  Body body;
};

}  // namespace palpate
