#include "server/body/contact_spring.hpp"

#include <algorithm>

namespace palpate {

std::optional<ContactTouch> touch_of(const ContactSpring& spring, double depth, const Vec3& g, const Vec3& v,
                                     const std::optional<Vec3>& offset) {
  constexpr double kNoDirection = 1e-6;
  const double length = g.norm();
  if (!(length > kNoDirection)) return std::nullopt;
  const double stiffness = spring.stiffness_n_m, damping = spring.damping_n_s_m, onset = std::min(1.0, depth / spring.onset_m);
  const double n = std::max(0.0, stiffness * depth - damping * onset * g.dot(v)), most = spring.friction * n * length;
  const Mat3 across = Mat3::Identity() - g * g.transpose() / (length * length);

  ContactTouch touch;
  touch.force = n * g;
  touch.stiffness = stiffness * g * g.transpose();
  touch.damping = onset * damping * g * g.transpose();
  touch.energy_j = 0.5 * stiffness * depth * depth;
  if (!offset) return touch;
  const Vec3 stretch = across * *offset, hold = stiffness * stretch + damping * (across * v);
  const double held_n = hold.norm(), stretched_n = stiffness * stretch.norm();
  const double kept = stretched_n > most ? most / stretched_n : 1;
  touch.kept = kept * stretch;
  touch.energy_j += 0.5 * kept * kept * stiffness * stretch.squaredNorm();
  if (held_n <= most) {
    touch.force -= hold;
    touch.stiffness += stiffness * across;
    touch.damping += damping * across;
    return touch;
  }
  const Vec3 along = hold / held_n;
  const Mat3 turning = most / held_n * (across - along * along.transpose());
  touch.force -= most * along;
  touch.stiffness += stiffness * turning;
  touch.damping += damping * turning;
  return touch;
}

}  // namespace palpate
