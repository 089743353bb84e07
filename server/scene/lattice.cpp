#include "server/scene/lattice.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdio>

#include "server/scene/cauchy_lattice.hpp"
#include "server/scene/clip.hpp"
#include "server/scene/fixing.hpp"
#include "server/scene/hexa_mesh.hpp"
#include "server/scene/materials.hpp"
#include "server/scene/mesh_solid.hpp"
#include "server/scene/scene_text.hpp"
#include "server/scene/surface.hpp"
#include "server/scene/tetra_mesh.hpp"

namespace palpate {

namespace {

constexpr double kMinCellsAcross = 2;
constexpr std::size_t kMaxClipNodes = 200'000, kMaxGridNodes = 4'000'000;
const std::string kClip = "body.lattice.clip";

/// The 13 neighbours of a node that come after it in the order of the index.
std::vector<Index3> forward_neighbours() {
  std::vector<Index3> out;
  for (int k = 0; k <= 1; ++k) {
    for (int j = -1; j <= 1; ++j) {
      for (int i = -1; i <= 1; ++i) {
        if (k > 0 || j > 0 || (j == 0 && i > 0)) out.push_back({i, j, k});
      }
    }
  }
  return out;
}

/// Number of the layer that holds a midpoint, counted from 1; 0 for none. The last of the list wins.
std::uint32_t layer_at(const Vec3& midpoint, const LatticeSettings& settings) {
  // A midpoint on the bound counts as above it, however its coordinates were rounded.
  const Eigen::Array3d m = midpoint.array() + 1e-9;
  for (auto i = static_cast<std::uint32_t>(settings.layers.size()); i > 0; --i) {
    const LayerSettings& layer = settings.layers[i - 1];
    if ((m < layer.below_m.array()).all() && (m >= layer.above_m.array()).all()) return i;
  }
  return 0;
}

void set_material(Element& element, const Vec3& midpoint, const LatticeSettings& settings) {
  const std::uint32_t layer = layer_at(midpoint, settings);
  element.stiffness_n_m = layer > 0 ? settings.layers[layer - 1].stiffness_n_m : settings.stiffness_n_m;
  element.damping_n_s_m = layer > 0 ? settings.layers[layer - 1].damping_n_s_m : settings.damping_n_s_m;
}

Grid box_grid(const LatticeSettings& settings) {
  Grid grid{settings.nodes, settings.origin_m, settings.size_m};
  if (settings.planar) grid.size[2] = 0;
  return grid;
}

std::unique_ptr<SignedDistance> make_solid(const ClipSettings& clip, const SceneText& text) {
  if (!clip.mesh) return make_ellipsoids(clip.ellipsoids, clip.blend_m);
  const std::string where = text.where(kClip + ".mesh.file") + ": mesh " + clip.mesh->file;
  return make_mesh_solid(read_closed_mesh(*clip.mesh, where));
}

std::string millimetres(double metres) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g mm", metres * 1e3);
  return text;
}

/// Grid around the solid; refuses a spacing that does not fit.
Grid grid_in_reach(const SignedDistance& solid, const LatticeSettings& settings, const SceneText& text) {
  const double spacing = settings.spacing_m;
  const Vec3 extent = solid.bounds().sizes();
  const double widest = extent.minCoeff() / kMinCellsAcross, finest = std::cbrt(extent.prod() / kMaxClipNodes);
  const auto refuse = [&](const std::string& expected) {
    text.refuse("body.lattice.spacing_m",
                "body.lattice.spacing_m is " + millimetres(spacing) + " for a clip of " + millimetres(extent[0]) + " x " +
                    millimetres(extent[1]) + " x " + millimetres(extent[2]) +
                    (settings.clip && settings.clip->mesh
                         ? ", whose mesh has scale " + Json::number(settings.clip->mesh->scale).text + " (m per unit of its file)"
                         : ""),
                expected);
  };
  if (spacing > widest * (1 + 1e-9)) refuse("at most " + millimetres(widest) + " (two cells across)");
  if (spacing < 0.5 * finest) refuse("at least about " + millimetres(finest) + " (200000 nodes)");
  return grid_around(solid, spacing);
}

Clipped clip(const Grid& grid, const SignedDistance& solid, const SceneText& text) {
  if (grid.count() > kMaxGridNodes) text.refuse(kClip, "the lattice around the clip is too fine", "a larger spacing");
  Clipped clipped = clip_lattice(grid, solid);
  if (clipped.cells.count() == 0)
    text.refuse(kClip, "no cell of the lattice lies inside the clip", "a clip that overlaps it, or a smaller spacing");
  if (const auto n = clipped.nodes.positions.size(); n > kMaxClipNodes) {
    text.refuse(kClip, "the clip keeps " + std::to_string(n) + " nodes", "at most 200000; a larger spacing");
  }
  return clipped;
}

/// Elements of a set of cells, in the order of the grid.
std::vector<Element> join_neighbours(const LatticeBody& lattice, const CellSet& cells, const LatticeSettings& settings) {
  const auto neighbours = forward_neighbours();
  const LumpedBody& body = lattice.body;
  const Grid& grid = lattice.grid;
  const auto& number = lattice.number;
  std::vector<Element> elements;
  grid.each([&](const Index3& n) {
    const auto a = number[grid.index(n)];
    if (a == kNoNode) return;
    for (const Index3& d : neighbours) {
      if (grid.nodes[2] == 1 && d[2] != 0) continue;
      if (!cells.joins(n, d)) continue;
      Element element;
      element.a = a;
      element.b = number[grid.index(n + d)];
      element.rest_length_m = (body.nodes[element.b] - body.nodes[a]).norm();
      set_material(element, 0.5 * (body.nodes[a] + body.nodes[element.b]), settings);
      elements.push_back(element);
    }
  });
  return elements;
}

/// Sides of a cell [m]; for a sheet with its thickness.
Vec3 cell_of(const Grid& grid, const LatticeSettings& settings) {
  Vec3 cell = grid.spacing();
  if (settings.planar) cell.z() = settings.size_m.z();
  return cell;
}

std::vector<std::uint32_t> corners_of(const Index3& c, const LatticeBody& lattice, bool planar) {
  std::vector<std::uint32_t> corners;
  for (int i = 0; i < (planar ? 4 : 8); ++i)
    corners.push_back(lattice.number[lattice.grid.index(c + Index3{i & 1, i >> 1 & 1, i >> 2})]);
  return corners;
}

Vec3 middle_of(const Index3& c, const LatticeBody& lattice, bool planar) {
  Vec3 sum = Vec3::Zero();
  const std::vector<std::uint32_t> corners = corners_of(c, lattice, planar);
  for (const std::uint32_t node : corners) sum += lattice.body.nodes[node];
  return sum / static_cast<double>(corners.size());
}

/// Adds springs that resist as a solid does, and the masses of the cells.
void join_cells(LatticeBody& lattice, const CellSet& cells, const LatticeSettings& settings) {
  const Vec3 cell = cell_of(lattice.grid, settings);
  const auto springs = cauchy_springs(cell, settings.planar);
  assert(springs);
  std::vector<CauchyMaterial> materials;
  cells.each([&](const Index3& c) {
    if (!cells.has(c)) return;
    const std::uint32_t layer = layer_at(middle_of(c, lattice, settings.planar), settings);
    const SolidMaterial* const own = layer > 0 ? &settings.layers[layer - 1].material : nullptr;
    materials.push_back(own ? CauchyMaterial{own->young_pa, own->damping_s}
                            : CauchyMaterial{settings.springs_of_solid->young_pa, settings.springs_of_solid->damping_s});
  });
  lattice.body.elements = springs_of_cells(cells, lattice.grid, lattice.number, lattice.body.nodes, *springs, materials);
  if (!settings.planar) {
    const std::vector<Hexahedron> boxes = cells_as_hexahedra(cells, lattice.grid, lattice.number);
    lattice.body.masses_kg = lumped_masses(boxes, lattice.body.nodes, settings.density_kg_m3);
    return;
  }
  lattice.body.masses_kg.assign(lattice.body.nodes.size(), 0);
  cells.each([&](const Index3& c) {
    for (const std::uint32_t node : corners_of(c, lattice, true))
      lattice.body.masses_kg[node] += 0.25 * settings.density_kg_m3 * cell.prod();
  });
}

/// Adds equal springs, or those that resist as a solid does.
void join(LatticeBody& lattice, const CellSet& cells, const LatticeSettings& settings) {
  if (settings.springs_of_solid)
    join_cells(lattice, cells, settings);
  else
    lattice.body.elements = join_neighbours(lattice, cells, settings);
}

/// Adds finite elements in the cells, their masses and their surface, with the faces split along the diagonals of split_cells().
void fill_cells(LatticeBody& lattice, const CellSet& cells, const LatticeSettings& settings) {
  LumpedBody& body = lattice.body;
  body.mass_damping_1_s = settings.solid->mass_damping_1_s;
  body.materials = {settings.solid->material};
  for (const LayerSettings& layer : settings.layers) body.materials.push_back(layer.material);
  set_relaxation(body, settings.solid->relaxation);
  const auto place = [&](auto& elements) {
    for (auto& element : elements) element.material = layer_at(centre_of(element, body.nodes), settings);
    body.masses_kg = lumped_masses(elements, body.nodes, settings.density_kg_m3);
  };
  const std::vector<Tetrahedron> split = split_cells(cells, lattice.grid, lattice.number);
  body.triangles = outer_faces(split);
  if (settings.solid->element == SolidElement::tetrahedron) {
    body.tetrahedra = split;
    place(body.tetrahedra);
  } else {
    body.hexahedra = cells_as_hexahedra(cells, lattice.grid, lattice.number);
    place(body.hexahedra);
  }
}

/// Adds nodes, elements and surface of a whole grid; returns its volume.
double fill_box(LatticeBody& lattice, const LatticeSettings& settings) {
  lattice.grid = box_grid(settings);
  const CellSet cells(lattice.grid, true);
  auto nodes = number_nodes(lattice.grid, cells);
  lattice.number = std::move(nodes.number);
  lattice.body.nodes = std::move(nodes.positions);
  if (settings.solid) {
    fill_cells(lattice, cells, settings);
  } else {
    if (!settings.planar) lattice.body.triangles = split_alternately(boundary_faces(cells, lattice.grid, lattice.number));
    join(lattice, cells, settings);
  }
  return settings.size_m.prod();
}

/// The same for a clipped grid.
double fill_clip(LatticeBody& lattice, const LatticeSettings& settings, const SceneText& text) {
  const auto solid = make_solid(*settings.clip, text);
  lattice.grid = settings.spacing_m > 0 ? grid_in_reach(*solid, settings, text) : box_grid(settings);
  Clipped clipped = clip(lattice.grid, *solid, text);
  if (settings.solid) shorten_moves_of_tetrahedra(clipped, lattice.grid);
  lattice.number = std::move(clipped.nodes.number);
  lattice.body.nodes = std::move(clipped.nodes.positions);
  lattice.body.left_out_share = clipped.left_out_share;
  if (settings.solid) {
    fill_cells(lattice, clipped.cells, settings);
  } else {
    lattice.body.triangles = split_shorter(clipped.faces, lattice.body.nodes);
    join(lattice, clipped.cells, settings);
  }
  const double volume = signed_volume(lattice.body.triangles, lattice.body.nodes);
  if (settings.spacing_m > 0 && solid->volume() > 0) lattice.body.left_out_share = 1 - volume / solid->volume();
  return volume;
}

/// Adds what does not depend on the shape; the masses follow from `volume` [m^3].
void finish(LatticeBody& lattice, const LatticeSettings& settings, double volume) {
  LumpedBody& body = lattice.body;
  body.planar = settings.planar;
  body.law = settings.law;
  body.stiffening = settings.law == SpringLaw::stiffening ? settings.stiffening : 0;
  body.gravity_m_s2 = settings.gravity_m_s2;
  if (body.masses_kg.empty())
    body.masses_kg.assign(body.nodes.size(), settings.density_kg_m3 * volume / static_cast<double>(body.nodes.size()));
  fix_nodes(body, settings.fixed, lattice.grid.spacing());
}

void refuse_long_cells(const LatticeSettings& settings, const SceneText& text) {
  const Vec3 cell = cell_of(box_grid(settings), settings);
  if (cauchy_springs(cell, settings.planar)) return;
  std::string sides = millimetres(cell.x()) + " x " + millimetres(cell.y());
  if (!settings.planar) sides += " x " + millimetres(cell.z());
  text.refuse("body.lattice.nodes", "cells are " + sides + ": no springs resist as a solid there",
              "cells whose sides are alike within a factor of about 1.6; finite elements (solid) take any");
}

Vec3 centre_of(const Element& element, const std::vector<Vec3>& nodes) { return (nodes[element.a] + nodes[element.b]) / 2; }

/// Refuses a layer without elements, as it must be a mistake.
void refuse_empty_layers(const LumpedBody& body, const LatticeSettings& settings, const SceneText& text) {
  for (std::size_t k = 0; k < settings.layers.size(); ++k) {
    LatticeSettings alone;
    alone.layers = {settings.layers[k]};
    const auto takes = [&](const auto& element) { return layer_at(centre_of(element, body.nodes), alone) == 1; };
    if (std::ranges::any_of(body.elements, takes) || std::ranges::any_of(body.tetrahedra, takes) ||
        std::ranges::any_of(body.hexahedra, takes))
      continue;
    Eigen::AlignedBox3d box;
    for (const Vec3& node : body.nodes) box.extend(node);
    const std::string path = "body.lattice.layers[" + std::to_string(k) + "]";
    text.refuse(path, path + " takes no part of the body",
                fmt::format("bounds that overlap it: x {:.4g} to {:.4g}, y {:.4g} to {:.4g}, z {:.4g} to {:.4g} m", box.min().x(),
                            box.max().x(), box.min().y(), box.max().y(), box.min().z(), box.max().z()));
  }
}

}  // namespace

LatticeBody build_box(const LatticeSettings& settings) {
  LatticeBody lattice;
  finish(lattice, settings, fill_box(lattice, settings));
  return lattice;
}

LatticeBody build_lattice(const LatticeSettings& settings, const SceneText& text) {
  LatticeBody lattice;
  if (settings.springs_of_solid && settings.spacing_m == 0) refuse_long_cells(settings, text);
  if (settings.clip) {
    finish(lattice, settings, fill_clip(lattice, settings, text));
  } else {
    lattice = build_box(settings);
  }
  refuse_all_fixed(lattice.body, text, "body.lattice");
  refuse_empty_layers(lattice.body, settings, text);
  return lattice;
}

}  // namespace palpate
