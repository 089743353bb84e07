// Several bodies with one tool each, stepped side by side by the threads of a pool: what a vectorised environment of a learning
// program needs. Each room is a LocalRoom of its own, so that its bits are those of that room alone.
#pragma once

#include <memory>
#include <vector>

#include "bindings/core/local_room.hpp"
#include "common/base/thread_pool.hpp"

namespace palpate {

/// Tool of a room at the end of a step.
struct LocalRoomsTool {
  Vec3 force = Vec3::Zero();  ///< of the full model on the tool [N]
  bool contact = false;
  bool failed = false;  ///< FrameResult::failed
};

class LocalRooms {
 public:
  /// `count` bodies at rest. `pool` outlives them. Throws what Room throws.
  LocalRooms(const Scene& scene, std::size_t count, ThreadPool& pool);

  std::size_t size() const { return rooms_.size(); }
  /// Replaces room k by a body at rest, of its scene or of another one; k < size(). The first takes less time.
  void renew(std::size_t k) { rooms_[k]->renew(); }
  void renew(std::size_t k, const Scene& scene) { rooms_[k] = std::make_unique<LocalRoom>(scene); }
  /// Moves the tool of each room in `ticks` ms from `from` to `from + by` on a straight line, at from + by t / ticks after t ms,
  /// and the body with it. The spans have size() items. Throws InputError for ticks beyond 1 to kMaxStepTicks and places out of
  /// the world, before anything moves; else the first exception of a room, when all have stepped.
  void step(std::span<const Vec3> from, std::span<const Vec3> by, std::size_t ticks, std::span<LocalRoomsTool> tools);

 private:
  ThreadPool& pool_;
  std::vector<std::unique_ptr<LocalRoom>> rooms_;
};

}  // namespace palpate
