// What viewers are sent: the mesh that they ask for, of each frame the shape and the tools, and now and then how the room does.
//
// After each frame a viewer gets the pieces of the shape that its budget allows (shape_stream.hpp), then the tools, which say how
// many pieces there were. Pieces of the mesh go when nothing else waits, at most kMostMeshPieces of those that it asked for.
#pragma once

#include "server/core/frame_scheduler.hpp"
#include "server/core/room_facts.hpp"
#include "server/core/shape_stream.hpp"
#include "server/core/station.hpp"

namespace palpate {

class ViewSender {
 public:
  static constexpr std::size_t kMostMeshPieces = 64;  ///< asked for and not yet sent, a viewer

  ViewSender(RoomFacts facts, double rate_hz) : facts_(std::move(facts)), shapes_(facts_, rate_hz) {}

  /// A frame is done.
  void take(const FrameResult& result, Stations& stations, const BodyNow& body, Micros now);
  void heard(Station& viewer, const ViewState& state) const { shapes_.heard(viewer.shape, state); }
  /// False where the mesh has no such piece.
  bool asked(Station& viewer, const MeshRequest& request) const;
  /// Bytes of the next datagram for a viewer, 0 when there is none.
  std::size_t emit(const Stations& stations, Station& viewer, std::span<std::byte> out, Micros now);
  const RoomFacts& facts() const { return facts_; }

 private:
  std::size_t emit_shape(const Stations& stations, Station& viewer, std::span<std::byte> out, Micros now);
  bool may_have_mesh(Station& viewer, Micros now) const;
  Tools tools(const Stations& stations, const Station& viewer) const;
  RoomView room_view(const Stations& stations) const;

  RoomFacts facts_;
  ShapeStream shapes_;
  BodyNow body_;  ///< after the last frame
};

}  // namespace palpate
