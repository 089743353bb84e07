#include "server/reduce/expansion.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace palpate {
namespace {

using Features = Eigen::MatrixXf;

constexpr double kLengthMin = 1e-9;  // below, an element has no direction [m]

/// One element's geometry at the state, and how the shapes stretch and turn it.
struct Axes {
  Vec3 n, t1, t2;
};

Axes axes_along(const Vec3& n) {
  Eigen::Index least = 0;
  n.cwiseAbs().minCoeff(&least);
  const Vec3 t1 = n.cross(Vec3::Unit(least)).normalized();
  return {n, t1, n.cross(t1)};
}

/// Taylor coefficients of the energy, see the header, and of the damper.
struct Coefficients {
  double alpha, beta, gamma, delta, epsilon, damper;
};

Coefficients coefficients(const Element& e, const SpringSeries& s, double rho) {
  return {(s.slope - s.tension / rho) / (2 * rho),
          s.second / 6,
          (s.tension / rho - s.slope) / (2 * rho * rho) + s.second / (4 * rho),
          (s.slope - s.tension / rho) / (8 * rho * rho),
          s.third / 24,
          e.damping_n_s_m / rho};
}

/// Elements by how much they matter, those that do not left out.
std::vector<std::uint32_t> elements_that_matter(const Dynamics& dynamics, const BodyState& state, const Matrix& shapes,
                                                double negligible) {
  const auto& elements = dynamics.body().elements;
  std::vector<double> weight(elements.size());
  for (std::size_t k = 0; k < elements.size(); ++k) {
    const Element& e = elements[k];
    const auto a = 3 * static_cast<Eigen::Index>(e.a), b = 3 * static_cast<Eigen::Index>(e.b);
    const double motion = (shapes.middleRows<3>(b) - shapes.middleRows<3>(a)).norm();
    const double rho = (state.x.segment<3>(b) - state.x.segment<3>(a)).norm();
    weight[k] = e.stiffness_n_m * motion * motion * motion / std::max(rho, kLengthMin);
  }
  std::vector<std::uint32_t> order(elements.size());
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t i, std::uint32_t j) { return weight[i] != weight[j] ? weight[i] > weight[j] : i < j; });
  double rest = negligible * std::accumulate(weight.begin(), weight.end(), 0.0);
  while (!order.empty() && weight[order.back()] <= rest) {
    rest -= weight[order.back()];
    order.pop_back();
  }
  return order;
}

/// Features of a batch of elements, one column each.
struct Batch {
  Batch(int n, int size) : along(n, size), across(pairs_of(n), size), squared(pairs_of(n), size), coefficient(size) {}
  Features along;            ///< a_i
  Features across, squared;  ///< of b and a^2, as polynomials: the coefficient of y_i y_j, i <= j
  std::vector<Coefficients> coefficient;
};

void fill(Batch& batch, int column, const Axes& axes, const Eigen::Matrix<double, 3, Eigen::Dynamic>& g) {
  const Eigen::VectorXf a = (axes.n.transpose() * g).transpose().cast<float>();
  const Eigen::VectorXf u = (axes.t1.transpose() * g).transpose().cast<float>(),
                        v = (axes.t2.transpose() * g).transpose().cast<float>();
  batch.along.col(column) = a;
  for (int j = 0; j < a.size(); ++j)
    for (int i = 0; i <= j; ++i) {
      const float twice = i == j ? 1.0F : 2.0F;
      batch.across(pair_at(i, j), column) = twice * (u[i] * u[j] + v[i] * v[j]);
      batch.squared(pair_at(i, j), column) = twice * a[i] * a[j];
    }
}

template <typename Get>
Eigen::RowVectorXf weights(const Batch& batch, Get get) {
  Eigen::RowVectorXf w(static_cast<Eigen::Index>(batch.coefficient.size()));
  for (Eigen::Index k = 0; k < w.size(); ++k) w[k] = static_cast<float>(get(batch.coefficient[static_cast<std::size_t>(k)]));
  return w;
}

/// Sums over elements, as matrices of features against features.
struct Sums {
  Features third, fourth, damper;
};

void add(const Batch& batch, int leading, Sums& sums) {
  const auto rows = pairs_of(leading);
  const auto weighted = [](const auto& features, const Eigen::RowVectorXf& w) {
    return (features.array().rowwise() * w.array()).matrix();
  };
  const Features third = weighted(batch.across, weights(batch, [](const Coefficients& c) { return c.alpha; })) +
                         weighted(batch.squared, weights(batch, [](const Coefficients& c) { return c.beta; }));
  sums.third.noalias() += batch.along * third.transpose();
  const auto across = batch.across.topRows(rows), squared = batch.squared.topRows(rows);
  const Features with_squared = weighted(squared, weights(batch, [](const Coefficients& c) { return c.epsilon; })) +
                                weighted(across, weights(batch, [](const Coefficients& c) { return c.gamma; }));
  const Features with_across = weighted(across, weights(batch, [](const Coefficients& c) { return c.delta; }));
  sums.fourth.noalias() += squared * with_squared.transpose();
  sums.fourth.noalias() += across * with_across.transpose();
  const Features damper = weighted(across, weights(batch, [](const Coefficients& c) { return c.damper; }));
  sums.damper.noalias() += batch.along.topRows(leading) * damper.transpose();
}

