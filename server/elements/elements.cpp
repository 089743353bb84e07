#include "server/elements/elements.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "common/base/sort_stably.hpp"

namespace palpate {
namespace {

const auto& cells_of(const LumpedBody& body, const TrussShape*) { return body.elements; }
const auto& cells_of(const LumpedBody& body, const TetraShape*) { return body.tetrahedra; }
const auto& cells_of(const LumpedBody& body, const HexaShape*) { return body.hexahedra; }

/// Key of an element's shape, rounded to kAlike of its size: the shapes of one lattice differ by rounding.
template <class Shape>
using ShapeKey = std::array<std::int64_t, 3 * Shape::kNodes + 1>;

template <class Shape>
ShapeKey<Shape> key_of(const typename Shape::Positions& rest, std::uint32_t material, double share) {
  constexpr double kAlike = 1e-9;
  const double size = (rest.colwise() - Vec3(rest.col(0))).colwise().norm().maxCoeff();
  // The size is rounded, so that two similar shapes use the same unit.
  const double unit = kAlike * std::exp2(std::round(4 * std::log2(size)) / 4);
  ShapeKey<Shape> key{};
  key.front() = std::llround(share / kAlike);  // the first node's place is always the same
  for (int i = 1; i < Shape::kNodes; ++i)
    for (int r = 0; r < 3; ++r) key[static_cast<std::size_t>(3 * i + r)] = std::llround((rest(r, i) - rest(r, 0)) / unit);
  key.back() = material;
  return key;
}

/// Entries of a pattern for the pairs of nodes of each cell; `first`, `incident`: cells of each node.
template <class Shape>
std::vector<std::uint32_t> entries_of(const std::vector<ElementCell<Shape>>& cells, std::span<const std::uint32_t> first,
                                      std::span<const std::uint32_t> incident, const BlockPattern& pattern) {
  constexpr std::size_t kNodes = Shape::kNodes;
  std::vector<std::uint32_t> entries(kNodes * kNodes * cells.size());
  std::vector<std::uint32_t> in_row(pattern.rows());  // entry of each column
  for (std::uint32_t i = 0; i < pattern.rows(); ++i) {
    for (std::uint32_t e = pattern.row_begin(i); e < pattern.row_end(i); ++e) in_row[pattern.column(e)] = e;
    for (const std::uint32_t cell : incident.subspan(first[i], first[i + 1] - first[i]))
      for (std::size_t k = 0; k < kNodes; ++k)
        if (cells[cell].nodes[k] == i)
          for (std::size_t l = 0; l < kNodes; ++l) entries[kNodes * (kNodes * cell + k) + l] = in_row[cells[cell].nodes[l]];
  }
  return entries;
}

}  // namespace

template <class Shape>
Elements<Shape>::Elements(const LumpedBody& body, const BlockMatrix& pattern) : body_(&body) {
  const auto& all = cells_of(body, static_cast<const Shape*>(nullptr));
  if (all.empty()) return;
  if constexpr (kIsTruss<Shape>)
    materials_.emplace_back(body);
  else
    for (const SolidMaterial& m : body.materials) materials_.emplace_back(m);
  cells_.reserve(all.size());
  for (const auto& one : all) {
    if constexpr (kIsTruss<Shape>)
      cells_.push_back({{one.a, one.b}, 0, 0});
    else
      cells_.push_back({one.nodes, 0, one.material});
  }
  find_shapes();
  list_incident();
  entries_ = entries_of<Shape>(cells_, first_, incident_, pattern);
  std::vector<std::uint32_t> order(cells_.size());
  std::iota(order.begin(), order.end(), 0U);
  batches_ = batches(order);
  const bool has_mass = !kIsTruss<Shape> && (Shape::kModes > 0 || body.hexahedra.empty());  // a solid's membrane has its mass
  if (!has_mass || body.mass_damping_1_s == 0) return;
  for (const double mass_kg : body.masses_kg) mass_damping_n_s_m_.push_back(body.mass_damping_1_s * mass_kg);
}

template <class Shape>
void Elements<Shape>::find_shapes() {
  std::vector<Shape> shapes;
  if constexpr (kIsTruss<Shape>) {  // each its own, so that batches keep the order of the body
    for (std::uint32_t k = 0; k < cells_.size(); ++k) cells_[k].shape = k;
    for (const Element& spring : body_->elements) shapes.emplace_back(spring);
    of_shape_.assign(cells_.size(), 1);
  } else {
    std::map<ShapeKey<Shape>, std::uint32_t> known;
    ShapeKey<Shape> last{};
    for (std::size_t k = 0; k < cells_.size(); ++k) {
      Cell& cell = cells_[k];
      const double share = cells_of(*body_, static_cast<const Shape*>(nullptr))[k].share;
      typename Shape::Positions rest;
      for (int i = 0; i < Shape::kNodes; ++i) rest.col(i) = body_->nodes[cell.nodes[static_cast<std::size_t>(i)]];
      const ShapeKey<Shape> key = key_of<Shape>(rest, cell.material, share);
      if (k > 0 && key == last) {  // as beside each other in a lattice
        cell.shape = cells_[k - 1].shape;
        ++of_shape_[cell.shape];
        continue;
      }
      last = key;
      const auto [shape, fresh] = known.try_emplace(key, static_cast<std::uint32_t>(shapes.size()));
      if (fresh) {
        shapes.emplace_back(rest, body_->materials[cell.material].young_pa, share);
        of_shape_.push_back(0);
      }
      cell.shape = shape->second;
      ++of_shape_[cell.shape];
    }
  }
  shapes_ = std::make_shared<const std::vector<Shape>>(std::move(shapes));
}

template <class Shape>
void Elements<Shape>::list_incident() {
  const auto for_corners = [&](const auto& of) {  // the last node of a triangle is its first
    for (std::uint32_t k = 0; k < cells_.size(); ++k)
      for (std::size_t i = 0; i < cells_[k].nodes.size(); ++i)
        if (i == 0 || cells_[k].nodes[i] != cells_[k].nodes[0]) of(cells_[k].nodes[i], k);
  };
  first_.assign(body_->nodes.size() + 1, 0);
  for_corners([&](std::uint32_t node, std::uint32_t) { ++first_[node + 1]; });
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  incident_.resize(first_.back());
  auto next = first_;
  for_corners([&](std::uint32_t node, std::uint32_t k) { incident_[next[node]++] = k; });
}

template <class Shape>
std::vector<typename Elements<Shape>::Batch> Elements<Shape>::batches(std::span<const std::uint32_t> cells) const {
  constexpr std::uint32_t kOwn = ~std::uint32_t{0};
  // First shapes that fill a batch by themselves, then the others of the same material in the given order.
  const auto key = [&](std::uint32_t k) {
    const std::uint32_t shape = cells_[k].shape;
    return std::pair(cells_[k].material, of_shape_[shape] >= kElementLanes ? shape : kOwn);
  };
  std::vector<std::uint32_t> order(cells.begin(), cells.end());
  sort_stably(order.begin(), order.end(), [&](auto p, auto q) { return key(p) < key(q); });
  std::vector<Batch> batches;
  for (std::size_t k = 0; k < order.size(); ++k) {
    const Cell& cell = cells_[order[k]];
    if (batches.empty() || batches.back().group.count == kElementLanes || key(order[k - 1]) != key(order[k])) {
      ElementGroup<Shape>& group = batches.emplace_back().group;
      group.material = cell.material;
      if (key(order[k]).second != kOwn) group.shape = &(*shapes_)[cell.shape];
      for (std::size_t i = 0; i < cell.nodes.size(); ++i) group.nodes[i].fill(cell.nodes[i]);
    }
    ElementGroup<Shape>& group = batches.back().group;
    const std::size_t lane = group.count++;
    batches.back().cells[lane] = order[k];
    for (std::size_t i = 0; i < cell.nodes.size(); ++i) group.nodes[i][lane] = cell.nodes[i];
  }
  for (Batch& batch : batches) {
    if (batch.group.shape) continue;
    std::array<const Shape*, kElementLanes> shapes;
    for (std::size_t l = 0; l < kElementLanes; ++l) shapes[l] = &shape(batch.cells[l < batch.group.count ? l : 0]);
    batch.group.numbers = ShapeNumbers<Shape>::of(shapes);
  }
  return batches;
}

template <class Shape>
typename Shape::Gradient Elements<Shape>::gradient(std::uint32_t element, const Eigen::Ref<const Vector>& y) const {
  const Nodes& nodes = cells_[element].nodes;
  typename Shape::Positions of_nodes;
  for (int i = 0; i < Shape::kNodes; ++i)
    of_nodes.col(i) = y.segment<3>(3 * static_cast<Eigen::Index>(nodes[static_cast<std::size_t>(i)]));
  return shape(element).gradient(of_nodes);
}

template <class Shape>
typename Shape::Gradient Elements<Shape>::elastic_stress(std::uint32_t element, const typename Shape::Gradient& at) const
    requires(!kIsTruss<Shape>) {
  const Shape& of = shape(element);
  typename Shape::Gradient p = at;
  p.template leftCols<3>() = of.volume_m3 * palpate::elastic_stress(material(element), at.template leftCols<3>());
  for (int a = 0; a < Shape::kModes; ++a) p.col(3 + a) *= of.k[static_cast<std::size_t>(a)];
  return p;
}

template <class Shape>
void Elements<Shape>::add_forces(const Vector& x, const Vector& v, Vector& f) const {
  const auto add = loops().add_forces;
  for (const Batch& batch : batches_) add(materials_[batch.group.material], batch.group, x.data(), v.data(), f.data());
  for (std::uint32_t i = 0; i < mass_damping_n_s_m_.size(); ++i) at_node(f, i) -= mass_damping_n_s_m_[i] * at_node(v, i);
}

template <class Shape>
Vec3 Elements<Shape>::force_on(const BodyState& state, std::uint32_t node) const {
  Vec3 sum = Vec3::Zero();
  if (empty()) return sum;
  if (!mass_damping_n_s_m_.empty()) sum -= mass_damping_n_s_m_[node] * at_node(state.v, node);
  Vector f = Vector::Zero(state.x.size());
  const std::span<const std::uint32_t> around = std::span(incident_).subspan(first_[node], first_[node + 1] - first_[node]);
  for (const Batch& batch : batches(around))
    loops().add_forces(materials_[batch.group.material], batch.group, state.x.data(), state.v.data(), f.data());
  return sum + at_node(f, node);
}

template <class Shape>
void Elements<Shape>::add_tangents(const BodyState& state, double c_d, double c_k, const std::vector<std::uint8_t>& held,
                                   bool clamp, BlockMatrix& a) const {
  constexpr std::size_t kPairs = std::size_t{Shape::kNodes} * Shape::kNodes;
  Blocks side_by_side;
  for (const Batch& batch : batches_) {
    blocks(batch, state, c_d, c_k, clamp, side_by_side);
    for (std::size_t lane = 0; lane < batch.group.count; ++lane) {
      const std::uint32_t k = batch.cells[lane];
      add_blocks(side_by_side, lane, cells_[k], &entries_[kPairs * k], held, a);
    }
  }
  for (std::uint32_t i = 0; i < mass_damping_n_s_m_.size(); ++i)
    if (!held[i]) a.block(a.diagonal(i)).diagonal().array() += c_d * mass_damping_n_s_m_[i];
}

template <class Shape>
void Elements<Shape>::add_blocks(const Blocks& blocks, std::size_t lane, const Cell& cell, const std::uint32_t* entries,
                                 const std::vector<std::uint8_t>& held, BlockMatrix& a) {
  constexpr std::size_t kNodes = Shape::kNodes;
  for (std::size_t i = 0; i < kNodes; ++i) {
    if (held[cell.nodes[i]]) continue;
    for (std::size_t j = 0; j <= i; ++j) {
      if (held[cell.nodes[j]]) continue;
      BlockMatrix::Block k;
      for (std::size_t n = 0; n < 9; ++n) k.data()[n] = blocks.at[pair_index(i, j)][n].of[lane];
      a.block(entries[kNodes * i + j]) += k;
      if (i != j) a.block(entries[kNodes * j + i]) += k.transpose();
    }
  }
}

template <class Shape>
void Elements<Shape>::find_tangents(const BodyState& state, std::vector<ElementTangent<Shape>>& tangents) const {
  tangents.resize(cells_.size());
  for (const Batch& batch : batches_) {
    std::array<ElementTangent<Shape>*, kElementLanes> to{};
    for (std::size_t lane = 0; lane < batch.group.count; ++lane) to[lane] = &tangents[batch.cells[lane]];
    loops().tangents(materials_[batch.group.material], batch.group, state.x.data(), state.v.data(), to);
  }
}

template <class Shape>
void Elements<Shape>::add_products(const std::vector<ElementTangent<Shape>>& at, const std::vector<NodeLanes>& y, double c_k,
                                   double c_d, std::vector<NodeLanes>& k_y, std::vector<NodeLanes>& d_y) const {
  if (empty()) return;
  loops().add_products({cells_, *shapes_, materials_, at}, y.data(), c_k, c_d, k_y.data(), d_y.data());
  for (std::size_t i = 0; i < mass_damping_n_s_m_.size(); ++i) {
    const double c = c_d * mass_damping_n_s_m_[i];
    lanes(d_y[i].x) += c * lanes(y[i].x);
    lanes(d_y[i].y) += c * lanes(y[i].y);
    lanes(d_y[i].z) += c * lanes(y[i].z);
  }
}

template <class Shape>
double Elements<Shape>::energy(const Vector& x) const {
  double energy = 0;
  if constexpr (kIsTruss<Shape>) {
    for (std::uint32_t k = 0; k < cells_.size(); ++k) {
      const Shape& of = shape(k);
      energy += material(k).energy(of.stiffness_n_m, of.rest_length_m, gradient(k, x).norm() - of.rest_length_m);
    }
  } else {
    std::array<Mat3, 4> f;
    for (std::uint32_t first = 0, count = 0; first < cells_.size(); first += count) {
      for (count = 0; count < f.size() && first + count < cells_.size(); ++count) {
        const std::uint32_t k = first + count;
        if (&material(k) != &material(first)) break;
        const typename Shape::Gradient at = gradient(k, x);
        f[count] = at.template leftCols<3>();
        for (int a = 0; a < Shape::kModes; ++a)
          energy += 0.5 * shape(k).k[static_cast<std::size_t>(a)] * at.col(3 + a).squaredNorm();
      }
      std::fill(f.begin() + count, f.end(), f[0]);
      const std::array<double, 4> density = elastic_energy_densities(material(first), f);
      for (std::uint32_t l = 0; l < count; ++l) energy += shape(first + l).volume_m3 * density[l];
    }
  }
  return energy;
}

template class Elements<TrussShape>;
template class Elements<TetraShape>;
template class Elements<HexaShape>;

}  // namespace palpate
