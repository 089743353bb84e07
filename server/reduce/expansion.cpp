#include "server/reduce/expansion.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace palpate {
namespace {

/// A row for each feature, so that what is done to one is done to many elements side by side.
using Features = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
/// The shapes, those of a node one after the other.
using ShapeRows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
/// The same where two digits are enough.
using RoughShapes = Features;

constexpr double kElementLengthMin = 1e-9;  // below, an element has no direction [m]

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

/// Features of a batch of elements, one column each.
struct Batch {
  Batch(int n, int size)
      : along(n, size),
        aside(n, size),
        athwart(n, size),
        across(pairs_of(n), size),
        squared(pairs_of(n), size),
        coefficient(size) {}
  Features along, aside, athwart;  ///< a_i, and the two parts of the motion across
  Features across, squared;        ///< of b and a^2, as polynomials: the coefficient of y_i y_j, i <= j
  std::vector<Coefficients> coefficient;
};

/// The motion of shape i along an element's axes, from the shapes at its ends (three rows of n numbers each).
void fill(Batch& batch, Eigen::Index column, const Axes& axes, const double* at_a, const double* at_b) {
  const Eigen::Index n = batch.along.rows();
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vec3 g(at_b[i] - at_a[i], at_b[n + i] - at_a[n + i], at_b[2 * n + i] - at_a[2 * n + i]);
    batch.along(i, column) = static_cast<float>(axes.n.dot(g));
    batch.aside(i, column) = static_cast<float>(axes.t1.dot(g));
    batch.athwart(i, column) = static_cast<float>(axes.t2.dot(g));
  }
}

void fill_pairs(Batch& batch) {
  const auto n = static_cast<int>(batch.along.rows());
  for (int j = 0; j < n; ++j)
    for (int i = 0; i <= j; ++i) {
      const float twice = i == j ? 1.0F : 2.0F;
      const auto row = pair_at(i, j);
      batch.across.row(row) =
          twice * (batch.aside.row(i).cwiseProduct(batch.aside.row(j)) + batch.athwart.row(i).cwiseProduct(batch.athwart.row(j)));
      batch.squared.row(row) = twice * batch.along.row(i).cwiseProduct(batch.along.row(j));
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

/// |k| delta^3 / rho of each spring.
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

bool can_expand(const LumpedBody& body) { return body.tetrahedra.empty() && has_series(body.law); }

bool can_bend(const LumpedBody& body) {
  const bool one_law = std::all_of(body.materials.begin(), body.materials.end(),
                                   [&](const SolidMaterial& m) { return m.law == body.materials.front().law; });
  return can_expand(body) || (body.elements.empty() && !body.tetrahedra.empty() && one_law);
}

std::optional<Expansion> expand(const Dynamics& dynamics, const BodyState& state, const Matrix& shapes, int leading,
                                double negligible) {
  constexpr int kBatch = 256;
  const LumpedBody& body = dynamics.body();
  if (!can_expand(body)) return std::nullopt;
  const auto n = static_cast<int>(shapes.cols());
  const ShapeRows rows = shapes;
  const std::vector<std::uint32_t> chosen = elements_that_bend(dynamics, state, shapes, negligible, body.elements.size());
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
      if (!(rho > kElementLengthMin)) return std::nullopt;
      batch.coefficient[static_cast<std::size_t>(c)] =
          coefficients(e, spring_series(body.law, body.stiffening, e, rho - e.rest_length_m), rho);
      fill(batch, c, axes_along(d / rho), rows.row(a).data(), rows.row(b).data());
    }
    fill_pairs(batch);
    add(batch, leading, sums);
  }
  Expansion x = collect(sums, n, leading);
  x.elements = static_cast<int>(chosen.size());
  return x;
}

/// By their weights in bins of a sixteenth of an octave; those are left out whose weights are the smallest and together no more
/// than `negligible` of all, and of the last bin those for which there is no room.
std::vector<std::uint32_t> elements_that_bend(const Dynamics& dynamics, const BodyState& state, const Matrix& columns,
                                              double negligible, std::size_t most) {
  const LumpedBody& body = dynamics.body();
  const std::vector<double> weights =
      body.tetrahedra.empty() ? spring_weights(body, state, columns.cast<float>()) : tetra_weights(dynamics, columns);
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
  const LumpedBody& body = dynamics.body();
  const auto n = static_cast<int>(directions.cols());
  std::vector<Vector> forces(static_cast<std::size_t>(pairs_of(n)), Vector::Zero(directions.rows()));
  add_second_order(dynamics, state, directions, forces);
  for (const Element& e : body.elements) {
    const auto a = 3 * static_cast<Eigen::Index>(e.a), b = 3 * static_cast<Eigen::Index>(e.b);
    const Vec3 d = state.x.segment<3>(b) - state.x.segment<3>(a);
    const double rho = d.norm();
    if (!(rho > kElementLengthMin)) continue;
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
