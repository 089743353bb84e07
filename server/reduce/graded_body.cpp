#include "server/reduce/graded_body.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "server/body/column_lanes.hpp"

namespace palpate {

bool GradedBody::suits(const Dynamics& dynamics) {
  return dynamics.nodes() >= kNodesLeast && !dynamics.body().planar && SpringBlocks::covers(dynamics.body());
}

GradedBody::GradedBody(const Dynamics& dynamics)
    : dynamics_(&dynamics),
      forces_(dynamics.body()),
      far_(dynamics),
      u_(dynamics.nodes()),
      v_(dynamics.nodes()),
      f_(dynamics.nodes()) {}

bool GradedBody::is_close(std::uint32_t cell, std::span<const Vec3> places, double spacings) const {
  const double most = spacings * far_.spacing_m();
  return std::any_of(places.begin(), places.end(), [&](const Vec3& p) { return (far_.centre(cell) - p).norm() <= most; });
}

void GradedBody::focus(std::span<const Vec3> places, std::span<const std::uint32_t> nodes) {
  constexpr double kKept = 0.75;        // of kNearSpacings: closer than this must be near
  constexpr std::size_t kMoreThan = 2;  // times as many cells as needed are too many
  std::vector<std::uint8_t> needed(far_.cells(), 0), wanted(far_.cells(), 0);
  for (std::uint32_t c = 0; c < far_.cells(); ++c) {
    needed[c] = is_close(c, places, kKept * kNearSpacings);
    wanted[c] = is_close(c, places, kNearSpacings);
  }
  for (const std::uint32_t i : nodes) needed[far_.cell_of(i)] = wanted[far_.cell_of(i)] = 1;
  const auto count = [](const std::vector<std::uint8_t>& cells) {
    return static_cast<std::size_t>(std::count(cells.begin(), cells.end(), 1));
  };
  bool keeps = near_.size() == needed.size() && count(near_) <= kMoreThan * count(wanted);
  for (std::uint32_t c = 0; keeps && c < far_.cells(); ++c) keeps = near_[c] >= needed[c];
  if (keeps) return;
  near_ = std::move(wanted);
  ++generation_;
  number();
  lay_out();
}

void GradedBody::number() {
  coordinate_.assign(dynamics_->nodes(), kNone);
  corner_.assign(far_.corners(), kNone);
  rows_ = 0;
  // Cell by cell: what lies together stays together.
  for (std::uint32_t c = 0; c < far_.cells(); ++c) {
    if (near_[c])
      for (const std::uint32_t i : far_.nodes_of(c)) coordinate_[i] = rows_++;
    else
      for (const std::uint32_t k : far_.corners_of(c))
        if (corner_[k] == kNone) corner_[k] = rows_++;
  }
  fixed_.assign(rows_, 0);
  masses_ = Vector::Zero(3 * static_cast<Eigen::Index>(rows_));
  std::array<Share, FarField::kCorners> room;
  for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i) {
    const double mass_kg = dynamics_->body().masses_kg[i];
    if (coordinate_[i] != kNone) fixed_[coordinate_[i]] = dynamics_->body().fixed[i];
    for (const Share& share : shares(i, room)) at_node(masses_, share.coordinate).array() += share.weight * mass_kg;
  }
  // A corner that moves nothing: all nodes around it are fixed, or on the other side of their cells.
  constexpr double kNothing = 1e-9;
  const double most = masses_.maxCoeff();
  for (std::uint32_t row = 0; row < rows_; ++row)
    if (!(masses_[3 * static_cast<Eigen::Index>(row)] > kNothing * most)) {
      fixed_[row] = 1;
      at_node(masses_, row).setConstant(most);
    }
}

std::span<const GradedBody::Share> GradedBody::shares(std::uint32_t node, std::array<Share, FarField::kCorners>& room) const {
  if (coordinate_[node] != kNone) {
    room[0] = {coordinate_[node], 1};
    return std::span(room).first(1);
  }
  const auto& corners = far_.corners_of(far_.cell_of(node));
  const FarField::Shape n = far_.shape(node);
  for (std::size_t k = 0; k < room.size(); ++k) room[k] = {corner_[corners[k]], n[static_cast<Eigen::Index>(k)]};
  return room;
}

