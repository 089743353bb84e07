#include "common/patch/packed_motion.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "common/patch/packed_numbers.hpp"

namespace palpate::packed {

void append_motion(const NodeMotion& motion, std::vector<std::uint16_t>& out) {
  assert(motion.bytes.cols() == 3 * motion.nodes() && motion.bytes.rows() == motion.modes());
  const auto bytes = motion.bytes.reshaped();
  append_bytes(std::vector<std::uint8_t>(bytes.begin(), bytes.end()), out);
  append_bytes(motion.parent, out);
}

bool take_motion(const std::vector<std::uint16_t>& numbers, int& at, int modes, int nodes, NodeMotion& motion) {
  assert(modes > 0 && nodes > 0);
  motion.bytes.resize(modes, 3 * nodes);
  const std::vector<std::uint8_t> bytes = take_bytes(numbers, at, 3 * modes * nodes);
  std::transform(bytes.begin(), bytes.end(), motion.bytes.reshaped().begin(),
                 [](std::uint8_t b) { return static_cast<std::int8_t>(b); });
  motion.parent = take_bytes(numbers, at, nodes);
  bool fine = motion.tool < nodes;
  for (int i = 0; i < nodes; ++i) fine &= motion.parent[static_cast<std::size_t>(i)] <= i;
  return fine;
}

void append_places(const Eigen::Matrix3Xf& place, float unit, std::vector<std::uint16_t>& out) {
  assert(unit > 0 && place.cwiseAbs().maxCoeff() < (kPlaceMax + 0.5F) * unit);
  for (const float x : place.reshaped())
    out.push_back(static_cast<std::uint16_t>(static_cast<std::int16_t>(std::lround(x / unit))));
}

Eigen::Matrix3Xf take_places(const std::vector<std::uint16_t>& numbers, int& at, int nodes, float unit) {
  assert(at >= 0 && static_cast<std::size_t>(at + 3 * nodes) <= numbers.size());
  Eigen::Matrix3Xf places(3, nodes);
  for (float& x : places.reshaped())
    x = unit * static_cast<float>(static_cast<std::int16_t>(numbers[static_cast<std::size_t>(at++)]));
  return places;
}

}  // namespace palpate::packed
