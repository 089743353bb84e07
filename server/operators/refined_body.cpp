#include "server/operators/refined_body.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <limits>
#include <numeric>

namespace palpate {

bool RefinedBody::suits(const Dynamics& dynamics) {
  const LumpedBody& body = dynamics.body();
  const bool is_solid = body.elements.empty() && body.is_solid();
  return dynamics.nodes() >= kNodesLeast && !body.planar && body.members.empty() && body.sutures.empty() &&
         (is_solid || SpringBlocks::covers(body));
}

RefinedBody::RefinedBody(const Dynamics& dynamics) : dynamics_(&dynamics), far_(dynamics), coarse_(dynamics, kCoarsePieces) {
  place_corners();
  tangents_ = std::make_unique<RefinedTangents>(*this);
}

void RefinedBody::place_corners() {
  corner_pieces_.resize(far_.corners());
  std::vector<double> nearest(far_.corners(), std::numeric_limits<double>::infinity());
  for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i) {
    const CoarseSpace::Node& from = coarse_.nodes()[i];
    if (from.piece == CoarseSpace::kNone) continue;
    const std::uint32_t cell = far_.cell_of(i);
    for (std::size_t k = 0; k < FarField::kCorners; ++k) {
      const std::uint32_t corner = far_.corners_of(cell)[k];
      const Vec3 way = far_.corner(cell, k) - dynamics_->body().nodes[i];
      if (!(way.squaredNorm() < nearest[corner])) continue;
      nearest[corner] = way.squaredNorm();
      corner_pieces_[corner] = from;
      Eigen::Map<Eigen::Vector3f>(corner_pieces_[corner].arm) += way.cast<float>();
    }
  }
}

bool RefinedBody::is_close(std::uint32_t cell, std::span<const Vec3> places, double spacings) const {
  const double most = spacings * far_.spacing_m();
  return std::any_of(places.begin(), places.end(), [&](const Vec3& p) { return (far_.centre(cell) - p).norm() <= most; });
}

void RefinedBody::focus(std::span<const Vec3> places, std::span<const std::uint32_t> nodes) {
  // Hysteresis, as new coordinates cost a new pattern and all first guesses of solves.
  constexpr double kKeptNearShare = 0.75;        // of kNearSpacings: near cells are kept while they include all within it
  constexpr std::size_t kNearCellsRatioMax = 2;  // of near cells to those that would be chosen now; more: slower patches
  std::vector<std::uint8_t> needed(far_.cells(), 0), wanted(far_.cells(), 0);
  for (std::uint32_t c = 0; c < far_.cells(); ++c) {
    needed[c] = is_close(c, places, kKeptNearShare * kNearSpacings);
    wanted[c] = is_close(c, places, kNearSpacings);
  }
  for (const std::uint32_t i : nodes) needed[far_.cell_of(i)] = wanted[far_.cell_of(i)] = 1;
  const auto count = [](const std::vector<std::uint8_t>& cells) {
    return static_cast<std::size_t>(std::count(cells.begin(), cells.end(), 1));
  };
  bool keeps = near_.size() == needed.size() && count(near_) <= kNearCellsRatioMax * count(wanted);
  for (std::uint32_t c = 0; keeps && c < far_.cells(); ++c) keeps = near_[c] >= needed[c];
  if (keeps) return;
  near_ = std::move(wanted);
  ++generation_;
  number();
  tangents_->lay_out();
}

void RefinedBody::number() {
  coordinate_.assign(dynamics_->nodes(), kNone);
  corner_.assign(far_.corners(), kNone);
  rows_ = 0;
  // Cell by cell, for locality.
  for (std::uint32_t c = 0; c < far_.cells(); ++c) {
    if (near_[c])
      for (const std::uint32_t i : far_.nodes_of(c)) coordinate_[i] = rows_++;
    else
      for (const std::uint32_t k : far_.corners_of(c))
        if (corner_[k] == kNone) corner_[k] = rows_++;
  }
  pieces_.assign(rows_, {});
  for (std::uint32_t k = 0; k < corner_.size(); ++k)
    if (corner_[k] != kNone) pieces_[corner_[k]] = corner_pieces_[k];
  fixed_.assign(rows_, 0);
  masses_ = Vector::Zero(3 * static_cast<Eigen::Index>(rows_));
  for (std::uint32_t c = 0; c < far_.cells(); ++c) {
    if (near_[c])
      for (const std::uint32_t i : far_.nodes_of(c)) {
        pieces_[coordinate_[i]] = coarse_.nodes()[i];
        fixed_[coordinate_[i]] = dynamics_->body().fixed[i];
        at_node(masses_, coordinate_[i]).setConstant(dynamics_->body().masses_kg[i]);
      }
    else
      for (std::size_t k = 0; k < FarField::kCorners; ++k)
        at_node(masses_, corner_[far_.corners_of(c)[k]]).array() += far_.masses(c)[static_cast<Eigen::Index>(k)];
  }
  // A corner without mass moves nothing: all nodes around it are fixed, or on the opposite side of their cells.
  constexpr double kMassRounding = 1e-9;  // of the largest mass: N of nodes on the opposite side, rounded
  const double most = masses_.maxCoeff();
  for (std::uint32_t row = 0; row < rows_; ++row)
    if (!(masses_[3 * static_cast<Eigen::Index>(row)] > kMassRounding * most)) {
      fixed_[row] = 1;
      at_node(masses_, row).setConstant(most);
    }
}