void GradedBody::lay_out() {
  struct Pair {
    std::uint32_t row, column;
    double weight;
  };
  std::vector<Pair> products;  // parallel to blocks_
  std::array<Share, FarField::kCorners> room, other_room;
  const auto add_products = [&](std::span<const Share> p, std::span<const Share> q, double sign) {
    const std::size_t before = products.size();
    for (const Share& one : p)
      for (const Share& other : q) {
        const auto [row, column] = std::minmax(one.coordinate, other.coordinate);
        const bool again = p.data() == q.data() && &other < &one;
        if (!again && one.weight * other.weight != 0) products.push_back({row, column, sign * one.weight * other.weight});
      }
    return static_cast<std::uint32_t>(products.size() - before);
  };
  const std::vector<Element>& elements = dynamics_->body().elements;
  springs_.clear();
  ends_.clear();
  std::vector<std::uint32_t> end_of(dynamics_->nodes(), kNone), end_nodes;
  for (std::uint32_t e = 0; e < elements.size(); ++e) {
    auto [a, b] = std::pair(elements[e].a, elements[e].b);
    if (coordinate_[a] == kNone) std::swap(a, b);
    if (coordinate_[a] == kNone) continue;
    Spring& spring = springs_.emplace_back();
    spring.element = e;
    spring.first = static_cast<std::uint32_t>(products.size());
    const std::span<const Share> one = shares(a, room), other = shares(b, other_room);
    spring.count = add_products(one, one, 1) + add_products(one, other, -1);
    if (coordinate_[b] != kNone) {
      spring.count += add_products(other, other, 1);
      continue;
    }
    if (end_of[b] == kNone) {
      end_of[b] = static_cast<std::uint32_t>(end_nodes.size());
      end_nodes.push_back(b);
    }
    spring.end = end_of[b];
  }
  for (const std::uint32_t node : end_nodes) {
    End& end = ends_.emplace_back();
    end.first = static_cast<std::uint32_t>(products.size());
    const std::span<const Share> corners = shares(node, room);
    end.count = add_products(corners, corners, 1);
  }
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (const Pair& product : products)
    if (product.row != product.column) pairs.emplace_back(product.row, product.column);
  for (std::uint32_t c = 0; c < far_.cells(); ++c) {
    if (near_[c]) continue;
    const auto& corners = far_.corners_of(c);
    for (std::size_t p = 0; p < corners.size(); ++p)
      for (std::size_t q = p + 1; q < corners.size(); ++q) pairs.emplace_back(corner_[corners[p]], corner_[corners[q]]);
  }
  k_ = d_ = BlockMatrix(rows_, pairs);

  blocks_.clear();
  for (const Pair& product : products) blocks_.push_back({k_.find(product.row, product.column), product.weight});
  far_entries_.clear();
  for (std::uint32_t c = 0; c < far_.cells(); ++c) {
    if (near_[c]) continue;
    const auto& corners = far_.corners_of(c);
    for (std::size_t p = 0; p < corners.size(); ++p)
      for (std::size_t q = p; q < corners.size(); ++q) {
        const auto [row, column] = std::minmax(corner_[corners[p]], corner_[corners[q]]);
        far_entries_.push_back(k_.find(row, column));
      }
  }
  mirrored_.clear();
  for (std::uint32_t row = 0; row < rows_; ++row)
    for (std::uint32_t e = k_.diagonal(row) + 1; e < k_.row_end(row); ++e) mirrored_.emplace_back(e, k_.find(k_.column(e), row));
  states_.resize(springs_.size());
}

void GradedBody::take(const BodyState& state) {
  far_.take(state, near_);
  k_.set_zero();
  d_.set_zero();
  add_far();
  const LumpedBody& body = dynamics_->body();
  const ElementKernel kernel(body.law, body.stiffening);
  for (std::size_t k = 0; k < springs_.size(); ++k) {
    const Element& e = body.elements[springs_[k].element];
    states_[k] = kernel.evaluate(e, at_node(state.x, e.b) - at_node(state.x, e.a), at_node(state.v, e.b) - at_node(state.v, e.a));
  }
  add_near([&](std::size_t k) { return ElementKernel::stiffness_symmetric(states_[k], false); }, k_);
  add_near([&](std::size_t k) { return ElementKernel::damping(body.elements[springs_[k].element], states_[k]); }, d_);
  mirror(k_);
  mirror(d_);
  velocity_ = restricted(dynamics_->masses().cwiseProduct(state.v)).cwiseQuotient(masses_);
}

void GradedBody::add_far() {
  const auto add = [](const double* six, Eigen::Map<BlockMatrix::Block> to) {
    to(0, 0) += six[0], to(0, 1) += six[1], to(0, 2) += six[2];
    to(1, 0) += six[1], to(1, 1) += six[3], to(1, 2) += six[4];
    to(2, 0) += six[2], to(2, 1) += six[4], to(2, 2) += six[5];
  };
  const std::uint32_t* entry = far_entries_.data();
  for (std::uint32_t c = 0; c < far_.cells(); ++c) {
    if (near_[c]) continue;
    for (const FarField::Pair& pair : far_.tangent(c)) {
      add(pair.data(), k_.block(*entry));
      add(pair.data() + 6, d_.block(*entry++));
    }
  }
}

