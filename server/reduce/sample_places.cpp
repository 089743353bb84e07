#include "server/reduce/sample_places.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "server/reduce/element_gradient.hpp"
#include "server/reduce/local_body.hpp"

namespace palpate {
namespace {

/// Orthogonal d_c of one length, right-handed, with b . d_c = -1.
Mat3 axes_towards(const Vec3& b) {
  const Vec3 diagonal = Vec3::Constant(-1 / std::sqrt(3.0));
  return std::sqrt(3.0) / b.norm() * Eigen::Quaterniond::FromTwoVectors(diagonal, b).toRotationMatrix();
}

/// The same in the plane of a triangle, of normal n to which b belongs; the third is nothing.
Mat3 axes_in_plane(const Vec3& b, const Vec3& n) {
  const Vec3 along = -b / b.squaredNorm(), across = n.cross(along);
  Mat3 axes;
  axes << along + across, along - across, Vec3::Zero();
  return axes;
}

}  // namespace

SamplePlaces::SamplePlaces(const Dynamics& dynamics, const BodyState& state, const Matrix& moved,
                           std::vector<std::uint32_t> elements, int tool)
    : dynamics_(&dynamics), elements_(std::move(elements)) {
  at_.resize(elements_of(dynamics.body()));
  for (std::uint32_t k = 0; k < elements_.size(); ++k) at_[elements_[k]] = k;
  if (dynamics.hexahedra().empty()) {
    tool_ = tool;
    take_nodes(state, moved);
  } else {
    tool_ = tool < 0 ? -1 : static_cast<int>(kHeld);
    take_hexahedra(state, moved, tool);
  }
}

void SamplePlaces::take_nodes(const BodyState& state, const Matrix& moved) {
  moved_ = moved.cast<float>();
  at_stamp_ = state.x;
  at_rest_.resize(state.x.size());
  for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i) at_node(at_rest_, i) = dynamics_->body().nodes[i];
}

void SamplePlaces::take_hexahedra(const BodyState& state, const Matrix& moved, int tool) {
  assert(moved.rows() == state.x.size() && tool < static_cast<int>(dynamics_->nodes()));
  const auto places = static_cast<Eigen::Index>(kFirst + 3 * elements_.size());
  moved_.setZero(3 * places, moved.cols());
  at_stamp_.setZero(3 * places);
  at_rest_.setZero(3 * places);
  // Where T is, all there is to know of o: places count from it.
  if (tool >= 0) moved_.middleRows<3>(3 * kHeld) = moved.middleRows<3>(3 * static_cast<Eigen::Index>(tool)).cast<float>();
  axes_.reserve(elements_.size());
  for (std::uint32_t k = 0; k < elements_.size(); ++k) {
    const ElementGradient element = element_gradient(*dynamics_, elements_[k]);
    const auto& nodes = element.nodes;
    const bool triangle = is_triangle(elements_[k]);
    const auto held = std::find(nodes.begin(), nodes.end(), static_cast<std::uint32_t>(tool));
    is_held_.push_back(tool >= 0 && held != nodes.end());
    const Vec3 b = element.b.col(is_held_.back() ? held - nodes.begin() : 0);
    axes_.push_back(triangle ? axes_in_plane(b, element.b.col(1).cross(element.b.col(2)).normalized()) : axes_towards(b));
    const Mat3 f = mean_gradient(*dynamics_, elements_[k], state.x);
    const Eigen::Matrix<double, 3, Eigen::Dynamic> shares = axes_.back().transpose() * element.b;
    for (Eigen::Index c = 0; c < (triangle ? 2 : 3); ++c) {
      const Eigen::Index row = 3 * (kFirst + 3 * static_cast<Eigen::Index>(k) + c);
      at_rest_.segment<3>(row) = axes_.back().col(c);
      at_stamp_.segment<3>(row) = f * axes_.back().col(c);
      Matrix way = Matrix::Zero(3, moved.cols());
      for (std::size_t i = 0; i < nodes.size(); ++i)
        if (!is_held_.back() || nodes[i] != static_cast<std::uint32_t>(tool))
          way += shares(c, static_cast<Eigen::Index>(i)) * moved.middleRows<3>(3 * static_cast<Eigen::Index>(nodes[i]));
      moved_.middleRows<3>(row) = way.cast<float>();
    }
  }
}

std::size_t SamplePlaces::number(std::uint32_t element) const { return at_[element]; }

std::uint32_t SamplePlaces::place(std::uint32_t element, int i) const {
  if (axes_.empty()) return dynamics_->body().tetrahedra[element].nodes[static_cast<std::size_t>(i)];
  const std::size_t k = number(element);
  if (i == 0 || (i == 3 && is_triangle(element))) return is_held_[k] ? kHeld : kStill;
  return kFirst + static_cast<std::uint32_t>(3 * k) + static_cast<std::uint32_t>(i) - 1;
}

TetraRest SamplePlaces::rest(std::uint32_t element) const {
  if (axes_.empty()) return dynamics_->tetrahedra().rest(element);
  const Mat3& axes = axes_[number(element)];
  Mat34 places;
  places << Vec3::Zero(), axes;
  TetraRest rest(places);
  rest.volume_m3 = element_gradient(*dynamics_, element).volume_m3;
  return rest;
}

Mat3 SamplePlaces::deformation(std::uint32_t element) const {
  assert(element < at_.size() && elements_[number(element)] == element);
  const TetraRest at = rest(element);
  Mat3 f = Mat3::Zero();
  for (int i = 1; i < 4; ++i)
    f += (at_node(at_stamp_, place(element, i)) - at_node(at_stamp_, place(element, 0))) * at.b.col(i).transpose();
  return f;
}

std::uint32_t SamplePlaces::material(std::uint32_t element) const { return element_gradient(*dynamics_, element).material; }

bool SamplePlaces::is_triangle(std::uint32_t element) const {
  const LumpedBody& body = dynamics_->body();
  return element >= body.hexahedra.size() && body.tetrahedra[element - body.hexahedra.size()].is_triangle();
}

}  // namespace palpate
