#include "common/wire/mesh_change.hpp"

#include <algorithm>

namespace palpate {

bool apply(const MeshPiece& piece, BodyMesh& mesh) {
  const auto& removed = piece.removed;
  const bool ascending = std::adjacent_find(removed.begin(), removed.end(), std::greater_equal<>()) == removed.end();
  if (!ascending || (!removed.empty() && removed.back() >= mesh.triangles.size())) return false;
  for (const Triangle& t : piece.triangles)
    if (*std::max_element(t.begin(), t.end()) >= mesh.vertices.size()) return false;
  mesh.vertices.insert(mesh.vertices.end(), piece.vertices.begin(), piece.vertices.end());
  std::uint32_t number = 0;
  auto next = removed.begin();
  std::erase_if(mesh.triangles, [&](const Triangle&) {
    const bool goes = next != removed.end() && *next == number;
    ++number;
    next += goes;
    return goes;
  });
  mesh.triangles.insert(mesh.triangles.end(), piece.triangles.begin(), piece.triangles.end());
  return true;
}

}  // namespace palpate