template <typename Tangent>
void GradedBody::add_near(const Tangent& tangent, BlockMatrix& a) const {
  std::vector<Mat3> at_ends(ends_.size(), Mat3::Zero());
  const auto add = [&](std::uint32_t first, std::uint32_t count, const Mat3& k) {
    for (std::uint32_t at = first; at < first + count; ++at) a.block(blocks_[at].entry) += blocks_[at].weight * k;
  };
  for (std::size_t k = 0; k < springs_.size(); ++k) {
    const Mat3 own = tangent(k);
    add(springs_[k].first, springs_[k].count, own);
    if (springs_[k].end != kNone) at_ends[springs_[k].end] += own;
  }
  for (std::size_t k = 0; k < ends_.size(); ++k) add(ends_[k].first, ends_[k].count, at_ends[k]);
}

void GradedBody::mirror(BlockMatrix& a) const {
  for (const auto& [upper, lower] : mirrored_) a.block(lower) = a.block(upper).transpose();
}

void GradedBody::assemble(double c_m, double c_d, double c_k, const std::vector<std::uint8_t>& held, bool clamp,
                          BlockMatrix& a) const {
  for (std::uint32_t e = 0; e < a.block_count(); ++e) a.block(e) = c_k * k_.block(e) + c_d * d_.block(e);
  if (clamp) {
    const auto stiffened = [&](std::size_t k) -> Mat3 {
      const ElementState& s = states_[k];
      if (!(s.axial < 0)) return Mat3::Zero();
      return c_k * (ElementKernel::stiffness_symmetric(s, true) - ElementKernel::stiffness_symmetric(s, false));
    };
    add_near(stiffened, a);
    mirror(a);
  }
  for (std::uint32_t row = 0; row < rows_; ++row) {
    a.block(a.diagonal(row)).diagonal() += c_m * at_node(masses_, row);
    for (std::uint32_t e = a.row_begin(row); e < a.row_end(row); ++e)
      if (held[row] || held[a.column(e)]) a.block(e).setZero();
    if (held[row]) a.block(a.diagonal(row)).setIdentity();
  }
}

/// Of a matrix with the pattern of K: number(e, i) the i-th of block e, row by row.
template <typename Number>
void GradedBody::multiply_row(std::uint32_t begin, std::uint32_t end, const std::vector<NodeLanes>& in, const Number& number,
                              NodeLanes& to) const {
  ColumnLanes sx{}, sy{}, sz{};
  for (std::uint32_t e = begin; e < end; ++e) {
    const NodeLanes& other = in[k_.column(e)];
    const ColumnLanes x = lanes(other.x), y = lanes(other.y), z = lanes(other.z);
    sx += number(e, 0) * x + number(e, 1) * y + number(e, 2) * z;
    sy += number(e, 3) * x + number(e, 4) * y + number(e, 5) * z;
    sz += number(e, 6) * x + number(e, 7) * y + number(e, 8) * z;
  }
  lanes(to.x) = sx, lanes(to.y) = sy, lanes(to.z) = sz;
}

void GradedBody::multiply(const Matrix& y, Matrix& k_y, Matrix& d_y) const {
  k_y.resize(y.rows(), y.cols());
  d_y.resize(y.rows(), y.cols());
  std::vector<NodeLanes> in(rows_), k(rows_), d(rows_);
  for (Eigen::Index first = 0; first < y.cols(); first += kColumnLanes) {
    pack_columns(y, first, in);
    for (std::uint32_t row = 0; row < rows_; ++row) {
      multiply_row(
          k_.row_begin(row), k_.row_end(row), in, [&](std::uint32_t e, int i) { return k_.block(e).data()[i]; }, k[row]);
      multiply_row(
          k_.row_begin(row), k_.row_end(row), in, [&](std::uint32_t e, int i) { return d_.block(e).data()[i]; }, d[row]);
    }
    unpack_columns(k, first, k_y);
    unpack_columns(d, first, d_y);
  }
}

