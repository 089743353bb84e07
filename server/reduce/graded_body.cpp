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
  for (std::size_t k = 0; k < n.size(); ++k) room[k] = {corner_[corners[k]], n[k]};
  return room;
}

void GradedBody::lay_out() {
  const std::vector<Element>& elements = dynamics_->body().elements;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  std::vector<std::vector<Share>> differences;  // of each spring with a near end
  springs_.clear();
  std::array<Share, FarField::kCorners> room;
  for (std::uint32_t e = 0; e < elements.size(); ++e) {
    const std::uint32_t a = elements[e].a, b = elements[e].b;
    if (coordinate_[a] == kNone && coordinate_[b] == kNone) continue;
    springs_.push_back({e, 0, 0});
    std::vector<Share>& w = differences.emplace_back();
    for (const Share& share : shares(a, room)) w.push_back(share);
    for (const Share& share : shares(b, room)) w.push_back({share.coordinate, -share.weight});
    std::erase_if(w, [](const Share& share) { return share.weight == 0; });
    std::sort(w.begin(), w.end(), [](const Share& p, const Share& q) { return p.coordinate < q.coordinate; });
    for (std::size_t p = 0; p < w.size(); ++p)
      for (std::size_t q = p + 1; q < w.size(); ++q) pairs.emplace_back(w[p].coordinate, w[q].coordinate);
  }
  for (std::uint32_t c = 0; c < far_.cells(); ++c) {
    if (near_[c]) continue;
    const auto& corners = far_.corners_of(c);
    for (std::size_t p = 0; p < corners.size(); ++p)
      for (std::size_t q = p + 1; q < corners.size(); ++q) pairs.emplace_back(corner_[corners[p]], corner_[corners[q]]);
  }
  k_ = d_ = BlockMatrix(rows_, pairs);

  blocks_.clear();
  for (std::size_t k = 0; k < springs_.size(); ++k) {
    const std::vector<Share>& w = differences[k];
    springs_[k].first = static_cast<std::uint32_t>(blocks_.size());
    for (std::size_t p = 0; p < w.size(); ++p)
      for (std::size_t q = p; q < w.size(); ++q)
        blocks_.push_back({k_.find(w[p].coordinate, w[q].coordinate), w[p].weight * w[q].weight});
    springs_[k].count = static_cast<std::uint32_t>(blocks_.size()) - springs_[k].first;
  }
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
  add_near();
  mirror(k_);
  mirror(d_);
  velocity_ = restricted(dynamics_->masses().cwiseProduct(state.v)).cwiseQuotient(masses_);
}

void GradedBody::add_far() {
  const auto add = [](const Eigen::Matrix<double, 6, 1>& six, Eigen::Map<BlockMatrix::Block> to) {
    to(0, 0) += six[0], to(0, 1) += six[1], to(0, 2) += six[2];
    to(1, 0) += six[1], to(1, 1) += six[3], to(1, 2) += six[4];
    to(2, 0) += six[2], to(2, 1) += six[4], to(2, 2) += six[5];
  };
  const std::uint32_t* entry = far_entries_.data();
  for (std::uint32_t c = 0; c < far_.cells(); ++c) {
    if (near_[c]) continue;
    const FarField::Tangent& tangent = far_.tangent(c);
    for (std::size_t at = 0; at < tangent.k.size(); ++at, ++entry) {
      add(tangent.k[at], k_.block(*entry));
      add(tangent.d[at], d_.block(*entry));
    }
  }
}

void GradedBody::add_near() {
  for (std::size_t k = 0; k < springs_.size(); ++k) {
    const Spring& spring = springs_[k];
    const Mat3 stiffness = ElementKernel::stiffness_symmetric(states_[k], false);
    const Mat3 damping = ElementKernel::damping(dynamics_->body().elements[spring.element], states_[k]);
    for (std::uint32_t at = spring.first; at < spring.first + spring.count; ++at) {
      k_.block(blocks_[at].entry) += blocks_[at].weight * stiffness;
      d_.block(blocks_[at].entry) += blocks_[at].weight * damping;
    }
  }
}

void GradedBody::mirror(BlockMatrix& a) const {
  for (const auto& [upper, lower] : mirrored_) a.block(lower) = a.block(upper).transpose();
}

void GradedBody::assemble(double c_m, double c_d, double c_k, const std::vector<std::uint8_t>& held, bool clamp,
                          BlockMatrix& a) const {
  for (std::uint32_t row = 0; row < rows_; ++row)
    for (std::uint32_t e = a.row_begin(row); e < a.row_end(row); ++e) {
      if (held[row] || held[a.column(e)]) {
        a.block(e).setZero();
        if (e == a.diagonal(row)) a.block(e).setIdentity();
        continue;
      }
      a.block(e) = c_k * k_.block(e) + c_d * d_.block(e);
      if (e == a.diagonal(row)) a.block(e).diagonal() += c_m * at_node(masses_, row);
    }
  if (!clamp) return;
  std::vector<std::uint8_t> is_held(a.block_count(), 0);
  for (std::uint32_t row = 0; row < rows_; ++row)
    for (std::uint32_t e = a.row_begin(row); e < a.row_end(row); ++e) is_held[e] = held[row] || held[a.column(e)];
  for (std::size_t k = 0; k < springs_.size(); ++k) {
    const ElementState& s = states_[k];
    if (!(s.axial < 0)) continue;
    const Mat3 more = ElementKernel::stiffness_symmetric(s, true) - ElementKernel::stiffness_symmetric(s, false);
    for (std::uint32_t at = springs_[k].first; at < springs_[k].first + springs_[k].count; ++at)
      if (!is_held[blocks_[at].entry]) a.block(blocks_[at].entry) += c_k * blocks_[at].weight * more;
  }
  mirror(a);
}

void GradedBody::multiply(const Matrix& y, Matrix& k_y, Matrix& d_y) const {
  k_y.resize(y.rows(), y.cols());
  d_y.resize(y.rows(), y.cols());
  std::vector<NodeLanes> in(rows_), k(rows_), d(rows_);
  const auto row_of = [&](const BlockMatrix& a, std::uint32_t row, NodeLanes& to) {
    ColumnLanes sx{}, sy{}, sz{};
    for (std::uint32_t e = a.row_begin(row); e < a.row_end(row); ++e) {
      const double* b = a.block(e).data();
      const NodeLanes& other = in[a.column(e)];
      const ColumnLanes x = lanes(other.x), y_ = lanes(other.y), z = lanes(other.z);
      sx += b[0] * x + b[1] * y_ + b[2] * z;
      sy += b[3] * x + b[4] * y_ + b[5] * z;
      sz += b[6] * x + b[7] * y_ + b[8] * z;
    }
    lanes(to.x) = sx, lanes(to.y) = sy, lanes(to.z) = sz;
  };
  for (Eigen::Index first = 0; first < y.cols(); first += kColumnLanes) {
    pack_columns(y, first, in);
    for (std::uint32_t row = 0; row < rows_; ++row) {
      row_of(k_, row, k[row]);
      row_of(d_, row, d[row]);
    }
    unpack_columns(k, first, k_y);
    unpack_columns(d, first, d_y);
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
    std::array<Vec3, FarField::kCorners> sum;
    sum.fill(Vec3::Zero());
    for (const std::uint32_t i : far_.nodes_of(c)) {
      const FarField::Shape n = far_.shape(i);
      for (std::size_t k = 0; k < n.size(); ++k) sum[k] += n[k] * at_node(loads, i);
    }
    for (std::size_t k = 0; k < sum.size(); ++k) at_node(y, corner_[far_.corners_of(c)[k]]) += sum[k];
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
