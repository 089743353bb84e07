// Terms of springs and tetrahedra.
#include <algorithm>
#include <cmath>

#include "common/port/packed_motion.hpp"
#include "common/port/packed_numbers.hpp"
#include "common/port/terms_numbers.hpp"

namespace palpate {

using namespace packed;

namespace {

void append_steps(const NodeMotion& motion, PatchTerms& head, std::vector<std::uint16_t>& out) {
  head.unit[0] = append(motion.scale, out);
  for (const float step : motion.step) out.push_back(to_half(step));
}

void take_steps(const std::vector<std::uint16_t>& numbers, int& at, const PatchTerms& head, NodeMotion& motion) {
  motion.tool = head.tool == kNoHeldNode ? -1 : head.tool;
  motion.tool_axes = head.tool_axes;
  motion.scale = take(numbers, at, layout(head).modes, head.unit[0]);
  motion.step = take(numbers, at, head.nodes, 1);
}

/// Returns positions relative to the middle of all.
Eigen::Matrix3Xf places_of(const Eigen::Matrix3Xf& position) {
  const Eigen::Vector3f middle = 0.5F * (position.rowwise().minCoeff() + position.rowwise().maxCoeff());
  return position.colwise() - middle;
}

}  // namespace

void append_springs(const NonlinearTerms& terms, PatchTerms& head, std::vector<std::uint16_t>& out) {
  constexpr float kRestLengthMax = 65535;  // limit of a uint16: L in its unit
  const SampledSprings& springs = terms.springs;
  append_steps(springs.motion, head, out);
  head.unit[2] = append(springs.stiffness, out);
  head.unit[3] = append(springs.damping, out);
  append_motion(springs.motion, out);
  const Eigen::Matrix3Xf place = places_of(springs.position);
  const float unit = head.unit[1] =
      power_of_two_above(std::max(place.cwiseAbs().maxCoeff() / kPlaceMax, springs.rest_length.maxCoeff() / kRestLengthMax));
  append_places(place, unit, out);
  for (const float length : springs.rest_length)
    out.push_back(static_cast<std::uint16_t>(std::lround(std::clamp(length / unit, 0.0F, kRestLengthMax))));
  for (const auto& ends : springs.ends.colwise()) out.push_back(static_cast<std::uint16_t>(ends[0] | ends[1] << 8U));
  append_bytes(springs.max_slope, out);
  head.unit[4] = append(terms.e2, out);
}

void append_tetrahedra(const NonlinearTerms& terms, PatchTerms& head, std::vector<std::uint16_t>& out) {
  const SampledTetrahedra& solid = terms.solid;
  append_steps(solid.motion, head, out);
  head.unit[2] = append(solid.shear, out);
  head.unit[3] = append(solid.dilation, out);
  for (const float t : solid.damping_s) out.push_back(to_half(t));
  append_motion(solid.motion, out);
  const Eigen::Matrix3Xf place = places_of(solid.position), rest = places_of(solid.rest);
  head.unit[1] = power_of_two_above(std::max(place.cwiseAbs().maxCoeff(), rest.cwiseAbs().maxCoeff()) / kPlaceMax);
  append_places(place, head.unit[1], out);
  append_places(rest, head.unit[1], out);
  for (const auto& nodes : solid.nodes.colwise()) {
    out.push_back(static_cast<std::uint16_t>(nodes[0] | nodes[1] << 8U));
    out.push_back(static_cast<std::uint16_t>(nodes[2] | nodes[3] << 8U));
  }
  head.unit[4] = append(terms.e2, out);
}

bool take_springs(const std::vector<std::uint16_t>& numbers, int& at, const PatchTerms& head, NonlinearTerms& terms) {
  const TermsLayout l = layout(head);
  const int m = head.springs, nodes = head.nodes;
  SampledSprings& springs = terms.springs;
  springs.stiffening = head.stiffening;
  take_steps(numbers, at, head, springs.motion);
  springs.stiffness = take(numbers, at, m, head.unit[2]);
  springs.damping = take(numbers, at, m, head.unit[3]);
  const bool fine = take_motion(numbers, at, l.modes, nodes, springs.motion);
  springs.position = take_places(numbers, at, head.nodes, head.unit[1]);
  const auto next = [&] { return numbers[static_cast<std::size_t>(at++)]; };
  springs.rest_length.resize(m);
  for (float& length : springs.rest_length) length = head.unit[1] * static_cast<float>(next());
  springs.ends.resize(2, m);
  for (int e = 0; e < m; ++e) {
    const unsigned word = next();
    springs.ends(0, e) = static_cast<int>(word & 0xffU);
    springs.ends(1, e) = static_cast<int>(word >> 8U);
  }
  if (springs.stiffening > 0) springs.max_slope = take_bytes(numbers, at, m);
  terms.e2 = take(numbers, at, l.e2, head.unit[4]);
  return fine && springs.ends.maxCoeff() < nodes && springs.rest_length.minCoeff() > 0 && springs.stiffness.minCoeff() >= 0 &&
         springs.damping.minCoeff() >= 0;
}

bool take_tetrahedra(const std::vector<std::uint16_t>& numbers, int& at, const PatchTerms& head, NonlinearTerms& terms) {
  const TermsLayout l = layout(head);
  const int m = head.tetrahedra, nodes = head.nodes;
  SampledTetrahedra& solid = terms.solid;
  solid.law = head.law;
  take_steps(numbers, at, head, solid.motion);
  solid.shear = take(numbers, at, m, head.unit[2]);
  solid.dilation = take(numbers, at, m, head.unit[3]);
  solid.damping_s = take(numbers, at, m, 1);
  if (!take_motion(numbers, at, l.modes, nodes, solid.motion)) return false;
  solid.position = take_places(numbers, at, head.nodes, head.unit[1]);
  solid.rest = take_places(numbers, at, head.nodes, head.unit[1]);
  solid.nodes.resize(4, m);
  for (int e = 0; e < m; ++e)
    for (int pair = 0; pair < 2; ++pair) {
      const unsigned word = numbers[static_cast<std::size_t>(at++)];
      solid.nodes(2 * pair, e) = static_cast<int>(word & 0xffU);
      solid.nodes(2 * pair + 1, e) = static_cast<int>(word >> 8U);
    }
  terms.e2 = take(numbers, at, l.e2, head.unit[4]);
  if (solid.nodes.maxCoeff() >= nodes || solid.shear.minCoeff() < 0 || solid.dilation.minCoeff() < 0 ||
      solid.damping_s.minCoeff() < 0)
    return false;
  for (int e = 0; e < m; ++e) {
    float volume = 0;
    if (!solid.gradients(e, volume).allFinite() || !(volume > 0)) return false;
  }
  return true;
}

}  // namespace palpate
