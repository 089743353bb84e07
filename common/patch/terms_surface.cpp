// Terms of the added surface of a touch.
#include <algorithm>
#include <cassert>

#include "common/patch/packed_motion.hpp"
#include "common/patch/packed_numbers.hpp"
#include "common/patch/terms_numbers.hpp"

namespace palpate {

using namespace packed;

namespace {

constexpr unsigned kCornerBits = 5;  // format: three corners in a word
static_assert(kMaxPortVertices <= 1 << kCornerBits);

constexpr double kPlaceUnitM = 1.0 / 1024;  // format: two halves of it place the middle to 22 bits

Eigen::Matrix3Xd positions_of(const std::vector<PortVertex>& vertices) {
  Eigen::Matrix3Xd x(3, vertices.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) x.col(static_cast<Eigen::Index>(i)) = vertices[i].position;
  return x;
}

/// Returns the port rows, 3 rows a vertex.
Eigen::MatrixXf rows_of(const std::vector<PortVertex>& vertices, int modes) {
  Eigen::MatrixXf rows(3 * vertices.size(), modes);
  for (std::size_t i = 0; i < vertices.size(); ++i)
    rows.middleRows<3>(3 * static_cast<Eigen::Index>(i)) = vertices[i].rows.cast<float>();
  return rows;
}

}  // namespace

std::uint16_t pack_corners(const Triangle& triangle) {
  assert(std::all_of(triangle.begin(), triangle.end(), [](std::uint32_t corner) { return corner < 1U << kCornerBits; }));
  return static_cast<std::uint16_t>(triangle[0] | triangle[1] << kCornerBits | triangle[2] << 2 * kCornerBits);
}
Triangle unpack_corners(std::uint16_t bits) {
  constexpr std::uint32_t mask = (1U << kCornerBits) - 1;
  return {bits & mask, bits >> kCornerBits & mask, bits >> 2 * kCornerBits & mask};
}

void append_surface(const NonlinearTerms& terms, std::vector<std::uint16_t>& out) {
  const auto add = [&](double v) {
    out.push_back(to_half(static_cast<float>(v)));
    return static_cast<double>(from_half(out.back()));
  };
  if (!terms.vertices.empty()) {
    const Eigen::Matrix3Xd x = positions_of(terms.vertices);
    const Vec3 low = x.rowwise().minCoeff(), high = x.rowwise().maxCoeff();
    constexpr double kLeastUnitM = 0x1p-24;                          // the least half above 0
    const double reach = (high - low).maxCoeff() / 2 + kPlaceUnitM;  // allows for the rounding of the middle
    const double unit = add(std::max<double>(power_of_two_above(static_cast<float>(reach) / kPlaceMax), kLeastUnitM));
    Vec3 middle;
    for (int axis = 0; axis < 3; ++axis) {
      const double m = (low[axis] + high[axis]) / (2 * kPlaceUnitM), most = add(m);
      middle[axis] = kPlaceUnitM * (most + add(m - most));
    }
    const NodeMotion motion = rounded(rows_of(terms.vertices, static_cast<int>(terms.vertices.front().rows.cols())), -1);
    for (const float scale : motion.scale) add(scale);
    for (const float step : motion.step) add(step);
    for (const PortVertex& vertex : terms.vertices)
      for (const double n : vertex.normal) add(n);
    append_motion(motion, out);
    append_places((x.colwise() - middle).cast<float>(), static_cast<float>(unit), out);
  }
  for (const Triangle& triangle : terms.triangles) out.push_back(pack_corners(triangle));
}

bool take_surface(const std::vector<std::uint16_t>& numbers, int at, const PatchTerms& head, NonlinearTerms& terms) {
  assert(at >= 0 && static_cast<std::size_t>(at) <= numbers.size());
  const auto next = [&] { return static_cast<double>(from_half(numbers[static_cast<std::size_t>(at++)])); };
  const int modes = layout(head).modes, count = head.vertices;
  terms.vertices.resize(head.vertices);
  if (count > 0) {
    const double unit = next();
    Vec3 middle;
    for (double& m : middle) {
      m = next();
      m = kPlaceUnitM * (m + next());
    }
    NodeMotion motion;
    motion.scale = take(numbers, at, modes, 1);
    motion.step = take(numbers, at, count, 1);
    for (PortVertex& vertex : terms.vertices)
      for (double& n : vertex.normal) n = next();
    if (!take_motion(numbers, at, modes, count, motion)) return false;
    const Eigen::MatrixXd rows = motion.rows(0).cast<double>();
    const Eigen::Matrix3Xd places = take_places(numbers, at, count, static_cast<float>(unit)).cast<double>();
    for (int i = 0; i < count; ++i) {
      PortVertex& vertex = terms.vertices[static_cast<std::size_t>(i)];
      vertex.position = middle + places.col(i);
      vertex.rows = rows.middleRows<3>(3 * i);
    }
  }
  terms.triangles.resize(head.triangles);
  for (Triangle& triangle : terms.triangles) {
    triangle = unpack_corners(numbers[static_cast<std::size_t>(at++)]);
    for (const std::uint32_t corner : triangle)
      if (corner >= static_cast<std::uint32_t>(kMaxPortVertices)) return false;
  }
  return true;
}

}  // namespace palpate
