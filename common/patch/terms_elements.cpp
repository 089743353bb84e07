// Terms of springs and finite elements.
#include <algorithm>
#include <cmath>

#include "common/patch/packed_motion.hpp"
#include "common/patch/packed_numbers.hpp"
#include "common/patch/terms_numbers.hpp"

namespace palpate {

using namespace packed;

namespace {

/// Returns positions relative to the middle of all.
Eigen::Matrix3Xf places_of(const Eigen::Matrix3Xf& position) {
  const Eigen::Vector3f middle = 0.5F * (position.rowwise().minCoeff() + position.rowwise().maxCoeff());
  return position.colwise() - middle;
}

/// Returns true if every element has a volume, and none a negative stiffness.
bool is_valid_solid(const SampledElements& e) {
  bool fine = e.dilation.minCoeff() >= 0;
  for (int k = 0; k < e.count() && fine; ++k) {
    float volume = 0;
    fine = e.gradients(k, volume).allFinite() && volume > 0;
  }
  return fine;
}

}  // namespace

void append_elements(const NonlinearTerms& terms, PatchTerms& head, std::vector<std::uint16_t>& out) {
  constexpr float kRestLengthMax = 65535;  // limit of a uint16: L in its unit
  const SampledElements& e = terms.elements;
  head.unit[0] = append(e.motion.scale, out);
  for (const float step : e.motion.step) out.push_back(to_half(step));
  head.unit[2] = append(e.stiffness, out);
  if (e.is_solid()) {
    head.unit[3] = append(e.dilation, out);
    for (const float t : e.damping) out.push_back(to_half(t));
  } else {
    head.unit[3] = append(e.damping, out);
  }
  append_motion(e.motion, out);
  const Eigen::Matrix3Xf place = places_of(e.position), rest = e.is_solid() ? places_of(e.rest) : Eigen::Matrix3Xf();
  float& unit = head.unit[1];
  unit = place.cwiseAbs().maxCoeff() / kPlaceMax;
  if (e.is_solid())
    unit = std::max(unit, rest.cwiseAbs().maxCoeff() / kPlaceMax);
  else
    unit = std::max(unit, e.rest_length.maxCoeff() / kRestLengthMax);
  unit = power_of_two_above(unit);
  append_places(place, unit, out);
  if (e.is_solid()) append_places(rest, unit, out);
  for (const float length : e.rest_length)
    out.push_back(static_cast<std::uint16_t>(std::lround(std::clamp(length / unit, 0.0F, kRestLengthMax))));
  std::vector<std::uint8_t> nodes;
  for (const int node : e.nodes.reshaped()) nodes.push_back(static_cast<std::uint8_t>(node));
  append_bytes(nodes, out);
  append_bytes(e.max_slope, out);
  head.unit[4] = append(terms.e2, out);
}

bool take_elements(const std::vector<std::uint16_t>& numbers, int& at, const PatchTerms& head, NonlinearTerms& terms) {
  const TermsLayout l = layout(head);
  const int m = head.elements;
  SampledElements& e = terms.elements;
  e.motion.tool = head.tool == kNoHeldNode ? -1 : head.tool;
  e.motion.tool_axes = head.tool_axes;
  e.motion.scale = take(numbers, at, l.modes, head.unit[0]);
  e.motion.step = take(numbers, at, head.nodes, 1);
  e.stiffness = take(numbers, at, m, head.unit[2]);
  if (head.solid) e.dilation = take(numbers, at, m, head.unit[3]);
  e.damping = take(numbers, at, m, head.solid ? 1 : head.unit[3]);
  if (!take_motion(numbers, at, l.modes, head.nodes, e.motion)) return false;
  e.position = take_places(numbers, at, head.nodes, head.unit[1]);
  if (head.solid) {
    e.law = head.law;
    e.rest = take_places(numbers, at, head.nodes, head.unit[1]);
  } else {
    e.stiffening = head.stiffening;
    e.rest_length.resize(m);
    for (float& length : e.rest_length) length = head.unit[1] * static_cast<float>(numbers[static_cast<std::size_t>(at++)]);
  }
  e.nodes.resize(head.solid ? 4 : 2, m);
  const std::vector<std::uint8_t> nodes = take_bytes(numbers, at, static_cast<int>(e.nodes.size()));
  std::copy(nodes.begin(), nodes.end(), e.nodes.reshaped().begin());
  if (e.stiffening > 0) e.max_slope = take_bytes(numbers, at, m);
  terms.e2 = take(numbers, at, l.e2, head.unit[4]);
  if (e.nodes.maxCoeff() >= head.nodes || e.stiffness.minCoeff() < 0 || e.damping.minCoeff() < 0) return false;
  return head.solid ? is_valid_solid(e) : e.rest_length.minCoeff() > 0;
}

}  // namespace palpate