void GradedBody::multiply_sum(const Matrix& y, double c_k, double c_d, Matrix& sum) const {
  sum.resize(y.rows(), y.cols());
  std::vector<NodeLanes> in(rows_), out(rows_);
  const auto number = [&](std::uint32_t e, int i) { return c_k * k_.block(e).data()[i] + c_d * d_.block(e).data()[i]; };
  for (Eigen::Index first = 0; first < y.cols(); first += kColumnLanes) {
    pack_columns(y, first, in);
    for (std::uint32_t row = 0; row < rows_; ++row) multiply_row(k_.row_begin(row), k_.row_end(row), in, number, out[row]);
    unpack_columns(out, first, sum);
  }
}

Vector GradedBody::forces(const BodyState& state) {
  const LumpedBody& body = dynamics_->body();
  for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i) {
    u_.set(i, at_node(state.x, i) - body.nodes[i]);
    v_.set(i, at_node(state.v, i));
    f_.set(i, Vec3::Zero());
  }
  for (const auto& slabs : {forces_.even_slabs(), forces_.odd_slabs()})
    for (const SpringBlocks::Slab& slab : slabs) forces_.add_forces(slab, u_, v_, f_);
  Vector f(state.x.size());
  for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i) at_node(f, i) = f_.at(i) + body.masses_kg[i] * body.gravity_m_s2;
  return restricted(f);
}

Vector GradedBody::restricted(const Vector& loads) const {
  Vector y = Vector::Zero(3 * static_cast<Eigen::Index>(rows_));
  for (std::uint32_t c = 0; c < far_.cells(); ++c) {
    if (near_[c]) {
      for (const std::uint32_t i : far_.nodes_of(c)) at_node(y, coordinate_[i]) = at_node(loads, i);
      continue;
    }
    FarField::Shape x = FarField::Shape::Zero(), y_ = x, z = x;
    for (const std::uint32_t i : far_.nodes_of(c)) {
      const FarField::Shape n = far_.shape(i);
      const auto load = at_node(loads, i);
      x += load[0] * n, y_ += load[1] * n, z += load[2] * n;
    }
    for (std::size_t k = 0; k < FarField::kCorners; ++k) {
      const auto corner = static_cast<Eigen::Index>(k);
      at_node(y, corner_[far_.corners_of(c)[k]]) += Vec3(x[corner], y_[corner], z[corner]);
    }
  }
  return y;
}

std::vector<std::uint32_t> GradedBody::near_elements() const {
  std::vector<std::uint32_t> elements;
  for (const Spring& spring : springs_) elements.push_back(spring.element);
  return elements;
}

std::vector<CoarseSpace::Node> GradedBody::pieces(const CoarseSpace& space) const {
  std::vector<CoarseSpace::Node> to(rows_);
  std::vector<double> nearest(rows_, std::numeric_limits<double>::infinity());
  for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i) {
    const CoarseSpace::Node& from = space.nodes()[i];
    if (from.piece == CoarseSpace::kNone) continue;
    if (coordinate_[i] != kNone) {
      to[coordinate_[i]] = from;
      continue;
    }
    // A corner goes with the nearest node of a cell that it moves.
    const std::uint32_t cell = far_.cell_of(i);
    for (std::size_t k = 0; k < FarField::kCorners; ++k) {
      const std::uint32_t row = corner_[far_.corners_of(cell)[k]];
      const Vec3 way = far_.corner(cell, k) - dynamics_->body().nodes[i];
      if (!(way.squaredNorm() < nearest[row])) continue;
      nearest[row] = way.squaredNorm();
      to[row] = from;
      Eigen::Map<Eigen::Vector3f>(to[row].arm) += way.cast<float>();
    }
  }
  return to;
}

Skin::Weights GradedBody::restricted(const Skin::Weights& weights) const {
  Skin::Weights to;
  std::array<Share, FarField::kCorners> room;
  for (const auto& [node, weight] : weights)
    for (const Share& share : shares(node, room)) to.emplace_back(share.coordinate, weight * share.weight);
  return to;
}

PortRows GradedBody::at(std::uint32_t node, const Matrix& v) const {
  PortRows rows = PortRows::Zero(3, v.cols());
  std::array<Share, FarField::kCorners> room;
  for (const Share& share : shares(node, room))
    rows += share.weight * v.middleRows<3>(3 * static_cast<Eigen::Index>(share.coordinate));
  return rows;
}

Matrix GradedBody::moved(const Matrix& y, std::span<const std::uint32_t> nodes) const {
  Matrix moved(3 * static_cast<Eigen::Index>(nodes.size()), y.cols());
  for (std::size_t i = 0; i < nodes.size(); ++i) moved.middleRows<3>(3 * static_cast<Eigen::Index>(i)) = at(nodes[i], y);
  return moved;
}

}  // namespace palpate