std::span<const RefinedBody::Share> RefinedBody::shares(std::uint32_t node,
                                                        std::array<Share, FarField::kCorners>& scratch) const {
  if (coordinate_[node] != kNone) {
    scratch[0] = {coordinate_[node], 1};
    return std::span(scratch).first(1);
  }
  const auto& corners = far_.corners_of(far_.cell_of(node));
  const FarField::Shape& n = far_.shape(node);
  for (std::size_t k = 0; k < scratch.size(); ++k) scratch[k] = {corner_[corners[k]], n[static_cast<Eigen::Index>(k)]};
  return scratch;
}

void RefinedBody::take(const BodyState& state) {
  state_ = &state;
  tangents_->take(state);
  take_loads(state);
}

void RefinedBody::assemble(double c_m, double c_d, double c_k, const std::vector<std::uint8_t>& held, bool clamp,
                           BlockMatrix& a) const {
  tangents_->assemble(c_d, c_k, clamp, a);
  for (std::uint32_t row = 0; row < rows_; ++row) {
    a.block(a.diagonal(row)).diagonal() += c_m * at_node(masses_, row);
    for (std::uint32_t e = a.row_begin(row); e < a.row_end(row); ++e)
      if (held[row] || held[a.column(e)]) a.block(e).setZero();
    if (held[row]) a.block(a.diagonal(row)).setIdentity();
  }
}

void RefinedBody::take_loads(const BodyState& state) {
  const LumpedBody& body = dynamics_->body();
  const NodeArrays& f = tangents_->forces(state);
  Vector contact = Vector::Zero(dynamics_->contacts().empty() ? 0 : state.x.size());
  dynamics_->contacts().add_forces(state, contact);
  std::array<Vector, 2> both = restricted_of<2>([&](std::uint32_t i) {
    const double mass_kg = body.masses_kg[i];
    Vec3 load = f.at(i) + mass_kg * body.gravity_m_s2;
    if (contact.size() > 0) load += at_node(contact, i);
    return std::array<Vec3, 2>{load, mass_kg * at_node(state.v, i)};
  });
  loads_ = std::move(both[0]);
  velocity_ = both[1].cwiseQuotient(masses_);
}

std::vector<Vector> RefinedBody::fading() const {
  std::vector<Vector> all = dynamics_->relaxation().pulls(*state_);
  for (Vector& pull : all)
    pull = restricted_of<1>([&](std::uint32_t i) { return std::array<Vec3, 1>{at_node(std::as_const(pull), i)}; })[0];
  return all;
}

template <std::size_t N, typename Of>
std::array<Vector, N> RefinedBody::restricted_of(const Of& of) const {
  std::array<Vector, N> y;
  y.fill(Vector::Zero(3 * static_cast<Eigen::Index>(rows_)));
  for (std::uint32_t c = 0; c < far_.cells(); ++c) {
    if (near_[c]) {
      for (const std::uint32_t i : far_.nodes_of(c)) {
        const std::array<Vec3, N> loads = of(i);
        for (std::size_t k = 0; k < N; ++k) at_node(y[k], coordinate_[i]) = loads[k];
      }
      continue;
    }
    FarField::Shape sums[N][3];
    for (auto& sum : sums) std::fill(std::begin(sum), std::end(sum), FarField::Shape::Zero());
    for (const std::uint32_t i : far_.nodes_of(c)) {
      const FarField::Shape& n = far_.shape(i);
      const std::array<Vec3, N> loads = of(i);
      for (std::size_t k = 0; k < N; ++k)
        for (int axis = 0; axis < 3; ++axis) sums[k][axis] += loads[k][axis] * n;
    }
    for (std::size_t k = 0; k < N; ++k)
      for (std::size_t corner = 0; corner < FarField::kCorners; ++corner) {
        const auto at = static_cast<Eigen::Index>(corner);
        at_node(y[k], corner_[far_.corners_of(c)[corner]]) += Vec3(sums[k][0][at], sums[k][1][at], sums[k][2][at]);
      }
  }
  return y;
}

Vector RefinedBody::displacement(const Vector& from, const Vector& to) const {
  assert(from.size() == to.size());
  const LumpedBody& body = dynamics_->body();
  const auto moved = restricted_of<1>(
      [&](std::uint32_t i) { return std::array<Vec3, 1>{body.masses_kg[i] * (at_node(to, i) - at_node(from, i))}; });
  return moved[0].cwiseQuotient(masses_);
}

NodeWeights RefinedBody::restricted(const NodeWeights& weights) const {
  NodeWeights to;
  std::array<Share, FarField::kCorners> scratch;
  for (const auto& [node, weight] : weights)
    for (const Share& share : shares(node, scratch)) to.emplace_back(share.coordinate, weight * share.weight);
  return to;
}

PortRows RefinedBody::rows(std::uint32_t node, const Matrix& v) const {
  assert(node < coordinate_.size() && v.rows() == masses_.size());
  PortRows rows = PortRows::Zero(3, v.cols());
  std::array<Share, FarField::kCorners> scratch;
  for (const Share& share : shares(node, scratch))
    rows += share.weight * v.middleRows<3>(3 * static_cast<Eigen::Index>(share.coordinate));
  return rows;
}

Matrix RefinedBody::moved(const Matrix& y, std::span<const std::uint32_t> nodes) const {
  Matrix moved(3 * static_cast<Eigen::Index>(nodes.size()), y.cols());
  for (std::size_t i = 0; i < nodes.size(); ++i) moved.middleRows<3>(3 * static_cast<Eigen::Index>(i)) = rows(nodes[i], y);
  return moved;
}

Matrix RefinedBody::of_nodes(const Matrix& v) const {
  std::vector<std::uint32_t> all(dynamics_->nodes());
  std::iota(all.begin(), all.end(), 0U);
  return moved(v, all);
}

}  // namespace palpate
