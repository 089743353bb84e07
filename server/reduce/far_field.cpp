#include "server/reduce/far_field.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "server/body/grid_edge.hpp"

namespace palpate {
namespace {

using Index3 = std::array<int, 3>;

/// A grid over a box, as many cells along each axis as fit without being smaller than an edge.
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

/// The smallest cells that are no more than so many.
Grid grid_for(const LumpedBody& body, std::size_t most) {
  Eigen::AlignedBox3d box;
  for (const Vec3& x : body.nodes) box.extend(x);
  return {box, smallest_edge(mean_edge_m(body), most, [&](double edge_m) { return occupied(body, Grid(box, edge_m)); })};
}

}  // namespace

FarField::FarField(const Dynamics& dynamics) : dynamics_(&dynamics) {
  divide();
  assign_springs();
  const BodyState rest = dynamics.rest_state();
  for (std::uint32_t c = 0; c < cells(); ++c) renew(c, rest);
}

void FarField::divide() {
  const LumpedBody& body = dynamics_->body();
  const Grid grid = grid_for(body, std::clamp<std::size_t>(body.nodes.size() / kNodesACell, 1, kCellsMost));
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
  for (std::uint32_t i = 0; i < body.nodes.size(); ++i) {
    shapes_.push_back(shape_in(i, cell_of_[i]));
    cells_[cell_of_[i]].masses += body.masses_kg[i] * shape(i);
  }
  // For each octant of a cell the node that is furthest out there.
  for (Cell& cell : cells_)
    for (std::size_t k = 0; k < kCorners; ++k) {
      const Vec3 out(k & 1 ? 1 : -1, k >> 1 & 1 ? 1 : -1, k >> 2 ? 1 : -1);
      const auto reach = [&](std::uint32_t i) { return out.dot(body.nodes[i] - cell.centre); };
      cell.samples[k] = *std::max_element(cell.nodes.begin(), cell.nodes.end(),
                                          [&](std::uint32_t i, std::uint32_t j) { return reach(i) < reach(j); });
    }
}

void FarField::assign_springs() {
  const LumpedBody& body = dynamics_->body();
  for (std::uint32_t e = 0; e < body.elements.size(); ++e) {
    const std::uint32_t a = body.elements[e].a, b = body.elements[e].b;
    const Vec3 to_a = body.nodes[a] - cells_[cell_of_[a]].centre, to_b = body.nodes[b] - cells_[cell_of_[b]].centre;
    const Vec3 half = 0.5 * (body.nodes[b] - body.nodes[a]);
    // How far out of either cell the middle is, in edges.
    const double out_of_a = (to_a + half).cwiseQuotient(edge_).cwiseAbs().maxCoeff();
    const double out_of_b = (to_b - half).cwiseQuotient(edge_).cwiseAbs().maxCoeff();
    const std::uint32_t home = cell_of_[out_of_b < out_of_a ? b : a];
    Cell& cell = cells_[home];
    const std::uint32_t to = cell_of_[a] == home ? cell_of_[b] : cell_of_[a];
    auto part = std::find_if(cell.parts.begin(), cell.parts.end(), [&](const Part& p) { return p.to == to; });
    if (part == cell.parts.end()) part = cell.parts.insert(part, Part{to, {}, {}, false});
    part->springs.push_back(e);
    ++cell.springs;
  }
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

std::vector<std::uint32_t> FarField::springs_at(const std::vector<std::uint8_t>& cells) const {
  std::vector<std::uint32_t> springs;
  for (std::uint32_t c = 0; c < cells_.size(); ++c)
    for (const Part& part : cells_[c].parts)
      if (cells[c] || cells[part.to]) springs.insert(springs.end(), part.springs.begin(), part.springs.end());
  std::sort(springs.begin(), springs.end());
  return springs;
}

Vec3 FarField::corner(std::uint32_t cell, std::size_t k) const {
  const Vec3 side(k & 1 ? 0.5 : -0.5, k >> 1 & 1 ? 0.5 : -0.5, k >> 2 ? 0.5 : -0.5);
  return cells_[cell].centre + side.cwiseProduct(edge_);
}

double FarField::spacing_m() const {
  return std::cbrt(edge_.prod() * static_cast<double>(cells_.size()) / static_cast<double>(cell_of_.size()));
}

double FarField::bent(const Cell& cell, const Vector& x) const {
  std::array<Vec3, kCorners> moved;
  Vec3 mean = Vec3::Zero();
  for (std::size_t k = 0; k < kCorners; ++k) {
    moved[k] = at_node(x, cell.samples[k]) - cell.then[k];
    mean += moved[k] / static_cast<double>(kCorners);
  }
  double most = 0;
  for (const Vec3& m : moved) most = std::max(most, (m - mean).norm());
  return most / edge_.minCoeff();
}

void FarField::renew(std::uint32_t c, const BodyState& state) {
  Cell& cell = cells_[c];
  for (std::size_t k = 0; k < kCorners; ++k) cell.then[k] = at_node(state.x, cell.samples[k]);
  cell.is_summed = false;
  const LumpedBody& body = dynamics_->body();
  const ElementKernel kernel(body.law, body.stiffening);
  for (Part& part : cell.parts) {
    part.tangent.fill(SpringMatrices::Pair::Zero());
    for (const std::uint32_t e : part.springs) {
      const Element& spring = body.elements[e];
      const ElementState s = kernel.evaluate(spring, at_node(state.x, spring.b) - at_node(state.x, spring.a),
                                             at_node(state.v, spring.b) - at_node(state.v, spring.a));
      const SpringMatrices::Pair both = SpringMatrices::tangents(spring, s);
      const Shape w = shape_in(spring.a, c) - shape_in(spring.b, c);
      auto pair = part.tangent.begin();
      for (Eigen::Index p = 0; p < w.size(); ++p) {
        const SpringMatrices::Pair row = w[p] * both;
        for (Eigen::Index q = p; q < w.size(); ++q) *pair++ += w[q] * row;
      }
    }
  }
}

/// Of the parts of a far cell that are between far cells.
void FarField::add_up(Cell& cell, const std::vector<std::uint8_t>& near) {
  const auto same = [&](const Part& part) { return part.is_far == !near[part.to]; };
  if (cell.is_summed && std::all_of(cell.parts.begin(), cell.parts.end(), same)) return;
  cell.is_summed = true;
  cell.tangent.fill(SpringMatrices::Pair::Zero());
  for (Part& part : cell.parts) {
    part.is_far = !near[part.to];
    for (std::size_t k = 0; part.is_far && k < kPairs; ++k) cell.tangent[k] += part.tangent[k];
  }
}

void FarField::take(const BodyState& state, const std::vector<std::uint8_t>& near) {
  struct Old {
    double bent;
    std::uint32_t cell;
  };
  std::vector<Old> old;
  for (std::uint32_t c = 0; c < cells(); ++c)
    if (const double by = near[c] ? 0.0 : bent(cells_[c], state.x); by > kBent) old.push_back({by, c});
  std::sort(old.begin(), old.end(),
            [](const Old& p, const Old& q) { return p.bent != q.bent ? p.bent > q.bent : p.cell < q.cell; });
  std::size_t springs = 0;
  for (const Old& o : old) {
    if (springs >= kSpringsAFrame) break;
    renew(o.cell, state);
    springs += cells_[o.cell].springs;
  }
  for (std::uint32_t c = 0; c < cells(); ++c)
    if (!near[c]) add_up(cells_[c], near);
}

}  // namespace palpate
