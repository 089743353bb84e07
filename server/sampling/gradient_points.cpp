#include "server/sampling/gradient_points.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "common/base/rotation_vector.hpp"
#include "server/operators/local_body.hpp"
#include "server/sampling/element_gradient.hpp"

namespace palpate {
namespace {

/// Returns orthogonal d_c of one length, right-handed, with b . d_c = -1.
Mat3 axes_towards(const Vec3& b) {
  const Vec3 diagonal = Vec3::Constant(-1 / std::sqrt(3.0));
  return std::sqrt(3.0) / b.norm() * shortest_rotation(diagonal, b).toRotationMatrix();
}

}  // namespace

GradientPoints::GradientPoints(const Dynamics& dynamics, const BodyState& state, const Matrix& moved,
                               std::vector<std::uint32_t> elements, int tool)
    : dynamics_(&dynamics), elements_(std::move(elements)), tool_(tool < 0 ? -1 : static_cast<int>(kHeld)) {
  assert(moved.rows() == state.x.size() && tool < static_cast<int>(dynamics.nodes()));
  at_.resize(elements_of(dynamics.body()));
  for (std::uint32_t k = 0; k < elements_.size(); ++k) at_[elements_[k]] = k;
  const std::uint32_t places = number_places(tool);
  moved_.setZero(3 * static_cast<Eigen::Index>(places), moved.cols());
  at_stamp_.setZero(3 * static_cast<Eigen::Index>(places));
  at_rest_.setZero(3 * static_cast<Eigen::Index>(places));
  // Only the motion of T is stored for o: other places are relative to it.
  if (tool >= 0) moved_.middleRows<3>(3 * kHeld) = moved.middleRows<3>(3 * static_cast<Eigen::Index>(tool)).cast<float>();
  take_corners(state, moved, tool);
  take_hexahedra(state, moved, tool);
}

void GradientPoints::take_hexahedra(const BodyState& state, const Matrix& moved, int tool) {
  axes_.resize(elements_.size());
  is_held_.resize(elements_.size());
  for (std::uint32_t k = 0; k < elements_.size(); ++k) {
    if (!is_hexahedron(elements_[k])) continue;
    const ElementGradient element = element_gradient(*dynamics_, elements_[k]);
    const auto& nodes = element.nodes;
    const auto held = std::find(nodes.begin(), nodes.end(), static_cast<std::uint32_t>(tool));
    is_held_[k] = tool >= 0 && held != nodes.end();
    axes_[k] = axes_towards(element.b.col(is_held_[k] ? held - nodes.begin() : 0));
    const Mat3 f = mean_gradient(*dynamics_, elements_[k], state.x);
    const Eigen::Matrix<double, 3, Eigen::Dynamic> shares = axes_[k].transpose() * element.b;
    for (Eigen::Index c = 0; c < 3; ++c) {
      const Eigen::Index row = 3 * (static_cast<Eigen::Index>(first_[k]) + c);
      at_rest_.segment<3>(row) = axes_[k].col(c);
      at_stamp_.segment<3>(row) = f * axes_[k].col(c);
      Matrix way = Matrix::Zero(3, moved.cols());
      for (std::size_t i = 0; i < nodes.size(); ++i)
        if (!is_held_[k] || nodes[i] != static_cast<std::uint32_t>(tool))
          way += shares(c, static_cast<Eigen::Index>(i)) * moved.middleRows<3>(3 * static_cast<Eigen::Index>(nodes[i]));
      moved_.middleRows<3>(row) = way.cast<float>();
    }
  }
}

std::uint32_t GradientPoints::number_places(int tool) {
  std::uint32_t next = kFirst;
  corners_.resize(dynamics_->nodes());
  if (tool >= 0) corners_[static_cast<std::size_t>(tool)] = kHeld;
  for (const std::uint32_t e : elements_) {
    first_.push_back(next);
    if (is_hexahedron(e))
      next += 3;
    else
      for (const std::uint32_t node : element_gradient(*dynamics_, e).nodes)
        if (corners_[node] == 0) corners_[node] = next++;
  }
  return next;
}

void GradientPoints::take_corners(const BodyState& state, const Matrix& moved, int tool) {
  const auto any = std::find_if(corners_.begin(), corners_.end(), [](std::uint32_t place) { return place >= kFirst; });
  if (any == corners_.end()) return;
  const std::uint32_t from = tool >= 0 ? static_cast<std::uint32_t>(tool) : static_cast<std::uint32_t>(any - corners_.begin());
  const std::vector<Vec3>& rest = dynamics_->body().nodes;
  for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i) {
    if (corners_[i] < kFirst) continue;
    const Eigen::Index row = 3 * static_cast<Eigen::Index>(corners_[i]);
    moved_.middleRows<3>(row) = moved.middleRows<3>(3 * static_cast<Eigen::Index>(i)).cast<float>();
    at_stamp_.segment<3>(row) = at_node(state.x, i) - at_node(state.x, from);
    at_rest_.segment<3>(row) = rest[i] - rest[from];
  }
}

std::size_t GradientPoints::number(std::uint32_t element) const { return at_[element]; }

std::uint32_t GradientPoints::place(std::uint32_t element, int i) const {
  if (!is_hexahedron(element)) return corners_[element_gradient(*dynamics_, element).nodes[static_cast<std::size_t>(i)]];
  const std::size_t k = number(element);
  if (i == 0) return is_held_[k] ? kHeld : kStill;
  return first_[k] + static_cast<std::uint32_t>(i) - 1;
}

TetraShape GradientPoints::rest(std::uint32_t element) const {
  if (!is_hexahedron(element))
    return dynamics_->tetrahedra().shape(element - static_cast<std::uint32_t>(dynamics_->body().hexahedra.size()));
  const Mat3& axes = axes_[number(element)];
  Mat34 places;
  places << Vec3::Zero(), axes;
  TetraShape rest(places);
  rest.volume_m3 = element_gradient(*dynamics_, element).volume_m3;
  return rest;
}

std::uint32_t GradientPoints::material(std::uint32_t element) const { return element_gradient(*dynamics_, element).material; }

bool GradientPoints::is_triangle(std::uint32_t element) const {
  const LumpedBody& body = dynamics_->body();
  return !is_hexahedron(element) && body.tetrahedra[element - body.hexahedra.size()].is_triangle();
}

}  // namespace palpate
