#include "server/scene/clip.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace palpate {

namespace {

constexpr std::array<Index3, 6> kSides = {{{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};

Vec3 centre(const Grid& grid, const Index3& c) { return 0.5 * (grid.position(c) + grid.position(c + Index3{1, 1, 1})); }

int kept_sides(const CellSet& cells, const Index3& c) {
  return static_cast<int>(std::count_if(kSides.begin(), kSides.end(), [&](const Index3& side) { return cells.has(c + side); }));
}

/// Removes cells attached by at most one face, until there are none.
void remove_loose_cells(CellSet& cells) {
  for (bool changed = true; changed;) {
    changed = false;
    cells.each([&](const Index3& c) {
      if (!cells.has(c) || kept_sides(cells, c) > 1) return;
      cells.set(c, false);
      changed = true;
    });
  }
}

/// Returns the largest set of cells connected by faces.
CellSet largest_part(const Grid& grid, CellSet cells) {
  CellSet best(grid, false);
  std::size_t best_count = 0;
  cells.each([&](const Index3& seed) {
    if (!cells.has(seed)) return;
    std::vector<Index3> part{seed};
    cells.set(seed, false);
    for (std::size_t i = 0; i < part.size(); ++i) {
      for (const Index3& side : kSides) {
        const Index3 next = part[i] + side;
        if (!cells.has(next)) continue;
        cells.set(next, false);
        part.push_back(next);
      }
    }
    if (part.size() <= best_count) return;
    best_count = part.size();
    best = CellSet(grid, false);
    for (const Index3& c : part) best.set(c, true);
  });
  return best;
}

/// Returns true if the cells of the mask are connected. Bit b of the mask is the cell at offset (b & 1, b >> 1 & 1, b >> 2 & 1)
/// of the eight around a node.
bool hangs_together(unsigned mask) {
  unsigned reached = mask & (0u - mask), before = 0;
  while (reached != before) {
    before = reached;
    for (unsigned b = 0; b < 8; ++b) {
      if (reached >> b & 1u) reached |= mask & (1u << (b ^ 1u) | 1u << (b ^ 2u) | 1u << (b ^ 4u));
    }
  }
  return reached == mask;
}

/// Returns true if, among the eight cells around a node, two diagonal ones of a square are kept and the others not: an edge with
/// four faces.
bool crossed_edge(unsigned mask) {
  for (unsigned axis = 0; axis < 3; ++axis) {
    const unsigned u = 1u << (axis + 1) % 3, v = 1u << (axis + 2) % 3;
    for (unsigned layer = 0; layer < 2; ++layer) {
      const unsigned base = layer << axis;
      const auto bit = [&](unsigned b) { return mask >> (base | b) & 1u; };
      if (bit(0) == bit(u | v) && bit(u) == bit(v) && bit(0) != bit(u)) return true;
    }
  }
  return false;
}

/// Fills the cell nearest to the solid among those around node n that share a face with a kept one.
bool fill_around(CellSet& cells, const Grid& grid, const SignedDistance& solid, const Index3& n) {
  const Index3 low = n + Index3{-1, -1, -1};
  const auto cell = [&](unsigned b) {
    return low + Index3{static_cast<int>(b & 1u), static_cast<int>(b >> 1 & 1u), static_cast<int>(b >> 2 & 1u)};
  };
  unsigned mask = 0;
  for (unsigned b = 0; b < 8; ++b) mask |= cells.has(cell(b)) ? 1u << b : 0u;
  if (mask == 0 || mask == 255u || (hangs_together(mask) && hangs_together(255u & ~mask) && !crossed_edge(mask))) return false;
  double nearest = std::numeric_limits<double>::infinity();
  Index3 chosen{};
  for (unsigned b = 0; b < 8; ++b) {
    const bool touches = (mask >> (b ^ 1u) | mask >> (b ^ 2u) | mask >> (b ^ 4u)) & 1u;
    if ((mask >> b & 1u) || !touches || !cells.inside(cell(b))) continue;
    const double distance = solid.distance(centre(grid, cell(b)));
    if (distance >= nearest) continue;
    nearest = distance;
    chosen = cell(b);
  }
  if (!std::isfinite(nearest)) return false;
  cells.set(chosen, true);
  return true;
}

}  // namespace

Grid grid_around(const SignedDistance& solid, double spacing_m) {
  const Eigen::AlignedBox3d box = solid.bounds();
  Grid grid;
  for (int a = 0; a < 3; ++a) {
    const int cells = static_cast<int>(std::ceil(box.sizes()[a] / spacing_m - 1e-9)) + 2;
    grid.nodes[static_cast<std::size_t>(a)] = cells + 1;
    grid.size[a] = cells * spacing_m;
  }
  grid.origin = box.center() - 0.5 * grid.size;
  return grid;
}

void make_manifold(CellSet& cells, const Grid& grid, const SignedDistance& solid) {
  for (bool changed = true; changed;) {
    changed = false;
    grid.each([&](const Index3& n) { changed = fill_around(cells, grid, solid, n) || changed; });
  }
}

Clipped clip_lattice(const Grid& grid, const SignedDistance& solid) {
  constexpr int kRounds = 5;
  CellSet cells(grid, false);
  cells.each([&](const Index3& c) { cells.set(c, solid.distance(centre(grid, c)) < 0); });
  Clipped body{CellSet(grid, false), {}, {}};  // for the case that all cells are loose
  const auto inside = static_cast<double>(cells.count());
  for (int round = 0; round < kRounds; ++round) {
    remove_loose_cells(cells);
    cells = largest_part(grid, std::move(cells));
    if (cells.count() == 0) break;
    if (round == 0) body.left_out_share = 1 - static_cast<double>(cells.count()) / inside;
    make_manifold(cells, grid, solid);
    body.cells = cells;
    body.nodes = number_nodes(grid, cells);
    body.faces = boundary_faces(cells, grid, body.nodes.number);
    snap_to_surface(body, grid, solid);
    const auto flat = flat_cells(body, grid);
    if (flat.empty()) break;
    for (const Index3& c : flat) cells.set(c, false);
  }
  shorten_moves(body, grid);
  for (const BoundaryFace& face : body.faces) {
    if (face.wall >= 0) continue;
    for (const auto i : face.corners) {
      body.surface_distance_max_m = std::max(body.surface_distance_max_m, std::abs(solid.distance(body.nodes.positions[i])));
    }
  }
  return body;
}

}  // namespace palpate
