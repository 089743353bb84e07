// Sends viewers the mesh that they ask for, the shape and the tools of each frame, and at intervals the state of the room, its
// task, and the names of the server's rooms that they may join.
//
// After each frame a viewer gets the pieces of the shape that its budget allows (shape_stream.hpp), then the tools, which include
// the number of pieces. Pieces of the mesh are sent when nothing else waits, at most kMostMeshPieces of those requested.
#pragma once

#include "server/core/frame_scheduler.hpp"
#include "server/core/mesh_log.hpp"
#include "server/core/room_info.hpp"
#include "server/core/server_options.hpp"
#include "server/core/shape_stream.hpp"
#include "server/core/station.hpp"

namespace palpate {

class ViewSender {
 public:
  static constexpr std::size_t kMostMeshPieces = 64;  ///< most pieces per viewer that are requested and not yet sent
  static constexpr Micros kTaskEvery{2'000'000};

  ViewSender(RoomInfo facts, const ServerOptions& options)
      : facts_(std::move(facts)), room_(options.room), rooms_(options.rooms), mesh_(facts_), shapes_(facts_, options.rate_hz) {}

  /// Accepts a finished frame.
  void take(const FrameResult& result, Stations& stations, const BodyNow& body, Micros now);
  void heard(Station& viewer, const ViewState& state) const { shapes_.heard(viewer.shape, state); }
  /// Queues pieces of the mesh; returns false if the mesh has no such piece.
  bool asked(Station& viewer, const MeshRequest& request) const;
  /// Writes the next datagram for a viewer; returns its bytes, 0 if there is none.
  std::size_t emit(const Stations& stations, Station& viewer, std::span<std::byte> out, Micros now);
  const RoomInfo& facts() const { return facts_; }
  void set_starved(bool starved) { starved_ = starved; }

 private:
  std::size_t emit_shape(const Stations& stations, Station& viewer, std::span<std::byte> out, Micros now);
  bool may_have_mesh(Station& viewer, Micros now) const;
  Tools tools(const Stations& stations, const Station& viewer) const;
  RoomView room_view(const Stations& stations) const;
  RoomList rooms_for(const Station& viewer) const;

  RoomInfo facts_;
  std::string room_;
  std::vector<std::string> rooms_;  ///< all of the server
  MeshLog mesh_;
  ShapeStream shapes_;
  BodyNow body_;  ///< after the last frame
  bool starved_ = false;
};

}  // namespace palpate
