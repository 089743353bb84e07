#include "client/core/hands_damper.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr double kFreeMode1S2 = 1e-9;  // a mode softer than that moves freely

/// Share of the bound that is used: hands damp as well. Measured (docs/decisions/0072-several-hands-stay-calm.md).
constexpr double kBoundShare = 0.7;

/// R^T n of a contact.
using Normal = ModeVector;

double across(const Patch& patch, const Normal& a, const Normal& b) {
  double compliance = 0;
  for (int mode = 0; mode < patch.modes(); ++mode)
    if (patch.stiffness[mode] > kFreeMode1S2) compliance += a[mode] * b[mode] / patch.stiffness[mode];
  return compliance;
}

}  // namespace

double stiffness_between_tools(const Patch& patch) noexcept {
  if (patch.contact != ContactKind::touch || patch.constant || patch.others.count == patch.others.own || patch.modes() == 0)
    return 0;
  const Triangle& corner = patch.surface.triangles[patch.point.triangle];
  const auto vertex = [&](std::size_t k) -> const PortVertex& { return patch.surface.vertices[corner[k]]; };
  const Vec3 outwards = (vertex(1).position - vertex(0).position).cross(vertex(2).position - vertex(0).position);
  if (!(outwards.squaredNorm() > 0)) return 0;
  const Vec3 normal = outwards.normalized();
  Normal own = Normal::Zero(patch.modes());
  for (std::size_t k = 0; k < 3; ++k)
    own.noalias() += patch.point.weight[static_cast<Eigen::Index>(k)] * (vertex(k).rows.transpose() * normal);
  const double contact = patch.contact_stiffness_n_m > 0 ? 1 / patch.contact_stiffness_n_m : 0;
  const double own_compliance = across(patch, own, own) + normal.dot(patch.c_static * normal) + contact;
  double stiffness = 0;
  for (const OtherContact& other : patch.others.tools().subspan(static_cast<std::size_t>(patch.others.own))) {
    const Normal its = other.rows.transpose() * other.normal;
    const double its_compliance = across(patch, its, its) + other.normal.dot(other.c_static * other.normal) + contact;
    const double between = across(patch, own, its), determinant = own_compliance * its_compliance - between * between;
    if (determinant > 0) stiffness += std::abs(between) / determinant;
  }
  return stiffness;
}

Vec3 HandsDamper::tick(const Vec3& position, bool touches, double age_s, double dt_s, bool guided) noexcept {
  const double every_s = seconds(Predictability::kEvery);
  since_s_ += dt_s;
  if (since_s_ >= every_s) {
    since_s_ = std::fmod(since_s_, every_s);
    past_.add(position, age_s);
  }
  const Vec3 velocity = moves_ ? Vec3((position - before_) / dt_s) : Vec3::Zero();
  before_ = position;
  moves_ = true;
  velocity_ += dt_s / (kFilterS + dt_s) * (velocity - velocity_);
  const double wanted = std::min(kBoundShare * (1 - past_.share()) * age_s * stiffness_n_m_, guided ? kMostGuidedNSM : kMostNSM);
  damping_n_s_m_ += dt_s / (kFollowS + dt_s) * (wanted - damping_n_s_m_);
  return touches ? Vec3(-damping_n_s_m_ * velocity_) : Vec3::Zero();
}

}  // namespace palpate
