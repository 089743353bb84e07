#include "server/body/hexahedra.hpp"

#include <cmath>
#include <map>
#include <numeric>

#include "common/base/sort_stably.hpp"
#include "server/body/tetra_lanes.hpp"

namespace palpate {
namespace {

Mat38 rest_of(const LumpedBody& body, const Hexahedron& hexahedron) {
  Mat38 rest;
  for (int i = 0; i < 8; ++i) rest.col(i) = body.nodes[hexahedron.nodes[static_cast<std::size_t>(i)]];
  return rest;
}

/// Key of an element's shape, rounded to kAlike of its size: the shapes of one lattice differ by rounding.
using ShapeKey = std::array<std::int64_t, 22>;
ShapeKey key_of(const Mat38& rest, std::uint32_t material) {
  constexpr double kAlike = 1e-9;
  const double size = (rest.col(7) - rest.col(0)).norm();
  // The size is rounded, so that two similar shapes use the same unit.
  const double unit = kAlike * std::exp2(std::round(4 * std::log2(size)) / 4);
  ShapeKey key{};
  for (int i = 1; i < 8; ++i)
    for (int r = 0; r < 3; ++r) key[static_cast<std::size_t>(3 * (i - 1) + r)] = std::llround((rest(r, i) - rest(r, 0)) / unit);
  key[21] = material;
  return key;
}

}  // namespace

Hexahedra::Hexahedra(const LumpedBody& body, const BlockMatrix& pattern) : body_(&body) {
  if (body.hexahedra.empty()) return;
  for (const SolidMaterial& m : body.materials) materials_.emplace_back(m);
  cells_.reserve(body.hexahedra.size());
  for (const Hexahedron& h : body.hexahedra) {
    Cell cell{h.nodes, 0, {}};
    for (std::size_t i = 0; i < 8; ++i)
      for (std::size_t j = 0; j < 8; ++j)
        cell.entries[i][j] = i == j ? pattern.diagonal(h.nodes[i]) : pattern.find(h.nodes[i], h.nodes[j]);
    cells_.push_back(cell);
  }
  take_shapes();
  list_incident();
  std::vector<std::uint32_t> all(cells_.size());
  std::iota(all.begin(), all.end(), 0U);
  batches_ = batches(all);
}

void Hexahedra::take_shapes() {
  std::map<ShapeKey, std::uint32_t> known;
  std::vector<HexaShape> shapes;
  for (std::size_t k = 0; k < cells_.size(); ++k) {
    const Hexahedron& h = body_->hexahedra[k];
    const Mat38 rest = rest_of(*body_, h);
    const auto [shape, fresh] = known.try_emplace(key_of(rest, h.material), static_cast<std::uint32_t>(shapes.size()));
    if (fresh) {
      shapes.emplace_back(body_->materials[h.material], h.material, HexaRest(rest));
      of_shape_.push_back(0);
    }
    cells_[k].shape = shape->second;
    ++of_shape_[shape->second];
  }
  shapes_ = std::make_shared<const std::vector<HexaShape>>(std::move(shapes));
}

void Hexahedra::list_incident() {
  first_.assign(body_->nodes.size() + 1, 0);
  for (const Cell& cell : cells_)
    for (const std::uint32_t node : cell.nodes) ++first_[node + 1];
  for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
  incident_.resize(8 * cells_.size());
  auto next = first_;
  for (std::uint32_t k = 0; k < cells_.size(); ++k)
    for (const std::uint32_t node : cells_[k].nodes) incident_[next[node]++] = k;
}

std::vector<Hexahedra::Batch> Hexahedra::batches(std::span<const std::uint32_t> cells) const {
  constexpr std::uint32_t kOwn = ~std::uint32_t{0};
  // First shapes that fill a batch by themselves, then the others of the same material in the given order.
  const auto key = [&](std::uint32_t k) {
    const std::uint32_t shape = cells_[k].shape;
    return std::pair((*shapes_)[shape].material, of_shape_[shape] >= kHexaLanes ? shape : kOwn);
  };
  std::vector<std::uint32_t> order(cells.begin(), cells.end());
  sort_stably(order.begin(), order.end(), [&](auto p, auto q) { return key(p) < key(q); });
  std::vector<Batch> batches;
  for (std::size_t k = 0; k < order.size(); ++k) {
    const Cell& cell = cells_[order[k]];
    const HexaShape& shape = (*shapes_)[cell.shape];
    if (batches.empty() || batches.back().group.count == kHexaLanes || key(order[k - 1]) != key(order[k])) {
      HexaGroup& group = batches.emplace_back().group;
      group.material = shape.material;
      group.damping_s = shape.modes.damping_s;
      if (key(order[k]).second != kOwn) group.shape = &shape;
      for (std::size_t i = 0; i < 8; ++i) group.nodes[i].fill(cell.nodes[i]);
    }
    HexaGroup& group = batches.back().group;
    const std::size_t lane = group.count++;
    batches.back().cells[lane] = order[k];
    for (std::size_t i = 0; i < 8; ++i) group.nodes[i][lane] = cell.nodes[i];
  }
  for (Batch& batch : batches) {
    if (batch.group.shape) continue;
    std::array<const HexaShape*, kHexaLanes> shapes;
    for (std::size_t lane = 0; lane < kHexaLanes; ++lane) shapes[lane] = &shape(batch.cells[lane < batch.group.count ? lane : 0]);
    batch.group.numbers = numbers_of(shapes);
  }
  return batches;
}

void Hexahedra::blocks(const Batch& batch, const Vector& x, double c_d, double c_k, bool clamp, HexaBlocks& blocks) const {
  const TetraMaterial& m = materials_[batch.group.material];
  const std::uint32_t side_by_side = clamp ? 0 : hexa_loops().back().blocks(m, batch.group, x.data(), c_d, c_k, blocks);
  for (std::size_t lane = 0; lane < batch.group.count; ++lane) {
    if (side_by_side >> lane & 1U) continue;
    const HexaShape& at = shape(batch.cells[lane]);
    const HexaTangent tangent(m, gradient(batch.cells[lane], x), clamp);
    for (int i = 0; i < 8; ++i)
      for (int j = 0; j <= i; ++j)
        blocks.set(static_cast<std::size_t>(i), static_cast<std::size_t>(j), lane,
                   tangent.block(m, at.modes, at.rest, i, j, c_d, c_k));
  }
}

Mat37 Hexahedra::gradient(std::uint32_t hexahedron, const Eigen::Ref<const Vector>& y) const {
  const Cell& cell = cells_[hexahedron];
  Mat38 way;  // relative to the first node: the g_i sum to zero
  for (int i = 0; i < 8; ++i)
    way.col(i) = y.segment<3>(3 * static_cast<Eigen::Index>(cell.nodes[static_cast<std::size_t>(i)])) -
                 y.segment<3>(3 * static_cast<Eigen::Index>(cell.nodes[0]));
  return way * shape(hexahedron).rest.g.transpose();
}

void Hexahedra::add_forces(const Vector& x, const Vector& v, Vector& f) const {
  const HexaLoops& loops = hexa_loops().back();
  for (const Batch& batch : batches_)
    loops.add_forces(materials_[batch.group.material], batch.group, x.data(), v.data(), f.data());
  if (empty() || body_->mass_damping_1_s == 0) return;
  for (std::uint32_t i = 0; i < body_->nodes.size(); ++i)
    at_node(f, i) -= body_->mass_damping_1_s * body_->masses_kg[i] * at_node(v, i);
}

Vec3 Hexahedra::force_on(const BodyState& state, std::uint32_t node) const {
  if (empty()) return Vec3::Zero();
  Vec3 sum = -body_->mass_damping_1_s * body_->masses_kg[node] * at_node(state.v, node);
  for (std::uint32_t k = first_[node]; k < first_[node + 1]; ++k) {
    const std::uint32_t cell = incident_[k];
    const HexaShape& at = shape(cell);
    const Mat37 here = gradient(cell, state.x);
    const Mat37 p = elastic_stress(material(cell), at.modes, at.rest, here) +
                    viscous_stress(material(cell), at.modes, at.rest, here, gradient(cell, state.v));
    for (int i = 0; i < 8; ++i)
      if (cells_[cell].nodes[static_cast<std::size_t>(i)] == node) sum -= p * at.rest.g.col(i);
  }
  return sum;
}

void Hexahedra::add_tangents(const BodyState& state, double c_d, double c_k, const std::vector<std::uint8_t>& held, bool clamp,
                             BlockMatrix& a) const {
  HexaBlocks side_by_side;
  for (const Batch& batch : batches_) {
    blocks(batch, state.x, c_d, c_k, clamp, side_by_side);
    for (std::size_t lane = 0; lane < batch.group.count; ++lane) {
      const Cell& cell = cells_[batch.cells[lane]];
      side_by_side.add_to(a, lane, cell.nodes, cell.entries, held);
    }
  }
  if (empty()) return;
  for (std::uint32_t i = 0; i < body_->nodes.size(); ++i)
    if (!held[i]) a.block(a.diagonal(i)).diagonal().array() += c_d * body_->mass_damping_1_s * body_->masses_kg[i];
}

std::vector<HexaTangent> Hexahedra::tangents(const BodyState& state) const {
  std::vector<HexaTangent> tangents;
  tangents.reserve(cells_.size());
  for (std::uint32_t k = 0; k < cells_.size(); ++k) tangents.emplace_back(material(k), gradient(k, state.x), false);
  return tangents;
}

double Hexahedra::energy(const Vector& x) const {
  double energy = 0;
  for (std::uint32_t k = 0; k < cells_.size(); ++k)
    energy += elastic_energy(material(k), shape(k).modes, shape(k).rest, gradient(k, x));
  return energy;
}

}  // namespace palpate
