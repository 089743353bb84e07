#include "server/reduce/bending.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>

namespace palpate {
namespace {

/// The shapes, those of a node one after the other.
using ShapeRows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
/// The same where two digits are enough.
using RoughShapes = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr double kElementLengthMin = 1e-9;  // below, an element has no direction [m]

/// k |delta|^3 / rho of each spring.
std::vector<double> spring_weights(const LumpedBody& body, const BodyState& state, const RoughShapes& shapes) {
  std::vector<double> weights;
  weights.reserve(body.elements.size());
  const Eigen::Index numbers = 3 * shapes.cols();  // of a node
  const auto of_node = [&](std::uint32_t node) {
    return Eigen::Map<const Eigen::VectorXf>(shapes.data() + numbers * static_cast<Eigen::Index>(node), numbers);
  };
  for (const Element& e : body.elements) {
    const auto a = 3 * static_cast<Eigen::Index>(e.a), b = 3 * static_cast<Eigen::Index>(e.b);
    const auto motion = static_cast<double>((of_node(e.b) - of_node(e.a)).norm());
    const double rho = (state.x.segment<3>(b) - state.x.segment<3>(a)).norm();
    weights.push_back(e.stiffness_n_m * motion * motion * motion / std::max(rho, kElementLengthMin));
  }
  return weights;
}

/// How the shapes move the edges from its first node, three rows each.
using EdgeRows = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, kMaxVariables>;
template <typename Shapes>
std::array<EdgeRows, 3> edges_of(const Tetrahedron& t, const Shapes& shapes) {
  std::array<EdgeRows, 3> edges;
  for (std::size_t i = 0; i < 3; ++i)
    edges[i] = shapes.template middleRows<3>(3 * static_cast<Eigen::Index>(t.nodes[i + 1])) -
               shapes.template middleRows<3>(3 * static_cast<Eigen::Index>(t.nodes[0]));
  return edges;
}

/// V mu_L |dF|^3 of each tetrahedron.
std::vector<double> tetra_weights(const Dynamics& dynamics, const ShapeRows& shapes) {
  const LumpedBody& body = dynamics.body();
  std::vector<double> weights;
  for (std::uint32_t e = 0; e < body.tetrahedra.size(); ++e) {
    const Tetrahedron& t = body.tetrahedra[e];
    const TetraRest& rest = dynamics.tetrahedra().rest(e);
    const auto edges = edges_of(t, shapes);
    double square = 0;  // of sum edges_i b_i^T
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k <= i; ++k)
        square += (i == k ? 1 : 2) * rest.b.col(i + 1).dot(rest.b.col(k + 1)) *
                  edges[static_cast<std::size_t>(i)].cwiseProduct(edges[static_cast<std::size_t>(k)]).sum();
    const SolidMaterial& m = body.materials[t.material];
    square = std::max(square, 0.0);
    weights.push_back(rest.volume_m3 * m.young_pa / (2 * (1 + m.poisson)) * square * std::sqrt(square));
  }
  return weights;
}

/// V mu_L |dF|^3 of each hexahedron, dF of the mean gradient.
std::vector<double> hexa_weights(const Dynamics& dynamics, const ShapeRows& shapes) {
  const LumpedBody& body = dynamics.body();
  std::vector<double> weights;
  for (std::uint32_t e = 0; e < body.hexahedra.size(); ++e) {
    const HexaRest& rest = dynamics.hexahedra().shape(e).rest;
    const auto& nodes = body.hexahedra[e].nodes;
    std::array<EdgeRows, 3> columns;  // of dF, for every shape
    for (EdgeRows& column : columns) column = EdgeRows::Zero(3, shapes.cols());
    for (std::size_t i = 1; i < 8; ++i) {  // the b_i sum to nothing
      const EdgeRows way = shapes.middleRows<3>(3 * static_cast<Eigen::Index>(nodes[i])) -
                           shapes.middleRows<3>(3 * static_cast<Eigen::Index>(nodes[0]));
      for (std::size_t c = 0; c < 3; ++c) columns[c] += rest.g(static_cast<Eigen::Index>(c), static_cast<Eigen::Index>(i)) * way;
    }
    const double square = columns[0].squaredNorm() + columns[1].squaredNorm() + columns[2].squaredNorm();
    const SolidMaterial& m = body.materials[body.hexahedra[e].material];
    weights.push_back(rest.volume_m3 * m.young_pa / (2 * (1 + m.poisson)) * square * std::sqrt(square));
  }
  return weights;
}

void add_second_order_of_hexahedra(const Dynamics& dynamics, const BodyState& state, const Matrix& directions,
                                   std::vector<Vector>& forces) {
  const Hexahedra& hexahedra = dynamics.hexahedra();
  const auto n = static_cast<int>(directions.cols());
  std::vector<Mat3> changes(static_cast<std::size_t>(n));
  for (std::uint32_t e = 0; e < dynamics.body().hexahedra.size(); ++e) {
    const HexaRest& rest = hexahedra.shape(e).rest;
    const Mat3 at = hexahedra.gradient(e, state.x).leftCols<3>();
    for (int k = 0; k < n; ++k) changes[static_cast<std::size_t>(k)] = hexahedra.gradient(e, directions.col(k)).leftCols<3>();
    for (int j = 0; j < n; ++j)
      for (int i = 0; i <= j; ++i) {
        const Mat3 stress = (i == j ? -0.5 : -1.0) * rest.volume_m3 *
                            second_order_stress(hexahedra.material(e), at, changes[static_cast<std::size_t>(i)],
                                                changes[static_cast<std::size_t>(j)]);
        Vector& sum = forces[static_cast<std::size_t>(pair_at(i, j))];
        for (int k = 0; k < 8; ++k)
          at_node(sum, dynamics.body().hexahedra[e].nodes[static_cast<std::size_t>(k)]) += stress * rest.g.col(k).head<3>();
      }
  }
}

void add_second_order(const Dynamics& dynamics, const BodyState& state, const Matrix& directions, std::vector<Vector>& forces) {
  const LumpedBody& body = dynamics.body();
  const std::vector<TetraMaterial> materials(body.materials.begin(), body.materials.end());
  const auto n = static_cast<int>(directions.cols());
  std::vector<Mat3> df(static_cast<std::size_t>(n));
  for (std::uint32_t e = 0; e < body.tetrahedra.size(); ++e) {
    const Tetrahedron& t = body.tetrahedra[e];
    const TetraRest& rest = dynamics.tetrahedra().rest(e);
    const auto edges = edges_of(t, directions);
    const auto at_stamp = edges_of(t, state.x);
    Mat3 f = Mat3::Zero();
    std::fill(df.begin(), df.end(), Mat3::Zero());
    for (std::size_t i = 0; i < 3; ++i) {
      const Eigen::RowVector3d b = rest.b.col(static_cast<Eigen::Index>(i + 1)).transpose();
      f += at_stamp[i] * b;
      for (int k = 0; k < n; ++k) df[static_cast<std::size_t>(k)] += edges[i].col(k) * b;
    }
    for (int j = 0; j < n; ++j)
      for (int i = 0; i <= j; ++i) {
        const Mat3 stress =
            (i == j ? -0.5 : -1.0) * rest.volume_m3 *
            second_order_stress(materials[t.material], f, df[static_cast<std::size_t>(i)], df[static_cast<std::size_t>(j)]);
        Vector& sum = forces[static_cast<std::size_t>(pair_at(i, j))];
        for (int k = 0; k < 4; ++k)
          sum.segment<3>(3 * static_cast<Eigen::Index>(t.nodes[static_cast<std::size_t>(k)])) += stress * rest.b.col(k);
      }
  }
}

}  // namespace

