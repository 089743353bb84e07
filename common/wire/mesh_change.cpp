#include "common/wire/mesh_change.hpp"

#include <algorithm>
#include <iterator>
#include <set>

namespace palpate {

bool apply(const MeshPiece& piece, BodyMesh& mesh) {
  const auto& removed = piece.removed;
  const bool ascending = std::adjacent_find(removed.begin(), removed.end(), std::greater_equal<>()) == removed.end();
  if (!ascending || (!removed.empty() && removed.back() >= mesh.triangles.size())) return false;
  for (const Triangle& t : piece.triangles)
    if (*std::max_element(t.begin(), t.end()) >= mesh.vertices.size() + piece.vertices.size()) return false;
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

MeshPiece change_of(const BodyMesh& before, const BodyMesh& now) {
  MeshPiece change;
  std::copy(now.vertices.begin() + std::ssize(before.vertices), now.vertices.end(), std::back_inserter(change.vertices));
  std::multiset<Triangle> missing(now.triangles.begin(), now.triangles.end());
  for (std::uint32_t k = 0; k < before.triangles.size(); ++k) {
    const auto same = missing.find(before.triangles[k]);
    if (same == missing.end())
      change.removed.push_back(k);
    else
      missing.erase(same);
  }
  change.triangles.assign(missing.begin(), missing.end());
  return change;
}

}  // namespace palpate
