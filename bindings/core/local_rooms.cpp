#include "bindings/core/local_rooms.hpp"

#include <exception>
#include <string>

#include "client/core/haptic_tick.hpp"
#include "common/base/error.hpp"
#include "common/base/limits.hpp"

namespace palpate {

LocalRooms::LocalRooms(const Scene& scene, std::size_t count, ThreadPool& pool) : pool_(pool) {
  rooms_.resize(count);
  for (std::size_t k = 0; k < count; ++k) renew(k, scene);
}

void LocalRooms::step(std::span<const Vec3> from, std::span<const Vec3> by, std::size_t ticks, std::span<LocalRoomsTool> tools) {
  if (ticks == 0 || ticks > kMaxStepTicks)
    throw InputError("ticks", "is " + std::to_string(ticks), "1 to " + std::to_string(kMaxStepTicks));
  for (std::size_t k = 0; k < size(); ++k)
    if (!in_world(from[k]) || !in_world(from[k] + by[k]))
      throw InputError("tool of room " + std::to_string(k), "leaves the world",
                       "finite coordinates within " + std::to_string(static_cast<int>(kWorldExtentM)) + " m");
  std::vector<std::exception_ptr> faults(size());
  pool_.run(size(), [&](std::size_t k) {
    try {
      std::vector<ToolSample> path(ticks);
      for (std::size_t t = 0; t < ticks; ++t)
        path[t].position = from[k] + (static_cast<double>(t + 1) / static_cast<double>(ticks)) * by[k];
      const LocalTool tool{1, path};
      const FrameResult result = rooms_[k]->step(std::span(&tool, 1), {.patches = false, .shape = false});
      tools[k] = {result.stations.front().force, result.stations.front().contact, result.failed};
    } catch (...) {
      faults[k] = std::current_exception();
    }
  });
  for (const std::exception_ptr& fault : faults)
    if (fault) std::rethrow_exception(fault);
}

}  // namespace palpate
