#include "common/patch/contact_law.hpp"

#include <Eigen/LU>
#include <cassert>
#include <cmath>

namespace palpate {

ContactClosure close_contact(const Vec3& p_free, const Mat3& compliance, const Vec3& normal, const Vec3& tool,
                             const ContactParameters& parameters) noexcept {
  assert(std::abs(normal.squaredNorm() - 1) < 1e-6 && parameters.contact_stiffness_n_m >= 0 && parameters.friction >= 0);
  // A rigid tool on a point without compliance has no finite solution; with this 1 um of depth is 1 kN, beyond any device's
  // limit.
  constexpr double kComplianceFloor_m_n = 1e-9;
  Mat3 w = compliance;
  w.diagonal().array() += parameters.contact_stiffness_n_m > 0 ? 1.0 / parameters.contact_stiffness_n_m : kComplianceFloor_m_n;

  ContactClosure result;
  const Vec3 gap = tool - p_free;
  Mat3 inverse;
  bool invertible = false;
  w.computeInverseWithCheck(inverse, invertible, 0.0);
  if (!invertible) return result;
  Vec3 lambda = inverse * gap;
  const double push = -lambda.dot(normal), depth = normal.dot(gap);
  if (!(push > 0 || depth < 0)) return result;
  result.touching = true;

  const Vec3 tangential = lambda + push * normal;
  const double tangential_norm = tangential.norm();
  if (tangential_norm > parameters.friction * push) {
    const Vec3 direction = -normal + (parameters.friction / tangential_norm) * tangential;
    const double along = normal.dot(w * direction);
    // With strong friction and a skewed compliance the cone's edge may not reach the surface; the frictionless force does.
    lambda = along < 0 && depth < 0 ? Vec3((depth / along) * direction) : Vec3(depth / normal.dot(w * normal) * normal);
    if (!(lambda.dot(normal) < 0)) return {};
    result.slipping = true;
    result.slip = gap - w * lambda;
    result.slip -= normal * normal.dot(result.slip);
  }
  result.lambda = lambda;
  return result;
}

}  // namespace palpate
