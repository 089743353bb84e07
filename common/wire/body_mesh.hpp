// The surface that viewers draw, in a numbering of its own, and a hash by which viewer and server verify that they have the same
// one.
//
// Vertices are those that triangles use, ordered so that neighbours in number are neighbours in space. Rest positions are
// multiples of 2^-19 m (1.9 um): the server measures displacements from exactly the positions that a viewer decodes.
//
// The hash is FNV-1a (64 bit), fed a word at a time: the vertex count, the three coordinates in steps and the mark of every
// vertex, then the three indices of every triangle. It distinguishes meshes, but does not protect against deliberate collisions.
#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/limits.hpp"
#include "common/patch/patch.hpp"

namespace palpate {

inline constexpr double kRestStepM = 0x1p-19;

struct MeshVertex {
  Vec3 rest = Vec3::Zero();  ///< [m], multiple of kRestStepM
  bool fixed = false;        ///< never moves
  bool wall = false;         ///< of a cut: it lay inside the body before
  std::uint8_t body = 0;     ///< place in the scene's list of its body, where there are several; below kMostBodies
  bool thread = false;       ///< of a thread through the body, which is drawn as a tube
};

/// One of several deformable bodies of a scene.
struct BodyName {
  std::string name;
  std::uint32_t colour = 0;  ///< 0xrrggbb
};

/// The mark of a vertex on the wire: kFixedMark, kWallMark, kThreadMark or 0, plus kBodyMark times its body.
inline constexpr std::uint8_t kFixedMark = 1, kWallMark = 2, kThreadMark = 3, kBodyMark = 4;
inline std::uint8_t mark_of(const MeshVertex& vertex) {
  const std::uint8_t kind = vertex.fixed ? kFixedMark : vertex.wall ? kWallMark : vertex.thread ? kThreadMark : std::uint8_t{0};
  return static_cast<std::uint8_t>(kind + kBodyMark * vertex.body);
}
/// Reads a mark into `vertex`. Returns false when it is none.
inline bool read_mark(std::uint8_t mark, MeshVertex& vertex) {
  vertex.fixed = mark % kBodyMark == kFixedMark;
  vertex.wall = mark % kBodyMark == kWallMark;
  vertex.thread = mark % kBodyMark == kThreadMark;
  vertex.body = mark / kBodyMark;
  return vertex.body < kMostBodies;
}

struct BodyMesh {
  std::vector<MeshVertex> vertices;
  std::vector<Triangle> triangles;
};

/// A rigid part of the scene.
struct PartMesh {
  std::string name;
  std::uint32_t colour = 0;  ///< 0xrrggbb
  double friction = 0;
  BodyMesh mesh;
};

inline std::int32_t rest_steps(double metres) { return static_cast<std::int32_t>(std::lround(metres / kRestStepM)); }
inline double to_rest_step(double metres) { return rest_steps(metres) * kRestStepM; }

inline std::uint64_t mesh_hash(const BodyMesh& mesh) {
  constexpr std::uint64_t kPrime = 0x100000001b3u;
  std::uint64_t hash = (0xcbf29ce484222325u ^ mesh.vertices.size()) * kPrime;
  const auto feed = [&hash](std::uint32_t word) { hash = (hash ^ word) * kPrime; };
  for (const MeshVertex& vertex : mesh.vertices) {
    for (const double x : vertex.rest) feed(static_cast<std::uint32_t>(rest_steps(x)));
    feed(mark_of(vertex));
  }
  for (const Triangle& triangle : mesh.triangles)
    for (const std::uint32_t vertex : triangle) feed(vertex);
  return hash;
}

}  // namespace palpate
