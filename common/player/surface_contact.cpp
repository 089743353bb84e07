#include "common/player/surface_contact.hpp"

#include <cassert>

#include "common/patch/surface.hpp"

namespace palpate {

PlayedSurface::PlayedSurface(const PortSurface& surface, Eigen::Index modes, const StateInput& psi0)
    : count_(static_cast<std::size_t>(surface.triangle_count)), triangles_(surface.triangles) {
  const auto vertices = static_cast<std::size_t>(surface.vertex_count);
  connect_surface({triangles_.data(), count_}, vertices, {first_.data(), vertices + 1}, {incident_.data(), 3 * count_},
                  {open_.data(), count_});
  rest_.resize(static_cast<Eigen::Index>(3 * vertices));
  rows_.resize(rest_.size(), modes);
  for (std::size_t i = 0; i < vertices; ++i) {
    const auto at = static_cast<Eigen::Index>(3 * i);
    rest_.segment<3>(at) = surface.vertices[i].position;
    if (modes > 0) rows_.middleRows<3>(at) = surface.vertices[i].rows;
  }
  if (modes > 0) responses_ = psi0 * rows_.transpose();
  vertices_ = rest_;
  lean_.fill(Vec3::Zero());
  for (std::uint32_t i = 0; i < vertices; ++i) {
    const Vec3& normal = surface.vertices[i].normal;
    if (normal.squaredNorm() > 0) lean_[i] = normal - vertex_normal(view(), positions(), i);
  }
}

SurfaceView PlayedSurface::view() const noexcept {
  const auto vertices = static_cast<std::size_t>(rest_.size()) / 3;
  return {{triangles_.data(), count_},
          {first_.data(), vertices + 1},
          {incident_.data(), 3 * count_},
          {open_.data(), count_},
          {lean_.data(), vertices}};
}

void PlayedSurface::place(const ModeVector& q) noexcept {
  vertices_ = rest_;
  if (rows_.cols() > 0) vertices_.noalias() += rows_ * q;
}

Vec3 PlayedSurface::vertex(int i, const ModeVector& q) const {
  Vec3 at = rest_.segment<3>(3 * i);
  if (rows_.cols() > 0) at += rows_.middleRows<3>(3 * i) * q;
  return at;
}

void PlayedSurface::respond(const SurfacePoint& point, PortRows& rows, PortPush& push) const noexcept {
  assert(point.triangle < count_);
  const Triangle& corners = triangles_[point.triangle];
  rows = point.weight[0] * rows_.middleRows<3>(3 * corners[0]);
  push.response = point.weight[0] * responses_.middleCols<3>(3 * corners[0]);
  for (std::size_t k = 1; k < 3; ++k) {
    rows += point.weight[static_cast<int>(k)] * rows_.middleRows<3>(3 * corners[k]);
    push.response += point.weight[static_cast<int>(k)] * responses_.middleCols<3>(3 * corners[k]);
  }
}

void SurfaceContact::compensate_slides(const Patch& patch, const PlayedSurface& surface) {
  PortRows rows;
  PortPush push;
  surface.respond(point_, rows, push);
  slide_compliance_.emplace(patch, rows, point_.weight);
}

Vec3 SurfaceContact::place(const PlayedSurface& surface) const noexcept {
  return position_at(surface.view(), surface.positions(), point_) + beyond_;
}

void SurfaceContact::respond(const PlayedSurface& surface, double contact_stiffness_n_m, PortPush& push) noexcept {
  has_response_ = true;
  PortRows rows;
  rows.resize(3, 0);
  if (surface.has_modes()) surface.respond(point_, rows, push);
  if (slide_compliance_) slid_ = SlideCompliance::grown(slid_, slide_compliance_->missing(rows, point_.weight));
  push.set_compliance(rows, contact_stiffness_n_m, c_static_ + slid_);
}

void SurfaceContact::separate(const PlayedSurface& surface, const Vec3& gap) noexcept {
  clearance_ = clearance_of(point_, gap, normal_at(surface.view(), surface.positions(), point_));
  clearance_.known &= beyond_.isZero(0);
}

void SurfaceContact::leave() noexcept {
  touching_ = false;
  clearance_ = {};
}

void SurfaceContact::close(const PlayedSurface& surface, const Vec3& centre, double radius_m, const ContactParameters& parameters,
                           PortPush& push) noexcept {
  push.lambda.setZero();
  const SurfaceView view = surface.view();
  const Positions x = surface.positions();
  if (!touching_) {
    const Onset onset = look_for_contact(view, x, centre, radius_m, clearance_);
    if (!onset.touches || onset.nearest.at_border) return;
    point_ = onset.nearest.point;
    touching_ = true;
    beyond_.setZero();
    slid_.setZero();
    has_response_ = false;
  }
  ContactClosure closure;
  for (int slides = 0;; ++slides) {
    if (!has_response_) respond(surface, parameters.contact_stiffness_n_m, push);
    const Vec3 p_free = position_at(view, x, point_) + beyond_;
    normal_ = normal_at(view, x, point_);
    closure = close_contact(p_free, push.compliance, normal_, centre - radius_m * normal_, parameters);
    touching_ = closure.touching;
    if (!touching_) return separate(surface, centre - p_free);
    if (closure.slip.squaredNorm() > 0) {
      point_ = slide(view, x, point_, beyond_ + closure.slip);
      beyond_ = beyond_border(view, x, point_, p_free + closure.slip);
      has_response_ = false;
    }
    if (slides == kSlidesMax || closure.slip.norm() < kSlipToleranceM) break;
  }
  push.lambda = closure.lambda;
}

}  // namespace palpate
