// A hash of what decides forces in a scene in addition to the shape of its body, by which a report knows the scene again.
//
// It is FNV-1a (64 bit), fed a word at a time: elements, materials, solver and tool; not positions, as mesh_hash() has those of
// the surface. Numbers count in single precision, because two machines may differ in the last digits of a double.
#pragma once

#include <cstdint>

#include "server/scene/scene.hpp"

namespace palpate {

std::uint64_t scene_hash(const Scene& scene);

}  // namespace palpate
