// The surface that viewers draw, in a numbering of its own, and the number by which viewer and server know that they hold the
// same.
//
// Vertices are those that triangles use, in an order in which neighbours in number are neighbours in space. Rest positions are
// whole steps of 2^-19 m (1.9 um): what a viewer decodes is what the server measures displacements from.
//
// The hash is FNV-1a (64 bit), fed a word at a time: the vertex count, the three coordinates in steps and the fixed mark of every
// vertex, then the three indices of every triangle. Enough to tell one mesh from another; no protection against someone who
// wants two to agree.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "common/port/patch.hpp"

namespace palpate {

inline constexpr double kRestStepM = 0x1p-19;

struct MeshVertex {
  Vec3 rest = Vec3::Zero();  ///< [m], whole steps
  bool fixed = false;        ///< never moves
};

struct BodyMesh {
  std::vector<MeshVertex> vertices;
  std::vector<Triangle> triangles;
};

inline std::int32_t rest_steps(double metres) { return static_cast<std::int32_t>(std::lround(metres / kRestStepM)); }
inline double to_rest_step(double metres) { return rest_steps(metres) * kRestStepM; }

inline std::uint64_t mesh_hash(const BodyMesh& mesh) {
  constexpr std::uint64_t kPrime = 0x100000001b3u;
  std::uint64_t hash = (0xcbf29ce484222325u ^ mesh.vertices.size()) * kPrime;
  const auto feed = [&hash](std::uint32_t word) { hash = (hash ^ word) * kPrime; };
  for (const MeshVertex& vertex : mesh.vertices) {
    for (const double x : vertex.rest) feed(static_cast<std::uint32_t>(rest_steps(x)));
    feed(vertex.fixed ? 1 : 0);
  }
  for (const Triangle& triangle : mesh.triangles)
    for (const std::uint32_t vertex : triangle) feed(vertex);
  return hash;
}

}  // namespace palpate
