// What one datagram says, as plain structs. docs/wire.md states bytes, ranges and behaviour over time.
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "common/base/types.hpp"
#include "common/port/patch.hpp"
#include "common/port/terms_pieces.hpp"

namespace palpate {

inline constexpr std::uint16_t kWireVersion = 1;

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
  Scheme scheme = Scheme::port;
  std::uint16_t order = 0;  ///< states wanted, 0 = the server's default
  std::string shadow_of;    ///< name of a station whose tool this one shares: it gets patches, it does not push
  std::string room = {};    ///< of the server's rooms; empty: its first
};

/// Server -> client: joined.
struct Welcome {
  std::string scene;
  ContactKind contact = ContactKind::attach;
  double rate_hz = 0;
  Vec3 home = Vec3::Zero();                   ///< attach: the node's rest position; touch: a point just above the surface
  std::uint32_t vertices = 0, triangles = 0;  ///< of the surface, for viewers
  std::uint64_t mesh_hash = 0;
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

/// Client -> server: the newest tool samples (client clock, ascending), repeating those of the last datagrams.
struct Samples {
  std::vector<ToolSample> samples;
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
};

struct Leave {};

/// Viewer -> server: send piece `piece` of the topology.
struct MeshRequest {
  std::uint32_t piece = 0;
};

/// Server -> viewer: one piece of the topology (triangles [first, first + size)).
struct MeshPiece {
  std::uint64_t mesh_hash = 0;
  std::uint32_t piece = 0, pieces = 0, first = 0;
  std::vector<Triangle> triangles;
};

/// Server -> viewer: positions of vertices [first, first + size) at one moment, quantised to int16 in the box [low, high].
struct ShapePiece {
  Micros body_time{};
  std::uint32_t first = 0;
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();
  std::vector<Vec3> positions;
};

/// Server -> viewer: the tools in the room.
struct ToolView {
  std::string station;
  Vec3 position = Vec3::Zero(), force = Vec3::Zero();  ///< [m], force on the tool [N]
  bool contact = false;
};
struct Tools {
  Micros body_time{};
  std::vector<ToolView> tools;
};

using Body = std::variant<Hello, Welcome, Refuse, Samples, PatchMessage, Beat, Leave, MeshRequest, MeshPiece, ShapePiece, Tools,
                          PatchTerms>;

struct Message {
  std::uint64_t instance = 0;  ///< the server process, drawn when it starts; 0 in a Hello
  StationId station = 0;       ///< given by the server; 0 in a Hello
  std::uint32_t seq = 0;       ///< per direction and station, grows by one a datagram
  ClockStamps clock;
  Body body;
};

}  // namespace palpate
