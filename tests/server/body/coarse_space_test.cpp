// The coarse space against the whole matrix, and its effect on conjugate gradients.
#include "server/body/coarse_space.hpp"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include "server/body/batch_cg.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr double kMass = 400, kDamping = 20;  // c_m, c_d of a patch's matrix

LumpedBody body_of(int n, bool solid) {
  return solid ? solid_box(n, n, n, {SolidLaw::neo_hookean, 4000, 0.4, 0.05}) : box_body(n, n, n);
}

/// Displacements of all nodes when the pieces move by q.
Vector moved(const CoarseSpace& space, const Vector& q) {
  Vector x = Vector::Zero(3 * static_cast<Eigen::Index>(space.nodes().size()));
  for (std::size_t i = 0; i < space.nodes().size(); ++i) {
    const CoarseSpace::Node& node = space.nodes()[i];
    if (node.piece == CoarseSpace::kNone) continue;
    const auto piece = q.segment<6>(6 * static_cast<Eigen::Index>(node.piece));
    const Vec3 arm(node.arm[0], node.arm[1], node.arm[2]), turn = piece.tail<3>();
    x.segment<3>(3 * static_cast<Eigen::Index>(i)) = piece.head<3>() + turn.cross(arm);
  }
  return x;
}

/// P^T r, by its definition: one motion after the other.
Vector gathered(const CoarseSpace& space, const Vector& r) {
  Vector sum(static_cast<Eigen::Index>(space.size()));
  for (Eigen::Index k = 0; k < sum.size(); ++k) sum[k] = moved(space, Vector::Unit(sum.size(), k)).dot(r);
  return sum;
}

struct Solved {
  std::vector<Vector> x;
  int iterations = 0;
};

Solved solved(const Dynamics& dynamics, bool coarsely) {
  const auto& fixed = dynamics.body().fixed;
  BlockMatrix a = dynamics.make_matrix();
  dynamics.assemble(random_state(dynamics, 3, 0.001, 0.1), kMass, kDamping, 1, fixed, false, a);
  CoarseSpace space(dynamics);
  BatchConjugateGradients solver;
  solver.prepare(a, fixed, {coarsely ? space.inverse(kMass, kDamping) : nullptr, space.nodes()});
  Random random(5);
  std::vector<Vector> b(3, Vector::Zero(dynamics.masses().size()));
  Solved result{std::vector<Vector>(3), 0};
  std::vector<SolveColumn> columns;
  for (std::size_t k = 0; k < b.size(); ++k) {
    b[k][b[k].size() - 3 + static_cast<Eigen::Index>(k)] = 1;  // a corner of the top
    columns.push_back({&b[k], &result.x[k]});
  }
  bool definite = true;
  result.iterations = solver.solve(columns, 1e-5, definite);
  REQUIRE(definite);
  return result;
}

}  // namespace

TEST_CASE("Motions in pieces are answered exactly by the coarse space alone") {
  const bool solid = GENERATE(false, true);
  const LumpedBody body = body_of(6, solid);
  const Dynamics dynamics(body);
  CoarseSpace space(dynamics);
  BlockMatrix a = dynamics.make_matrix();
  dynamics.assemble(dynamics.rest_state(), kMass, kDamping, 1, std::vector<std::uint8_t>(dynamics.nodes(), 0), false, a);
  Random random(1);
  Vector q(static_cast<Eigen::Index>(space.size()));
  for (Eigen::Index k = 0; k < q.size(); ++k) q[k] = random.uniform(-1, 1) * (k % 6 < 3 ? 0.01 : 1.0);
  Vector r;
  a.multiply(moved(space, q), r);
  const auto inverse = space.inverse(kMass, kDamping);
  REQUIRE(inverse);
  const Eigen::Map<const Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> rows(inverse->rows.data(),
                                                                                                     q.size(), q.size());
  const Vector again = rows.cast<double>() * gathered(space, r);
  CHECK((again - q).norm() < 1e-4 * q.norm());
}

TEST_CASE("With a coarse space the answers are the same and the iterations hardly grow with the body") {
  const bool solid = GENERATE(false, true);
  const LumpedBody small = body_of(8, solid), large = body_of(14, solid);
  const Dynamics few(small), many(large);
  const Solved plain = solved(many, false), coarse = solved(many, true);
  for (std::size_t k = 0; k < 3; ++k) CHECK((coarse.x[k] - plain.x[k]).norm() < 1e-3 * plain.x[k].norm());
  CHECK(2 * coarse.iterations < plain.iterations);
  CHECK(coarse.iterations < 1.4 * solved(few, true).iterations);
}

TEST_CASE("Inverses are kept for coefficients that are near") {
  const LumpedBody body = box_body(5, 5, 5);
  const Dynamics dynamics(body);
  CoarseSpace space(dynamics);
  const auto first = space.inverse(400, 20);
  CHECK(space.inverse(450, 21) == first);
  CHECK(space.inverse(900, 30) != first);
  CHECK(space.inverse(400, 20) == first);
}
