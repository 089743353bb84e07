#include "server/operators/far_field.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "server/body/grid_edge.hpp"

namespace palpate {
namespace {

using Index3 = std::array<int, 3>;

/// A grid over a box, with as many cells along each axis as fit without being smaller than an edge.
struct Grid {
  Vec3 origin = Vec3::Zero(), edge = Vec3::Ones();
  Index3 count{1, 1, 1};

  Grid(const Eigen::AlignedBox3d& box, double edge_m) : origin(box.min()) {
    for (int axis = 0; axis < 3; ++axis) {
      const double extent = box.sizes()[axis];
      int& cells = count[static_cast<std::size_t>(axis)];
      cells = std::max(1, static_cast<int>(extent / edge_m));
      edge[axis] = std::max(extent, 1e-9) / cells;
    }
  }
  Index3 cell_at(const Vec3& x) const {
    Index3 at{};
    for (int axis = 0; axis < 3; ++axis) {
      const auto k = static_cast<std::size_t>(axis);
      at[k] = std::clamp(static_cast<int>((x[axis] - origin[axis]) / edge[axis]), 0, count[k] - 1);
    }
    return at;
  }
  Vec3 corner(const Index3& at) const { return origin + edge.cwiseProduct(Vec3(at[0], at[1], at[2])); }
};

std::size_t occupied(const LumpedBody& body, const Grid& grid) {
  std::set<Index3> cells;
  for (const Vec3& x : body.nodes) cells.insert(grid.cell_at(x));
  return cells.size();
}

/// Returns the grid with the smallest cells of which at most `most` have nodes.
Grid grid_for(const LumpedBody& body, std::size_t most) {
  Eigen::AlignedBox3d box;
  for (const Vec3& x : body.nodes) box.extend(x);
  return {box, smallest_edge(mean_edge_m(body), most, [&](double edge_m) { return occupied(body, Grid(box, edge_m)); })};
}

}  // namespace

FarField::FarField(const Dynamics& dynamics) : dynamics_(&dynamics) { divide(); }

void FarField::divide() {
  const LumpedBody& body = dynamics_->body();
  const std::size_t nodes_a_cell = body.is_solid() ? kNodesASolidCell : kNodesACell;
  const Grid grid = grid_for(body, std::clamp<std::size_t>(body.nodes.size() / nodes_a_cell, 1, kCellsMax));
  edge_ = grid.edge;
  per_edge_ = edge_.cwiseInverse();
  std::map<Index3, std::uint32_t> cell_at, corner_at;
  for (std::uint32_t i = 0; i < body.nodes.size(); ++i) {
    const Index3 at = grid.cell_at(body.nodes[i]);
    const auto [place, is_new] = cell_at.try_emplace(at, cells());
    cell_of_.push_back(place->second);
    if (is_new) {
      Cell& cell = cells_.emplace_back();
      cell.centre = grid.corner(at) + 0.5 * grid.edge;
      for (std::size_t k = 0; k < kCorners; ++k) {
        const Index3 corner{at[0] + static_cast<int>(k & 1), at[1] + static_cast<int>(k >> 1 & 1),
                            at[2] + static_cast<int>(k >> 2)};
        cell.corners[k] = corner_at.try_emplace(corner, static_cast<std::uint32_t>(corner_at.size())).first->second;
      }
    }
    cells_[place->second].nodes.push_back(i);
  }
  corners_ = static_cast<std::uint32_t>(corner_at.size());
  assert(cells() > 0 && edge_.minCoeff() > 0);
  for (std::uint32_t i = 0; i < body.nodes.size(); ++i) {
    shapes_.push_back(shape_in(i, cell_of_[i]));
    cells_[cell_of_[i]].masses += body.masses_kg[i] * shape(i);
  }
  // Finds for each octant of a cell the outermost node in it.
  for (Cell& cell : cells_)
    for (std::size_t k = 0; k < kCorners; ++k) {
      const Vec3 out(k & 1 ? 1 : -1, k >> 1 & 1 ? 1 : -1, k >> 2 ? 1 : -1);
      const auto reach = [&](std::uint32_t i) { return out.dot(body.nodes[i] - cell.centre); };
      cell.samples[k] = *std::max_element(cell.nodes.begin(), cell.nodes.end(),
                                          [&](std::uint32_t i, std::uint32_t j) { return reach(i) < reach(j); });
    }
}

std::uint32_t FarField::home(std::span<const std::uint32_t> nodes) const {
  assert(!nodes.empty());
  Vec3 middle = Vec3::Zero();
  for (const std::uint32_t i : nodes) middle += dynamics_->body().nodes[i] / static_cast<double>(nodes.size());
  constexpr double kDistanceRounding = 1e-9;  // of an edge: distances within it are equal, and the first cell is home
  std::uint32_t home = cell_of_[nodes.front()];
  double least = std::numeric_limits<double>::infinity();
  for (const std::uint32_t i : nodes) {
    const double out = (middle - cells_[cell_of_[i]].centre).cwiseQuotient(edge_).cwiseAbs().maxCoeff();
    if (!(out < least - kDistanceRounding)) continue;
    least = out;
    home = cell_of_[i];
  }
  return home;
}

FarField::Shape FarField::shape_in(std::uint32_t node, std::uint32_t cell) const {
  if (dynamics_->body().fixed[node]) return Shape::Zero();
  const Vec3 at = (dynamics_->body().nodes[node] - cells_[cell].centre).cwiseProduct(per_edge_);
  const double x[2] = {0.5 - at[0], 0.5 + at[0]}, y[2] = {0.5 - at[1], 0.5 + at[1]}, z[2] = {0.5 - at[2], 0.5 + at[2]};
  const double xy[4] = {x[0] * y[0], x[1] * y[0], x[0] * y[1], x[1] * y[1]};
  const Eigen::Map<const Eigen::Array4d> face(xy);
  Shape n;
  n << z[0] * face, z[1] * face;
  return n;
}

Vec3 FarField::corner(std::uint32_t cell, std::size_t k) const {
  const Vec3 side(k & 1 ? 0.5 : -0.5, k >> 1 & 1 ? 0.5 : -0.5, k >> 2 ? 0.5 : -0.5);
  return cells_[cell].centre + side.cwiseProduct(edge_);
}

double FarField::spacing_m() const {
  return std::cbrt(edge_.prod() * static_cast<double>(cells_.size()) / static_cast<double>(cell_of_.size()));
}

FarField::Samples FarField::samples(std::uint32_t cell, const Vector& x) const {
  Samples at;
  for (std::size_t k = 0; k < kCorners; ++k) at[k] = at_node(x, cells_[cell].samples[k]);
  return at;
}

double FarField::distortion(const Samples& from, const Samples& to) const {
  Samples moved;
  Vec3 mean = Vec3::Zero();
  for (std::size_t k = 0; k < kCorners; ++k) {
    moved[k] = to[k] - from[k];
    mean += moved[k] / static_cast<double>(kCorners);
  }
  double most = 0;
  for (const Vec3& m : moved) most = std::max(most, (m - mean).norm());
  return most / edge_.minCoeff();
}

}  // namespace palpate