/// From products of monomials to monomials.
Expansion collect(const Sums& sums, int n, int leading) {
  Expansion x;
  x.e3.setZero(triples_of(n));
  for (int p = 0; p < n; ++p)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i <= j; ++i) {
        std::array<int, 3> m{i, j, p};
        std::sort(m.begin(), m.end());
        x.e3[triple_at(m[0], m[1], m[2])] += sums.third(p, pair_at(i, j));
      }
  x.e4.setZero(quadruples_of(leading));
  for (int s = 0; s < leading; ++s)
    for (int r = 0; r <= s; ++r)
      for (int j = 0; j < leading; ++j)
        for (int i = 0; i <= j; ++i) {
          std::array<int, 4> m{i, j, r, s};
          std::sort(m.begin(), m.end());
          x.e4[quadruple_at(m[0], m[1], m[2], m[3])] += sums.fourth(pair_at(i, j), pair_at(r, s));
        }
  x.q = sums.damper;
  for (int j = 0; j < leading; ++j)
    for (int i = 0; i < j; ++i) x.q.col(pair_at(i, j)) *= 0.5F;  // the entry of the symmetric matrix, not of the polynomial
  return x;
}

}  // namespace

bool can_expand(const LumpedBody& body) { return body.tetrahedra.empty() && has_series(body.law); }

std::optional<Expansion> expand(const Dynamics& dynamics, const BodyState& state, const Matrix& shapes, int leading,
                                double negligible) {
  constexpr int kBatch = 256;
  const LumpedBody& body = dynamics.body();
  if (!can_expand(body)) return std::nullopt;
  const auto n = static_cast<int>(shapes.cols());
  const std::vector<std::uint32_t> chosen = elements_that_matter(dynamics, state, shapes, negligible);
  Sums sums{Features::Zero(n, pairs_of(n)), Features::Zero(pairs_of(leading), pairs_of(leading)),
            Features::Zero(leading, pairs_of(leading))};
  for (std::size_t begin = 0; begin < chosen.size(); begin += kBatch) {
    const auto size = static_cast<int>(std::min<std::size_t>(kBatch, chosen.size() - begin));
    Batch batch(n, size);
    for (int c = 0; c < size; ++c) {
      const Element& e = body.elements[chosen[begin + static_cast<std::size_t>(c)]];
      const auto a = 3 * static_cast<Eigen::Index>(e.a), b = 3 * static_cast<Eigen::Index>(e.b);
      const Vec3 d = state.x.segment<3>(b) - state.x.segment<3>(a);
      const double rho = d.norm();
      if (!(rho > kLengthMin)) return std::nullopt;
      batch.coefficient[static_cast<std::size_t>(c)] =
          coefficients(e, spring_series(body.law, body.stiffening, e, rho - e.rest_length_m), rho);
      fill(batch, c, axes_along(d / rho), shapes.middleRows<3>(b) - shapes.middleRows<3>(a));
    }
    add(batch, leading, sums);
  }
  Expansion x = collect(sums, n, leading);
  x.elements = static_cast<int>(chosen.size());
  return x;
}

std::vector<Vector> second_order_forces(const Dynamics& dynamics, const BodyState& state, const Matrix& directions) {
  const LumpedBody& body = dynamics.body();
  const auto n = static_cast<int>(directions.cols());
  std::vector<Vector> forces(static_cast<std::size_t>(pairs_of(n)), Vector::Zero(directions.rows()));
  for (const Element& e : body.elements) {
    const auto a = 3 * static_cast<Eigen::Index>(e.a), b = 3 * static_cast<Eigen::Index>(e.b);
    const Vec3 d = state.x.segment<3>(b) - state.x.segment<3>(a);
    const double rho = d.norm();
    if (!(rho > kLengthMin)) continue;
    const Vec3 axis = d / rho;
    const Coefficients c = coefficients(e, spring_series(body.law, body.stiffening, e, rho - e.rest_length_m), rho);
    const Eigen::Matrix<double, 3, Eigen::Dynamic> delta = directions.middleRows<3>(b) - directions.middleRows<3>(a);
    const Eigen::RowVectorXd along = axis.transpose() * delta;
    const Eigen::Matrix<double, 3, Eigen::Dynamic> across = delta - axis * along;
    for (int j = 0; j < n; ++j)
      for (int i = 0; i <= j; ++i) {
        // minus the gradient of a (alpha b + beta a^2), the bilinear form of it
        const Vec3 f =
            (i == j ? 1.0 : 2.0) * ((c.alpha * across.col(i).dot(across.col(j)) + 3 * c.beta * along[i] * along[j]) * axis +
                                    c.alpha * (along[i] * across.col(j) + along[j] * across.col(i)));
        Vector& sum = forces[static_cast<std::size_t>(pair_at(i, j))];
        sum.segment<3>(a) += f;
        sum.segment<3>(b) -= f;
      }
  }
  return forces;
}

}  // namespace palpate