bool can_bend(const LumpedBody& body) {
  if (!body.is_solid()) return is_smooth(body.law);
  const bool one_law = std::all_of(body.materials.begin(), body.materials.end(), [&](const SolidMaterial& m) {
    return m.law == body.materials.front().law && m.shape == body.materials.front().shape;
  });
  return body.elements.empty() && one_law;
}

/// By their weights in bins of a sixteenth of an octave; those are left out whose weights are the smallest and together no more
/// than `negligible` of all, and of the last bin those for which there is no room.
std::vector<std::uint32_t> elements_that_bend(const Dynamics& dynamics, const BodyState& state, const Matrix& columns,
                                              double negligible, std::size_t most) {
  assert(columns.rows() == state.x.size() && negligible >= 0 && negligible < 1);
  const LumpedBody& body = dynamics.body();
  const std::vector<double> weights = !body.tetrahedra.empty()  ? tetra_weights(dynamics, columns)
                                      : !body.hexahedra.empty() ? hexa_weights(dynamics, columns)
                                                                : spring_weights(body, state, columns.cast<float>());
  // Exponent and first four bits of a positive number: the larger, the larger.
  const auto bin_of = [](double weight) { return std::bit_cast<std::uint32_t>(static_cast<float>(weight)) >> 19U; };
  struct Bin {
    double weight = 0;
    std::size_t count = 0;
  };
  std::vector<Bin> filled(4096);
  std::vector<std::uint32_t> bins(weights.size());
  double all = 0;
  for (std::size_t k = 0; k < weights.size(); ++k) {
    bins[k] = bin_of(weights[k]);
    filled[bins[k]].weight += weights[k];
    ++filled[bins[k]].count;
    all += weights[k];
  }
  std::size_t least = 0, last = filled.size() - 1, room = most;
  for (double left_out = filled[0].weight; least < last && left_out <= negligible * all; left_out += filled[least].weight)
    ++least;
  least = std::max<std::size_t>(least, 1);
  for (; last > least && filled[last].count <= room; --last) room -= filled[last].count;
  std::vector<std::uint32_t> chosen;
  for (std::uint32_t k = 0; k < bins.size(); ++k) {
    if (bins[k] < last || (bins[k] == last && room == 0)) continue;
    if (bins[k] == last) --room;
    chosen.push_back(k);
  }
  return chosen;
}

