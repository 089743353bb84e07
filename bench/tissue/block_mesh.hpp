// Meshes of blocks: each is the image of the unit cube, divided into n_1 x n_2 x n_3 cells; nodes of touching blocks are merged.
//
// A cell is one hexahedron, or six tetrahedra: those that its node of the smallest number spans with the triangles of the three
// faces without that node. Each face is cut through its own node of the smallest number, so that cells that share a face cut it
// alike.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <vector>

#include "server/scene/scene.hpp"

namespace palpate {

class BlockMesh {
 public:
  /// Nodes closer than `merge_m` are merged.
  explicit BlockMesh(double merge_m) : merge_m_(merge_m) {}
  /// `map` must preserve the cube's handedness.
  void add(const std::array<int, 3>& cells, const std::function<Vec3(const Vec3&)>& map);

  const std::vector<Vec3>& nodes() const { return nodes_; }
  /// Moves every node.
  void move(const std::function<Vec3(std::uint32_t node, const Vec3&)>& to);
  /// Returns a body with nothing fixed, masses of 1000 kg/m^3 and no surface. Throws std::logic_error if a cell is inside out.
  LumpedBody body(SolidElement element, const SolidMaterial& material) const;

 private:
  using Cell = std::array<std::uint32_t, 8>;  // bit a of an index: the side along axis a
  std::uint32_t node_at(const Vec3& at);
  static void divide(const Cell& cell, std::vector<Tetrahedron>& into);

  double merge_m_;
  std::map<std::array<std::int64_t, 3>, std::uint32_t> known_;
  std::vector<Vec3> nodes_;
  std::vector<Cell> cells_;
};

}  // namespace palpate
