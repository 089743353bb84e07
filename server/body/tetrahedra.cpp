#include "server/body/tetrahedra.hpp"

#include <numeric>

#include "common/base/sort_stably.hpp"

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
      if (i < t.corners()) ++first_[t.nodes[i] + 1];
      for (std::size_t j = 0; j < 4; ++j)
        cell.entries[i][j] = t.nodes[i] == t.nodes[j] ? pattern.diagonal(t.nodes[i]) : pattern.find(t.nodes[i], t.nodes[j]);
    }
    cells_.push_back(cell);
  }
  for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
  incident_.resize(first_.back());
  auto next = first_;
  for (std::uint32_t k = 0; k < cells_.size(); ++k)
    for (std::size_t i = 0; i < body.tetrahedra[k].corners(); ++i) incident_[next[cells_[k].nodes[i]]++] = k;
  std::vector<std::uint32_t> all(cells_.size());
  std::iota(all.begin(), all.end(), 0U);
  batches_ = batches(all);
}

std::vector<Tetrahedra::Batch> Tetrahedra::batches(std::span<const std::uint32_t> cells) const {
  std::vector<std::uint32_t> order(cells.begin(), cells.end());
  sort_stably(order.begin(), order.end(), [&](auto p, auto q) { return cells_[p].material < cells_[q].material; });
  std::vector<Batch> batches;
  for (const std::uint32_t k : order) {
    const Cell& cell = cells_[k];
    if (batches.empty() || batches.back().group.count == kTetraLanes || batches.back().group.material != cell.material) {
      TetraGroup& group = batches.emplace_back().group;
      group.material = cell.material;
      for (std::size_t i = 0; i < 4; ++i) group.nodes[i].fill(cell.nodes[i]);
    }
    TetraGroup& group = batches.back().group;
    const std::size_t lane = group.count++;
    batches.back().cells[lane] = k;
    group.volume_m3.of[lane] = cell.rest.volume_m3;
    for (std::size_t i = 0; i < 4; ++i) group.nodes[i][lane] = cell.nodes[i];
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t c = 0; c < 3; ++c) group.b[i][c].of[lane] = cell.rest.b(static_cast<int>(c), static_cast<int>(i) + 1);
  }
  return batches;
}

void Tetrahedra::blocks(const Batch& batch, const Vector& x, double c_d, double c_k, bool clamp, TetraBlocks& blocks) const {
  const TetraMaterial& m = materials_[batch.group.material];
  const std::uint32_t side_by_side = clamp ? 0 : tetra_loops().back().blocks(m, batch.group, x.data(), c_d, c_k, blocks);
  for (std::size_t lane = 0; lane < batch.group.count; ++lane) {
    if (side_by_side >> lane & 1U) continue;
    const Cell& cell = cells_[batch.cells[lane]];
    const Mat3 f = nodes_of(cell, x) * cell.rest.b.transpose();
    const TetraTangent tangent(m, f, clamp);
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j <= i; ++j)
        blocks.set(static_cast<std::size_t>(i), static_cast<std::size_t>(j), lane,
                   c_k * tangent.block(cell.rest, i, j) + c_d * viscous_block(m, cell.rest, f, i, j));
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
  for (const Batch& batch : batches_)
    loops.add_forces(materials_[batch.group.material], batch.group, x.data(), v.data(), f.data());
  if (!has_mass() || body_->mass_damping_1_s == 0) return;
  for (std::uint32_t i = 0; i < body_->nodes.size(); ++i)
    at_node(f, i) -= body_->mass_damping_1_s * body_->masses_kg[i] * at_node(v, i);
}

Vec3 Tetrahedra::force_on(const BodyState& state, std::uint32_t node) const {
  if (empty()) return Vec3::Zero();
  Vec3 sum = Vec3::Zero();
  if (has_mass()) sum -= body_->mass_damping_1_s * body_->masses_kg[node] * at_node(state.v, node);
  for (std::uint32_t k = first_[node]; k < first_[node + 1]; ++k) {
    const Cell& cell = cells_[incident_[k]];
    for (int i = 0; i < 4; ++i)
      if (cell.nodes[static_cast<std::size_t>(i)] == node) sum -= stress(cell, state.x, state.v) * cell.rest.b.col(i);
  }
  return sum;
}

void Tetrahedra::add_tangents(const BodyState& state, double c_d, double c_k, const std::vector<std::uint8_t>& held, bool clamp,
                              BlockMatrix& a) const {
  TetraBlocks side_by_side;
  for (const Batch& batch : batches_) {
    blocks(batch, state.x, c_d, c_k, clamp, side_by_side);
    for (std::size_t lane = 0; lane < batch.group.count; ++lane) {
      const Cell& cell = cells_[batch.cells[lane]];
      side_by_side.add_to(a, lane, cell.nodes, cell.entries, held);
    }
  }
  if (!has_mass()) return;
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
