#include "bench/tissue/block_mesh.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace palpate {
namespace {

constexpr double kDensityKgM3 = 1000;
// Faces, their nodes in a ring, counter-clockwise seen from outside.
constexpr std::array<std::array<std::size_t, 4>, 6> kFaces{
    {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};

double volume_of(const LumpedBody& body, const Tetrahedron& t) {
  Mat3 edges;
  for (int k = 0; k < 3; ++k) edges.col(k) = body.nodes[t.nodes[static_cast<std::size_t>(k) + 1]] - body.nodes[t.nodes[0]];
  return edges.determinant() / 6;
}

}  // namespace

void BlockMesh::add(const std::array<int, 3>& cells, const std::function<Vec3(const Vec3&)>& map) {
  const auto [nx, ny, nz] = cells;
  std::vector<std::uint32_t> number;
  for (int k = 0; k <= nz; ++k)
    for (int j = 0; j <= ny; ++j)
      for (int i = 0; i <= nx; ++i) number.push_back(node_at(map(Vec3(double(i) / nx, double(j) / ny, double(k) / nz))));
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) {
        Cell& cell = cells_.emplace_back();
        for (int c = 0; c < 8; ++c)
          cell[static_cast<std::size_t>(c)] =
              number[static_cast<std::size_t>((i + (c & 1)) + (nx + 1) * ((j + (c >> 1 & 1)) + (ny + 1) * (k + (c >> 2 & 1))))];
      }
}

void BlockMesh::move(const std::function<Vec3(std::uint32_t, const Vec3&)>& to) {
  for (std::uint32_t i = 0; i < nodes_.size(); ++i) nodes_[i] = to(i, nodes_[i]);
}

std::uint32_t BlockMesh::node_at(const Vec3& at) {
  // Offset from multiples of the rounding step, where two nodes that should merge could be separated.
  constexpr double kAside = 0.3141;
  std::array<std::int64_t, 3> key{};
  for (int a = 0; a < 3; ++a) key[static_cast<std::size_t>(a)] = std::llround(at[a] / merge_m_ + kAside);
  const auto [entry, fresh] = known_.try_emplace(key, static_cast<std::uint32_t>(nodes_.size()));
  if (fresh) nodes_.push_back(at);
  return entry->second;
}

void BlockMesh::divide(const Cell& cell, std::vector<Tetrahedron>& into) {
  const std::uint32_t apex = *std::min_element(cell.begin(), cell.end());
  for (const auto& face : kFaces) {
    std::array<std::uint32_t, 4> ring{};
    for (std::size_t k = 0; k < 4; ++k) ring[k] = cell[face[k]];
    if (std::find(ring.begin(), ring.end(), apex) != ring.end()) continue;
    std::rotate(ring.begin(), std::min_element(ring.begin(), ring.end()), ring.end());
    into.push_back({{apex, ring[0], ring[1], ring[2]}, 0});
    into.push_back({{apex, ring[0], ring[2], ring[3]}, 0});
  }
}

LumpedBody BlockMesh::body(SolidElement element, const SolidMaterial& material) const {
  LumpedBody body;
  body.nodes = nodes_;
  body.fixed.assign(nodes_.size(), 0);
  body.masses_kg.assign(nodes_.size(), 0);
  body.materials = {material};
  std::vector<Tetrahedron> parts;
  for (const Cell& cell : cells_) {
    parts.clear();
    divide(cell, parts);
    double volume = 0;
    for (const Tetrahedron& t : parts) {
      const double part = volume_of(body, t);
      if (element == SolidElement::tetrahedron && !(part > 0)) throw std::logic_error("a tetrahedron of a block is inside out");
      volume += part;
    }
    if (!(volume > 0)) throw std::logic_error("a cell of a block is inside out");
    for (const std::uint32_t node : cell) body.masses_kg[node] += kDensityKgM3 * volume / 8;
    if (element == SolidElement::hexahedron)
      body.hexahedra.push_back({cell, 0});
    else
      body.tetrahedra.insert(body.tetrahedra.end(), parts.begin(), parts.end());
  }
  return body;
}

}  // namespace palpate
