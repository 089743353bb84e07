// One finite element by itself: its energy by definition, and what the loops over eight elements make of its nodes.
#pragma once

#include <Eigen/Dense>
#include <random>
#include <vector>

#include "server/elements/element_loops.hpp"

namespace palpate::test {

inline constexpr double kEdgeM = 0.01;

class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}
  template <int Rows, int Columns>
  Eigen::Matrix<double, Rows, Columns> numbers(double size) {
    return Eigen::Matrix<double, Rows, Columns>::NullaryExpr([&] { return size * normal_(random_); });
  }
  Mat3 matrix(double size) { return numbers<3, 3>(size); }
  Mat3 rotation() { return Eigen::Quaterniond(numbers<3, 1>(1).homogeneous()).normalized().toRotationMatrix(); }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

inline Mat38 box(const Vec3& edges_m) {
  Mat38 x;
  for (int i = 0; i < 8; ++i) x.col(i) = Vec3(i & 1 ? edges_m.x() : 0, i & 2 ? edges_m.y() : 0, i & 4 ? edges_m.z() : 0);
  return x;
}

/// A cube, a box, a skew one, and one as at the surface of a clipped lattice; or a tetrahedron, skew, and a triangle.
template <class Shape>
std::vector<typename Shape::Positions> rests() {
  Draw draw(3);
  const Mat3 skew = (Mat3() << 1, 0.2, 0.1, 0, 0.8, -0.2, 0.1, 0, 1.1).finished();
  if constexpr (Shape::kModes > 0) {
    return {box(Vec3::Constant(kEdgeM)), box({0.01, 0.007, 0.015}), skew * box(Vec3::Constant(kEdgeM)),
            box(Vec3::Constant(kEdgeM)) + draw.numbers<3, 8>(0.08 * kEdgeM)};
  } else {
    const Mat34 corner = (Mat34() << 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1).finished() * kEdgeM;
    return {corner, skew * corner, corner + draw.numbers<3, 4>(0.1 * kEdgeM)};
  }
}

/// Slightly deformed, strongly deformed, and pressed through itself.
template <class Shape>
std::vector<typename Shape::Positions> deformed(const typename Shape::Positions& rest) {
  Draw draw(5);
  std::vector<typename Shape::Positions> all{rest};
  for (const double size : {0.01, 0.1, 0.3})
    all.push_back(draw.rotation() * (rest + draw.numbers<3, Shape::kNodes>(size * kEdgeM)));
  all.push_back(Vec3(1.1, 1, -0.3).asDiagonal() * rest + draw.numbers<3, Shape::kNodes>(0.1 * kEdgeM));
  return all;
}

inline std::vector<SolidMaterial> solids() {
  const Fibres fibres{{0.6, 0, 0.8}, 3, 2};
  return {{SolidLaw::neo_hookean, 5e3, 0.3, 0.02},
          {SolidLaw::neo_hookean, 5e3, 0.499, 0.02},
          {SolidLaw::corotational, 5e3, 0.45, 0.02},
          {SolidLaw::mooney_rivlin, 5e3, 0.45, 0.02, 0.4},
          {SolidLaw::veronda_westmann, 5e3, 0.45, 0.02, 2},
          {SolidLaw::ogden, 5e3, 0.45, 0.02, 0.3, {5, -4}, fibres},
          {SolidLaw::neo_hookean, 5e3, 0.3, 0}};
}

template <class Shape>
struct OneElement {
  static constexpr int kNodes = Shape::kNodes;
  using Positions = typename Shape::Positions;
  using Square = Eigen::Matrix<double, 3 * kNodes, 3 * kNodes>;

  OneElement(const SolidMaterial& solid, const Positions& rest) : material(solid), shape(rest, solid.young_pa) {}
  double energy(const Positions& x) const { return energy_of(shape.gradient(x)); }
  double energy_of(const typename Shape::Gradient& at) const {
    const Mat3 f = at.template leftCols<3>();
    double sum = shape.volume_m3 * elastic_energy_densities(material, {f, f, f, f})[0];
    for (int a = 0; a < Shape::kModes; ++a) sum += 0.5 * shape.k[static_cast<std::size_t>(a)] * at.col(3 + a).squaredNorm();
    return sum;
  }
  ElementGroup<Shape> group() const {
    ElementGroup<Shape> one;
    one.shape = &shape;
    one.count = 1;
    for (std::size_t i = 0; i < kNodes; ++i) one.nodes[i].fill(static_cast<std::uint32_t>(i));
    return one;
  }
  Positions forces(const Positions& x, const Positions& v = Positions::Zero()) const {
    Positions f = Positions::Zero();
    element_loops<Shape>().back().add_forces(material, group(), x.data(), v.data(), f.data());
    return f;
  }
  Square matrix(const Positions& x, double c_d, double c_k, bool clamp) const {
    ElementBlocks<Shape> blocks;
    element_loops<Shape>().back().blocks(material, group(), x.data(), x.data(), c_d, c_k, clamp, blocks);
    Square all;
    for (int i = 0; i < kNodes; ++i)
      for (int j = 0; j <= i; ++j)
        for (int n = 0; n < 9; ++n)
          all(3 * i + n / 3, 3 * j + n % 3) = all(3 * j + n % 3, 3 * i + n / 3) =
              blocks.at[pair_index(static_cast<std::size_t>(i), static_cast<std::size_t>(j))][static_cast<std::size_t>(n)].of[0];
    return all;
  }
  ElementMaterial material;
  Shape shape;
};

}  // namespace palpate::test
