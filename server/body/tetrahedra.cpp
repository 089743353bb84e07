#include "server/body/tetrahedra.hpp"

#include <algorithm>
#include <numeric>

namespace palpate {

Tetrahedra::Tetrahedra(const LumpedBody& body, const BlockMatrix& pattern) : body_(&body) {
  if (body.tetrahedra.empty()) return;
  for (const SolidMaterial& m : body.materials) materials_.emplace_back(m);
  first_.assign(body.nodes.size() + 1, 0);
  cells_.reserve(body.tetrahedra.size());
  for (const Tetrahedron& t : body.tetrahedra) {
    Mat34 rest;
    for (int i = 0; i < 4; ++i) rest.col(i) = body.nodes[t.nodes[static_cast<std::size_t>(i)]];
    Cell cell{t.nodes, t.material, TetraRest(rest), {}};
    for (std::size_t i = 0; i < 4; ++i) {
      ++first_[t.nodes[i] + 1];
      for (std::size_t j = 0; j < 4; ++j)
        cell.entries[i][j] = i == j ? pattern.diagonal(t.nodes[i]) : pattern.find(t.nodes[i], t.nodes[j]);
    }
    cells_.push_back(cell);
  }
  for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
  incident_.resize(4 * cells_.size());
  auto next = first_;
  for (std::uint32_t k = 0; k < cells_.size(); ++k)
    for (const std::uint32_t node : cells_[k].nodes) incident_[next[node]++] = k;
  make_groups();
}

void Tetrahedra::make_groups() {
  std::vector<std::uint32_t> order(cells_.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(), [&](auto p, auto q) { return cells_[p].material < cells_[q].material; });
  for (const std::uint32_t k : order) {
    const Cell& cell = cells_[k];
    if (groups_.empty() || groups_.back().count == kTetraLanes || groups_.back().material != cell.material) {
      groups_.push_back({});
      lanes_.push_back({});
      groups_.back().material = cell.material;
      for (std::size_t i = 0; i < 4; ++i) groups_.back().nodes[i].fill(cell.nodes[i]);
    }
    TetraGroup& group = groups_.back();
    const std::size_t lane = group.count++;
    lanes_.back()[lane] = k;
    group.volume_m3.of[lane] = cell.rest.volume_m3;
    for (std::size_t i = 0; i < 4; ++i) group.nodes[i][lane] = cell.nodes[i];
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t c = 0; c < 3; ++c) group.b[i][c].of[lane] = cell.rest.b(static_cast<int>(c), static_cast<int>(i) + 1);
  }
}

Mat34 Tetrahedra::nodes_of(const Cell& cell, const Vector& y) const {
  Mat34 nodes;
  for (int i = 0; i < 4; ++i) nodes.col(i) = at_node(y, cell.nodes[static_cast<std::size_t>(i)]);
  return nodes;
}

Mat3 Tetrahedra::stress(const Cell& cell, const Vector& x, const Vector& v) const {
  const TetraMaterial& m = materials_[cell.material];
  const Mat3 f = nodes_of(cell, x) * cell.rest.b.transpose(), rate = nodes_of(cell, v) * cell.rest.b.transpose();
  return cell.rest.volume_m3 * (elastic_stress(m, f) + viscous_stress(m, f, rate));
}

void Tetrahedra::add_forces(const Vector& x, const Vector& v, Vector& f) const {
  const TetraLoops& loops = tetra_loops().back();
  for (const TetraGroup& group : groups_) loops.add_forces(materials_[group.material], group, x.data(), v.data(), f.data());
  if (empty() || body_->mass_damping_1_s == 0) return;
  for (std::uint32_t i = 0; i < body_->nodes.size(); ++i)
    at_node(f, i) -= body_->mass_damping_1_s * body_->masses_kg[i] * at_node(v, i);
}

Vec3 Tetrahedra::force_on(const BodyState& state, std::uint32_t node) const {
  if (empty()) return Vec3::Zero();
  Vec3 sum = -body_->mass_damping_1_s * body_->masses_kg[node] * at_node(state.v, node);
  for (std::uint32_t k = first_[node]; k < first_[node + 1]; ++k) {
    const Cell& cell = cells_[incident_[k]];
    for (int i = 0; i < 4; ++i)
      if (cell.nodes[static_cast<std::size_t>(i)] == node) sum -= stress(cell, state.x, state.v) * cell.rest.b.col(i);
  }
  return sum;
}

/// block(i, j) for j <= i.
template <class Block>
void Tetrahedra::add_pairs(const Cell& cell, const std::vector<std::uint8_t>& held, const Block& block, BlockMatrix& a) const {
  for (std::size_t i = 0; i < 4; ++i) {
    if (held[cell.nodes[i]]) continue;
    for (std::size_t j = 0; j <= i; ++j) {
      if (held[cell.nodes[j]]) continue;
      const Mat3 k = block(i, j);
      a.block(cell.entries[i][j]) += k;
      if (i != j) a.block(cell.entries[j][i]) += k.transpose();
    }
  }
}

void Tetrahedra::add_tangents(const BodyState& state, double c_d, double c_k, const std::vector<std::uint8_t>& held, bool clamp,
                              BlockMatrix& a) const {
  const TetraLoops& loops = tetra_loops().back();
  TetraBlocks blocks;
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    const TetraMaterial& m = materials_[groups_[g].material];
    const std::uint32_t side_by_side = clamp ? 0 : loops.blocks(m, groups_[g], state.x.data(), c_d, c_k, blocks);
    for (std::size_t lane = 0; lane < groups_[g].count; ++lane) {
      const Cell& cell = cells_[lanes_[g][lane]];
      if (side_by_side >> lane & 1U) {
        const auto block = [&](std::size_t i, std::size_t j) {
          Mat3 k;
          for (std::size_t n = 0; n < 9; ++n)
            k(static_cast<int>(n / 3), static_cast<int>(n % 3)) = blocks.at[pair_index(i, j)][n].of[lane];
          return k;
        };
        add_pairs(cell, held, block, a);
      } else {
        const Mat3 f = nodes_of(cell, state.x) * cell.rest.b.transpose();
        const TetraTangent tangent(m, f, clamp);
        const auto block = [&](std::size_t i, std::size_t j) -> Mat3 {
          const int p = static_cast<int>(i), q = static_cast<int>(j);
          return c_k * tangent.block(cell.rest, p, q) + c_d * viscous_block(m, cell.rest, f, p, q);
        };
        add_pairs(cell, held, block, a);
      }
    }
  }
  if (empty()) return;
  for (std::uint32_t i = 0; i < body_->nodes.size(); ++i)
    if (!held[i]) a.block(a.diagonal(i)).diagonal().array() += c_d * body_->mass_damping_1_s * body_->masses_kg[i];
}

std::vector<TetraTangent> Tetrahedra::tangents(const BodyState& state) const {
  std::vector<TetraTangent> tangents;
  tangents.reserve(cells_.size());
  for (const Cell& cell : cells_)
    tangents.emplace_back(materials_[cell.material], nodes_of(cell, state.x) * cell.rest.b.transpose(), false);
  return tangents;
}

double Tetrahedra::energy(const Vector& x) const {
  double energy = 0;
  for (const Cell& cell : cells_)
    energy +=
        cell.rest.volume_m3 * elastic_energy_density(materials_[cell.material], nodes_of(cell, x) * cell.rest.b.transpose());
  return energy;
}

}  // namespace palpate
