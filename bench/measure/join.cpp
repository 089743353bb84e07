#include "bench/measure/join.hpp"

#include <stdexcept>

#include "bench/measure/reference.hpp"
#include "common/base/error.hpp"

namespace palpate {
namespace {

constexpr Micros kJoinWithin{10'000'000};

}  // namespace

Micros join(World& world, WorldStation& station, const Scene& scene, const Vec3& start, const ClientOptions& options,
            double rate_hz) {
  const bool wants_patch = scene.tool.contact == ContactKind::attach;
  while (station.core().link() != LinkState::joined || (wants_patch && station.core().haptic().counts().patches_used == 0)) {
    if (station.core().link() == LinkState::refused)
      throw InputError("--scheme " + std::string(name_of(options.hello.scheme)),
                       "refused by the server: " + station.core().refusal(), "a scheme and order that it takes");
    if (world.now() > kJoinWithin) throw std::runtime_error("no answer over this link within 10 s of virtual time");
    world.run_until(world.now() + Micros{1000});
  }
  if (needs_settling(scene, start)) world.run_until(world.now() + kSettle);
  const Micros frame = from_seconds(1 / rate_hz);
  return (world.now() / frame + 1) * frame;
}

}  // namespace palpate
