#include "server/scene/cell_copies.hpp"

#include <algorithm>
#include <cassert>
#include <numeric>

#include "server/scene/disjoint_sets.hpp"

namespace palpate {
namespace {

constexpr std::array<std::array<std::uint8_t, 2>, 12> kHexaLinks{
    {{0, 1}, {2, 3}, {4, 5}, {6, 7}, {0, 2}, {1, 3}, {4, 6}, {5, 7}, {0, 4}, {1, 5}, {2, 6}, {3, 7}}};
constexpr std::array<std::array<std::uint8_t, 4>, 6> kHexaFaces{
    {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
constexpr std::array<std::array<std::uint8_t, 2>, 6> kTetraLinks{{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {2, 3}, {3, 1}}};
constexpr std::array<std::array<std::uint8_t, 4>, 4> kTetraFaces{{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};

/// Returns the number of parts.
std::size_t find_parts(const CutCells& cut, const CellNodes& nodes, std::array<std::uint8_t, 8>& part) {
  DisjointSets joined(cut.kind->corners);
  for (const auto& [a, b] : cut.kind->links)
    if (!cut.is_cut(link_of(nodes[a], nodes[b]))) joined.join(a, b);
  std::size_t parts = 0;
  for (std::uint32_t corner = 0; corner < cut.kind->corners; ++corner) {
    const std::uint32_t first = joined.find(corner);
    part[corner] = first == corner ? static_cast<std::uint8_t>(parts++) : part[first];
  }
  return parts;
}

void find_faces(CutCells& cut) {
  struct Entry {
    std::array<std::uint32_t, 4> nodes;
    std::uint32_t cell;
    std::uint8_t number;
  };
  std::vector<Entry> entries;
  for (std::uint32_t cell = 0; cell < cut.cells.size(); ++cell)
    for (std::uint8_t number = 0; number < cut.kind->faces.size(); ++number) {
      Entry entry{{kNoCell, kNoCell, kNoCell, kNoCell}, cell, number};
      for (std::size_t k = 0; k < cut.kind->face_corners; ++k) entry.nodes[k] = cut.cells[cell][cut.kind->faces[number][k]];
      std::sort(entry.nodes.begin(), entry.nodes.end());
      entries.push_back(entry);
    }
  std::sort(entries.begin(), entries.end(), [](const Entry& p, const Entry& q) {
    return std::tie(p.nodes, p.cell, p.number) < std::tie(q.nodes, q.cell, q.number);
  });
  cut.face_of.resize(entries.size());
  for (std::size_t k = 0; k < entries.size(); ++k) {
    const bool second = k > 0 && entries[k].nodes == entries[k - 1].nodes;
    if (!second) cut.faces.emplace_back();
    cut.faces.back().cells[second ? 1 : 0] = entries[k].cell;
    cut.faces.back().number[second ? 1 : 0] = entries[k].number;
    cut.face_of[entries[k].cell * cut.kind->faces.size() + entries[k].number] = static_cast<std::uint32_t>(cut.faces.size() - 1);
  }
}

/// Joins the nodes of the copies on both sides of a face, where they have a corner of their own in common.
void join_over(const CutCells& cut, const CellFace& face, DisjointSets& nodes) {
  const auto [one, other] = face.cells;
  const auto corners = cut.kind->corners;
  const auto& on_face = cut.kind->faces[face.number[0]];
  for (std::size_t k = 0; k < cut.kind->face_corners; ++k) {
    const std::uint32_t own = cut.cells[one][on_face[k]];
    const std::uint32_t a = cut.copy_at(one, on_face[k]), b = cut.copy_at(other, cut.corner_of(other, own));
    for (std::size_t l = 0; l < cut.kind->face_corners; ++l)
      nodes.join(static_cast<std::uint32_t>(a * corners + on_face[l]),
                 static_cast<std::uint32_t>(b * corners + cut.corner_of(other, cut.cells[one][on_face[l]])));
  }
}

void number_nodes(CutCells& cut, std::size_t before, DisjointSets& nodes) {
  const auto corners = cut.kind->corners;
  std::vector<std::uint32_t> number(cut.copies.size() * corners, kNoCell);
  const auto at = [&](std::size_t copy, std::size_t corner) -> std::uint32_t& {
    return number[nodes.find(static_cast<std::uint32_t>(copy * corners + corner))];
  };
  for (std::size_t k = 0; k < cut.copies.size(); ++k)
    for (std::size_t c = 0; c < corners; ++c)
      if (cut.part[cut.copies[k].cell][c] == cut.copies[k].part) at(k, c) = cut.cells[cut.copies[k].cell][c];
  cut.origin.resize(before);
  std::iota(cut.origin.begin(), cut.origin.end(), 0U);
  for (std::size_t k = 0; k < cut.copies.size(); ++k)
    for (std::size_t c = 0; c < corners; ++c) {
      std::uint32_t& node = at(k, c);
      if (node == kNoCell) {
        node = static_cast<std::uint32_t>(cut.origin.size());
        cut.origin.push_back(cut.cells[cut.copies[k].cell][c]);
      }
      cut.copies[k].nodes[c] = node;
    }
}

}  // namespace

const CellTopology& kind_of(const Hexahedron*) {
  static constexpr CellTopology kind{8, 4, kHexaLinks, kHexaFaces};
  return kind;
}
const CellTopology& kind_of(const Tetrahedron*) {
  static constexpr CellTopology kind{4, 3, kTetraLinks, kTetraFaces};
  return kind;
}

std::size_t CutCells::corner_of(std::uint32_t cell, std::uint32_t node) const {
  const auto found = std::find(cells[cell].begin(), cells[cell].begin() + static_cast<std::ptrdiff_t>(kind->corners), node);
  assert(found != cells[cell].begin() + static_cast<std::ptrdiff_t>(kind->corners));
  return static_cast<std::size_t>(found - cells[cell].begin());
}

CutCells uncut_cells(const CellTopology& kind, std::vector<CellNodes> cells, std::size_t nodes) {
  CutCells cut;
  cut.kind = &kind;
  cut.cells = std::move(cells);
  cut.at_link.resize(nodes, 0);
  find_faces(cut);
  return cut;
}

void copy_cells(CutCells& cut) {
  const std::size_t nodes = cut.at_link.size();
  const std::size_t corners = cut.kind->corners;
  cut.copies.clear();
  cut.first_copy.clear();
  cut.part.resize(cut.cells.size());
  for (std::uint32_t cell = 0; cell < cut.cells.size(); ++cell) {
    cut.first_copy.push_back(static_cast<std::uint32_t>(cut.copies.size()));
    const std::size_t parts = find_parts(cut, cut.cells[cell], cut.part[cell]);
    for (std::uint8_t part = 0; part < parts; ++part) cut.copies.push_back({cell, part, {}});
  }
  cut.first_copy.push_back(static_cast<std::uint32_t>(cut.copies.size()));

  DisjointSets of_corners(cut.copies.size() * corners);
  std::vector<std::uint32_t> own(nodes, kNoCell);  // a corner of a copy that is the node
  for (std::uint32_t cell = 0; cell < cut.cells.size(); ++cell)
    for (std::size_t c = 0; c < corners; ++c) {
      const auto corner = static_cast<std::uint32_t>(cut.copy_at(cell, c) * corners + c);
      std::uint32_t& first = own[cut.cells[cell][c]];
      if (first == kNoCell) first = corner;
      of_corners.join(first, corner);
    }
  // Between two whole cells all corners are their own, and joined already.
  for (const CellFace& face : cut.faces)
    if (!face.is_outer() && (cut.is_parted(face.cells[0]) || cut.is_parted(face.cells[1]))) join_over(cut, face, of_corners);
  number_nodes(cut, nodes, of_corners);
}

std::vector<std::uint8_t> fixed_nodes(const CutCells& cut, std::span<const std::uint8_t> fixed) {
  std::vector<std::uint8_t> now(fixed.begin(), fixed.end());
  now.resize(cut.origin.size(), 0);
  for (const CellCopy& copy : cut.copies)
    for (const auto& [a, b] : cut.kind->links) {
      const auto& part = cut.part[copy.cell];
      if ((part[a] == copy.part) == (part[b] == copy.part)) continue;
      if (fixed[cut.cells[copy.cell][a]] != 0 && fixed[cut.cells[copy.cell][b]] != 0)
        now[copy.nodes[part[a] == copy.part ? b : a]] = 1;
    }
  return now;
}

std::vector<std::uint8_t> held_copies(const CutCells& cut, std::span<const std::uint8_t> held, std::span<const Element> springs) {
  DisjointSets pieces(cut.origin.size());
  for (const Element& e : springs) pieces.join(e.a, e.b);
  const auto each_node = [&](const auto& visit) {
    for (std::size_t k = 0; k < cut.copies.size(); ++k)
      for (std::size_t c = 0; c < cut.kind->corners; ++c) visit(k, cut.copies[k].nodes[c]);
  };
  each_node([&](std::size_t k, std::uint32_t node) { pieces.join(cut.copies[k].nodes[0], node); });
  std::vector<std::uint8_t> holds(cut.origin.size(), 0);
  for (std::uint32_t node = 0; node < held.size(); ++node)
    if (held[node] != 0) holds[pieces.find(node)] = 1;
  std::vector<std::uint8_t> of_copy;
  for (const CellCopy& copy : cut.copies) of_copy.push_back(holds[pieces.find(copy.nodes[0])]);
  return of_copy;
}

}  // namespace palpate