std::vector<Vector> second_order_forces(const Dynamics& dynamics, const BodyState& state, const Matrix& directions) {
  assert(directions.rows() == state.x.size() && can_bend(dynamics.body()));
  const LumpedBody& body = dynamics.body();
  const auto n = static_cast<int>(directions.cols());
  std::vector<Vector> forces(static_cast<std::size_t>(pairs_of(n)), Vector::Zero(directions.rows()));
  add_second_order(dynamics, state, directions, forces);
  add_second_order_of_hexahedra(dynamics, state, directions, forces);
  for (const Element& e : body.elements) {
    const auto a = 3 * static_cast<Eigen::Index>(e.a), b = 3 * static_cast<Eigen::Index>(e.b);
    const Vec3 d = state.x.segment<3>(b) - state.x.segment<3>(a);
    const double rho = d.norm();
    if (!(rho > kElementLengthMin)) continue;
    const Vec3 axis = d / rho;
    const SpringSeries series = spring_series(body.law, body.stiffening, e, rho - e.rest_length_m);
    const double alpha = (series.slope - series.tension / rho) / (2 * rho), beta = series.second / 6;
    const Eigen::Matrix<double, 3, Eigen::Dynamic> delta = directions.middleRows<3>(b) - directions.middleRows<3>(a);
    const Eigen::RowVectorXd along = axis.transpose() * delta;
    const Eigen::Matrix<double, 3, Eigen::Dynamic> across = delta - axis * along;
    for (int j = 0; j < n; ++j)
      for (int i = 0; i <= j; ++i) {
        // minus the gradient of a (alpha |c|^2 + beta a^2), the bilinear form of it
        const Vec3 f =
            (i == j ? 1.0 : 2.0) * ((alpha * across.col(i).dot(across.col(j)) + 3 * beta * along[i] * along[j]) * axis +
                                    alpha * (along[i] * across.col(j) + along[j] * across.col(i)));
        Vector& sum = forces[static_cast<std::size_t>(pair_at(i, j))];
        sum.segment<3>(a) += f;
        sum.segment<3>(b) -= f;
      }
  }
  return forces;
}

}  // namespace palpate
