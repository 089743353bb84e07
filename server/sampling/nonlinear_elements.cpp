#include "server/sampling/nonlinear_elements.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>

#include "common/mechanics/laws.hpp"
#include "server/operators/local_body.hpp"
#include "server/sampling/element_gradient.hpp"

namespace palpate {
namespace {

/// The shapes, node by node.
using ShapeRows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
/// The same in single precision, for estimates.
using RoughShapes = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Returns k |delta|^3 / rho of each spring.
std::vector<double> spring_weights(const LumpedBody& body, const BodyState& state, const RoughShapes& shapes) {
  std::vector<double> weights;
  weights.reserve(body.elements.size());
  const Eigen::Index numbers = 3 * shapes.cols();  // per node
  const auto of_node = [&](std::uint32_t node) {
    return Eigen::Map<const Eigen::VectorXf>(shapes.data() + numbers * static_cast<Eigen::Index>(node), numbers);
  };
  for (const Element& e : body.elements) {
    const auto a = 3 * static_cast<Eigen::Index>(e.a), b = 3 * static_cast<Eigen::Index>(e.b);
    const auto motion = static_cast<double>((of_node(e.b) - of_node(e.a)).norm());
    const double rho = (state.x.segment<3>(b) - state.x.segment<3>(a)).norm();
    weights.push_back(e.stiffness_n_m * motion * motion * motion / std::max(rho, kElementLengthMinM));
  }
  return weights;
}

/// Returns V mu_L |dF|^3 of each finite element.
std::vector<double> solid_weights(const Dynamics& dynamics, const ShapeRows& shapes) {
  using NodeRows = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, kMaxVariables>;
  std::vector<double> weights;
  for (std::uint32_t e = 0; e < elements_of(dynamics.body()); ++e) {
    const ElementGradient element = element_gradient(dynamics, e);
    const auto rows = [&](std::size_t i) { return shapes.middleRows<3>(3 * static_cast<Eigen::Index>(element.nodes[i])); };
    std::array<NodeRows, 3> columns;  // per shape: the columns of dF
    for (NodeRows& column : columns) column = NodeRows::Zero(3, shapes.cols());
    for (std::size_t i = 1; i < element.nodes.size(); ++i) {  // the b_i sum to zero
      const NodeRows way = rows(i) - rows(0);
      for (std::size_t c = 0; c < 3; ++c)
        columns[c] += element.b(static_cast<Eigen::Index>(c), static_cast<Eigen::Index>(i)) * way;
    }
    const double square = columns[0].squaredNorm() + columns[1].squaredNorm() + columns[2].squaredNorm();
    const SolidMaterial& m = dynamics.body().materials[element.material];
    weights.push_back(lame_parameters(m.law, element.volume_m3 * m.young_pa, m.poisson).mu * square * std::sqrt(square));
  }
  return weights;
}

/// Returns d^2P/dF^2 [dF_1, dF_2] [Pa] of `law` at F, by differences of its stress in the four lanes of a vector.
Mat3 second_order_stress(const Elasticity& law, const LameParameters& lame, const Mat3& f, const Mat3& df_1, const Mat3& df_2) {
  constexpr double kStep = 1e-3;  // of the larger |dF|: error of 1e-6 by the fourth order, of 1e-10 by rounding
  using L = Lanes<double, 4>;
  const double size_1 = df_1.norm(), size_2 = df_2.norm();
  if (!(size_1 > 0) || !(size_2 > 0)) return Mat3::Zero();
  LaneMatrix<L> h, p{};
  for (int k = 0; k < 9; ++k) {
    const double one = kStep / size_1 * df_1(k / 3, k % 3), two = kStep / size_2 * df_2(k / 3, k % 3);
    h.of[k / 3][k % 3] = f(k / 3, k % 3) - (k % 4 == 0 ? 1 : 0) + L{one + two, -one - two, one - two, two - one};
  }
  law.add_stress({L{} + lame.mu, L{} + lame.lambda}, h, p);
  Mat3 second;
  for (int k = 0; k < 9; ++k) {
    const L& of = p.of[k / 3][k % 3];
    second(k / 3, k % 3) = of[0] + of[1] - of[2] - of[3];
  }
  return size_1 * size_2 / (4 * kStep * kStep) * second;
}

void add_second_order_of_solid(const Dynamics& dynamics, const BodyState& state, const Matrix& directions,
                               std::vector<Vector>& forces) {
  std::vector<Elasticity> laws;
  for (const SolidMaterial& m : dynamics.body().materials) laws.emplace_back(m.parameters());
  const auto n = static_cast<int>(directions.cols());
  std::vector<Mat3> changes(static_cast<std::size_t>(n));
  for (std::uint32_t e = 0; e < elements_of(dynamics.body()); ++e) {
    const ElementGradient element = element_gradient(dynamics, e);
    const SolidMaterial& m = dynamics.body().materials[element.material];
    const LameParameters lame = lame_parameters(m.law, element.volume_m3 * m.young_pa, m.poisson);
    const Mat3 at = mean_gradient(dynamics, e, state.x);
    for (int k = 0; k < n; ++k) changes[static_cast<std::size_t>(k)] = mean_gradient(dynamics, e, directions.col(k));
    for (int j = 0; j < n; ++j)
      for (int i = 0; i <= j; ++i) {
        const Mat3 stress =
            (i == j ? -0.5 : -1.0) * second_order_stress(laws[element.material], lame, at, changes[static_cast<std::size_t>(i)],
                                                         changes[static_cast<std::size_t>(j)]);
        Vector& sum = forces[static_cast<std::size_t>(pair_at(i, j))];
        for (std::size_t k = 0; k < element.nodes.size(); ++k)
          at_node(sum, element.nodes[k]) += stress * element.b.col(static_cast<Eigen::Index>(k));
      }
  }
}

}  // namespace

bool has_nonlinear_elements(const LumpedBody& body) {
  if (!body.is_solid()) return body.law != SpringLaw::thigh_skin;
  return std::all_of(body.materials.begin(), body.materials.end(), [&](const SolidMaterial& m) {
    return m.law == SolidLaw::membrane || m.parameters() == body.materials.front().parameters();
  });
}

/// Sorts by weight in bins of a sixteenth of an octave. Left out are the elements with the smallest weights, with a sum of at
/// most `negligible` of the total, and of the last bin those for which there is no room.
std::vector<std::uint32_t> nonlinear_elements(const Dynamics& dynamics, const BodyState& state, const Matrix& columns,
                                              double negligible, std::size_t most) {
  assert(columns.rows() == state.x.size() && negligible >= 0 && negligible < 1);
  const LumpedBody& body = dynamics.body();
  const std::vector<double> weights =
      body.is_solid() ? solid_weights(dynamics, columns) : spring_weights(body, state, columns.cast<float>());
  // Exponent and first four bits of a positive number: monotonic in it.
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
  std::size_t least = 0, last = filled.size() - 1, left = most;
  for (double left_out = filled[0].weight; least < last && left_out <= negligible * all; left_out += filled[least].weight)
    ++least;
  least = std::max<std::size_t>(least, 1);
  for (; last > least && filled[last].count <= left; --last) left -= filled[last].count;
  std::vector<std::uint32_t> chosen;
  for (std::uint32_t k = 0; k < bins.size(); ++k) {
    if (bins[k] < last || (bins[k] == last && left == 0)) continue;
    if (bins[k] == last) --left;
    chosen.push_back(k);
  }
  return chosen;
}

std::vector<Vector> second_order_forces(const Dynamics& dynamics, const BodyState& state, const Matrix& directions) {
  assert(directions.rows() == state.x.size() && has_nonlinear_elements(dynamics.body()));
  const LumpedBody& body = dynamics.body();
  const auto n = static_cast<int>(directions.cols());
  std::vector<Vector> forces(static_cast<std::size_t>(pairs_of(n)), Vector::Zero(directions.rows()));
  if (body.is_solid()) add_second_order_of_solid(dynamics, state, directions, forces);
  const SpringMaterial law(body);
  for (const Element& e : body.elements) {
    const auto a = 3 * static_cast<Eigen::Index>(e.a), b = 3 * static_cast<Eigen::Index>(e.b);
    const Vec3 d = state.x.segment<3>(b) - state.x.segment<3>(a);
    const double rho = d.norm();
    if (!(rho > kElementLengthMinM)) continue;
    const Vec3 axis = d / rho;
    const double elongation_m = rho - e.rest_length_m;
    double tension, slope;
    law.respond(e.stiffness_n_m, e.rest_length_m, elongation_m, tension, slope);
    const double alpha = (slope - tension / rho) / (2 * rho),
                 beta = e.stiffness_n_m * law.stiffening * elongation_m / (e.rest_length_m * e.rest_length_m);
    const Eigen::Matrix<double, 3, Eigen::Dynamic> delta = directions.middleRows<3>(b) - directions.middleRows<3>(a);
    const Eigen::RowVectorXd along = axis.transpose() * delta;
    const Eigen::Matrix<double, 3, Eigen::Dynamic> across = delta - axis * along;
    for (int j = 0; j < n; ++j)
      for (int i = 0; i <= j; ++i) {
        // Minus the gradient of a (alpha |c|^2 + beta a^2), as a bilinear form.
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
