#include "server/reduce/hourglass_forces.hpp"

#include <array>
#include <cassert>

namespace palpate {
namespace {

constexpr int kLane = kTetraLane;
using Lane = TetraLane;
static_assert(kSamples % kLane == 0);

/// Rows of (F, q), and what is conjugate to F^T q: [3 mode + component].
using Gradient = std::array<std::array<Lane, 7>, 3>;
using Modes = std::array<Lane, 12>;

class HourglassResidual {
 public:
  HourglassResidual(const HexaShape& shape, const Mat37& at) : shape_(&shape), at_(at.cast<float>()) {}

  Gradient stress(const Gradient& d) const {
    Modes first, second;
    for (std::size_t a = 0; a < kModesOfHexa; ++a)
      for (std::size_t m = 0; m < 3; ++m) {
        second[3 * a + m] = d[0][m] * d[0][3 + a] + d[1][m] * d[1][3 + a] + d[2][m] * d[2][3 + a];
        first[3 * a + m] = Lane::Zero();
        for (std::size_t r = 0; r < 3; ++r) first[3 * a + m] += d[r][m] * at(r, 3 + a) + at(r, m) * d[r][3 + a];
      }
    Modes both, of_second;
    both.fill(Lane::Zero());
    of_second.fill(Lane::Zero());
    for (const HexaShape::Entry& e : shape_->entries) {
      const auto c = static_cast<float>(e.value);
      of_second[e.row] += c * second[e.column];
      both[e.row] += c * first[e.column];
    }
    for (std::size_t k = 0; k < 12; ++k) both[k] += of_second[k];
    Gradient p;
    for (std::size_t r = 0; r < 3; ++r) {
      p[r].fill(Lane::Zero());
      for (std::size_t a = 0; a < kModesOfHexa; ++a)
        for (std::size_t m = 0; m < 3; ++m) {
          p[r][m] += at(r, 3 + a) * of_second[3 * a + m] + d[r][3 + a] * both[3 * a + m];
          p[r][3 + a] += at(r, m) * of_second[3 * a + m] + d[r][m] * both[3 * a + m];
        }
    }
    return p;
  }

 private:
  float at(std::size_t r, std::size_t m) const { return at_(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(m)); }
  const HexaShape* shape_;
  Eigen::Matrix<float, 3, 7> at_;
};

}  // namespace

Eigen::MatrixXf hourglass_forces(const Dynamics& dynamics, const Vector& x, std::span<const std::uint32_t> hexahedra,
                                 const Matrix& moved, const Eigen::MatrixXf& u) {
  assert(moved.rows() == x.size() && moved.cols() == u.rows() && u.cols() == kSamples);
  thread_local AtSamples there, forces;  // megabytes that would be asked of the system anew for every patch
  const Eigen::MatrixXf shapes = moved.cast<float>();
  there.noalias() = shapes * u;
  forces.setZero(there.rows(), kSamples);
  for (const std::uint32_t k : hexahedra) {
    const HexaShape& shape = dynamics.hexahedra().shape(k);
    const HourglassResidual element(shape, dynamics.hexahedra().gradient(k, x));
    const Eigen::Matrix<float, 7, 8> g = shape.rest.g.cast<float>();
    const auto& nodes = dynamics.body().hexahedra[k].nodes;
    const auto row = [&](Eigen::Index i, std::size_t r) {
      return 3 * static_cast<Eigen::Index>(nodes[static_cast<std::size_t>(i)]) + static_cast<Eigen::Index>(r);
    };
    for (Eigen::Index s = 0; s < kSamples; s += kLane) {
      Gradient d;
      for (std::size_t r = 0; r < 3; ++r) {
        d[r].fill(Lane::Zero());
        for (Eigen::Index i = 0; i < 8; ++i) {
          const Lane way = there.row(row(i, r)).segment<kLane>(s).transpose().array();
          for (std::size_t m = 0; m < 7; ++m) d[r][m] += g(static_cast<Eigen::Index>(m), i) * way;
        }
      }
      const Gradient p = element.stress(d);
      for (std::size_t r = 0; r < 3; ++r)
        for (Eigen::Index i = 0; i < 8; ++i) {
          Lane push = Lane::Zero();
          for (std::size_t m = 0; m < 7; ++m) push += g(static_cast<Eigen::Index>(m), i) * p[r][m];
          forces.row(row(i, r)).segment<kLane>(s) -= push.matrix().transpose();
        }
    }
  }
  return shapes.transpose() * forces;
}

}  // namespace palpate
