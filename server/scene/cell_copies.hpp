// Cells of a solid in copies, where cuts part their corners ("virtual nodes").
//
// A link is an edge of a cell: 12 of a hexahedron, 6 of a tetrahedron. The corners of a cell that its uncut links join make one
// copy of the cell, with the share phi of the volume on their side:
//
//     K, D, M of a copy = phi times those of the cell,   sum phi = 1 over the copies of a cell
//
// A copy has nodes for all corners of its cell. Two copies share the nodes of the face between their cells if one of its corners
// is theirs in both. The nodes at corners that are not theirs are new, with the same rest position. K and M scale alike, so the
// largest natural frequency of a copy is that of its cell, however small phi is.
//
// Source: Molino, Bao and Fedkiw, A virtual node algorithm for changing mesh topology during simulation, SIGGRAPH 2004.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "server/scene/scene.hpp"

namespace palpate {

/// Corners, links and faces of a cell; corners of a face are counter-clockwise seen from outside.
struct CellTopology {
  std::size_t corners = 0, face_corners = 0;
  std::span<const std::array<std::uint8_t, 2>> links;
  std::span<const std::array<std::uint8_t, 4>> faces;
};
const CellTopology& kind_of(const Hexahedron*);
const CellTopology& kind_of(const Tetrahedron*);

using CellNodes = std::array<std::uint32_t, 8>;  ///< as many as the kind has corners
using CellLink = std::pair<std::uint32_t, std::uint32_t>;
inline CellLink link_of(std::uint32_t a, std::uint32_t b) { return a < b ? CellLink{a, b} : CellLink{b, a}; }
/// Cut links, each with the share of its length from its lower node to the cut, in (0, 1).
using CutLinks = std::map<CellLink, double>;

inline constexpr std::uint32_t kNoCell = ~std::uint32_t{0};

/// A face of one cell, or between two.
struct CellFace {
  std::array<std::uint32_t, 2> cells{kNoCell, kNoCell};
  std::array<std::uint8_t, 2> number{};  ///< of the face in each cell
  bool is_outer() const { return cells[1] == kNoCell; }
};

struct CellCopy {
  std::uint32_t cell = 0;
  std::uint8_t part = 0;  ///< number of the part of the cell's corners that are its own
  CellNodes nodes{};
};

struct CutCells {
  const CellTopology* kind = nullptr;
  std::vector<CellNodes> cells;  ///< as they were
  CutLinks links;
  std::vector<std::uint8_t> at_link;              ///< of each node: 1 if a cut link ends there
  std::vector<std::array<std::uint8_t, 8>> part;  ///< of each corner of each cell
  std::vector<std::uint32_t> first_copy;          ///< of each cell, and their total
  std::vector<CellCopy> copies;
  std::vector<std::uint32_t> origin;  ///< node at each node of the copies; the nodes that were there come first
  std::vector<CellFace> faces;
  std::vector<std::uint32_t> face_of;  ///< index into `faces` of each face of each cell

  /// Cuts a link.
  void cut(const CellLink& link, double share) {
    if (links.emplace(link, share).second) at_link[link.first] = at_link[link.second] = 1;
  }
  bool is_cut(const CellLink& link) const {
    return at_link[link.first] != 0 && at_link[link.second] != 0 && links.contains(link);
  }
  bool is_parted(std::uint32_t cell) const { return first_copy[cell + 1] - first_copy[cell] > 1; }
  std::uint32_t copy_at(std::uint32_t cell, std::size_t corner) const { return first_copy[cell] + part[cell][corner]; }
  std::uint32_t face_at(std::uint32_t cell, std::size_t face) const { return face_of[cell * kind->faces.size() + face]; }
  std::size_t corner_of(std::uint32_t cell, std::uint32_t node) const;
};

/// Returns cells that nothing cuts yet, which are not in copies.
/// `nodes`: number of nodes of the body.
CutCells uncut_cells(const CellTopology& kind, std::vector<CellNodes> cells, std::size_t nodes);
/// Puts them in copies where `cut.links` part them, anew.
void copy_cells(CutCells& cut);

/// Returns for each node whether it is fixed, from those that were: a new one is where a link joins it, in one of its copies, to
/// a corner of that copy's own that is fixed, as it was itself before. What a cut takes off a fixed face is thus free.
std::vector<std::uint8_t> fixed_nodes(const CutCells& cut, std::span<const std::uint8_t> fixed);

/// Returns for each copy whether some node that is `held` holds it, itself, by other copies or by springs.
std::vector<std::uint8_t> held_copies(const CutCells& cut, std::span<const std::uint8_t> held, std::span<const Element> springs);

}  // namespace palpate
