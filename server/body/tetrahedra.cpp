#include "server/body/tetrahedra.hpp"

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
  for (const Cell& cell : cells_) {
    const Mat34 forces = stress(cell, x, v) * cell.rest.b;
    for (int i = 0; i < 4; ++i) at_node(f, cell.nodes[static_cast<std::size_t>(i)]) -= forces.col(i);
  }
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

void Tetrahedra::add_tangents(const BodyState& state, double c_d, double c_k, const std::vector<std::uint8_t>& held, bool clamp,
                              BlockMatrix& a) const {
  for (const Cell& cell : cells_) {
    const TetraMaterial& m = materials_[cell.material];
    const Mat3 f = nodes_of(cell, state.x) * cell.rest.b.transpose();
    const TetraTangent tangent(m, f, clamp);
    for (std::size_t i = 0; i < 4; ++i) {
      if (held[cell.nodes[i]]) continue;
      for (std::size_t j = 0; j <= i; ++j) {
        if (held[cell.nodes[j]]) continue;
        const int p = static_cast<int>(i), q = static_cast<int>(j);
        const Mat3 block = c_k * tangent.block(cell.rest, p, q) + c_d * viscous_block(m, cell.rest, f, p, q);
        a.block(cell.entries[i][j]) += block;
        if (i != j) a.block(cell.entries[j][i]) += block.transpose();
      }
    }
  }
  if (empty()) return;
  for (std::uint32_t i = 0; i < body_->nodes.size(); ++i)
    if (!held[i]) a.block(a.diagonal(i)).diagonal().array() += c_d * body_->mass_damping_1_s * body_->masses_kg[i];
}

std::vector<Tetrahedra::CellTangent> Tetrahedra::tangents(const BodyState& state) const {
  std::vector<CellTangent> tangents;
  tangents.reserve(cells_.size());
  for (const Cell& cell : cells_) {
    const Mat3 f = nodes_of(cell, state.x) * cell.rest.b.transpose();
    tangents.push_back({f, TetraTangent(materials_[cell.material], f, false)});
  }
  return tangents;
}

void Tetrahedra::add_products(const std::vector<CellTangent>& at, const Eigen::Ref<const Matrix>& y, Eigen::Ref<Matrix> k_y,
                              Eigen::Ref<Matrix> d_y) const {
  Mat34 nodes;
  for (std::size_t k = 0; k < cells_.size(); ++k) {
    const Cell& cell = cells_[k];
    const auto row = [&](int i) { return 3 * static_cast<Eigen::Index>(cell.nodes[static_cast<std::size_t>(i)]); };
    for (Eigen::Index column = 0; column < y.cols(); ++column) {
      for (int i = 0; i < 4; ++i) nodes.col(i) = y.col(column).segment<3>(row(i));
      const Mat3 change = nodes * cell.rest.b.transpose();
      const Mat34 elastic = cell.rest.volume_m3 * at[k].elastic.apply(change) * cell.rest.b;
      const Mat34 viscous = cell.rest.volume_m3 * viscous_stress(materials_[cell.material], at[k].f, change) * cell.rest.b;
      for (int i = 0; i < 4; ++i) {
        k_y.col(column).segment<3>(row(i)) += elastic.col(i);
        d_y.col(column).segment<3>(row(i)) += viscous.col(i);
      }
    }
  }
  if (empty()) return;
  for (std::uint32_t i = 0; i < body_->nodes.size(); ++i)
    d_y.middleRows<3>(3 * static_cast<Eigen::Index>(i)) +=
        body_->mass_damping_1_s * body_->masses_kg[i] * y.middleRows<3>(3 * static_cast<Eigen::Index>(i));
}

double Tetrahedra::energy(const Vector& x) const {
  double energy = 0;
  for (const Cell& cell : cells_)
    energy +=
        cell.rest.volume_m3 * elastic_energy_density(materials_[cell.material], nodes_of(cell, x) * cell.rest.b.transpose());
  return energy;
}

}  // namespace palpate
