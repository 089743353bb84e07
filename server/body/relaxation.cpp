#include "server/body/relaxation.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "common/mechanics/polar.hpp"

namespace palpate {
namespace {

constexpr int kSymmetric = 6;  // numbers of Z; three for each hourglass mode follow
/// Numbers per stress of elements of this kind.
template <class Shape>
constexpr int kNumbers = kSymmetric + 3 * Shape::kModes;
template <class Shape>
using PulledBack = Eigen::Matrix<double, kNumbers<Shape>, 1>;

template <class Numbers>
Mat3 symmetric_of(const Numbers& s) {
  Mat3 m;
  m << s[0], s[3], s[5], s[3], s[1], s[4], s[5], s[4], s[2];
  return m;
}

/// Returns F^-1, bounded for a flat element.
Mat3 back(const Mat3& f) {
  const Mat3 g = cofactors(f);
  return g.transpose() / std::max(f.col(0).dot(g.col(0)), Relaxation::kLeastVolume);
}

/// Returns the stress (P, p) at (F, q), pulled back.
template <class Shape>
PulledBack<Shape> pulled_back(const typename Shape::Gradient& at, const typename Shape::Gradient& stress) {
  PulledBack<Shape> numbers;
  const Mat3 f_back = back(at.template leftCols<3>());
  Mat3 s = f_back * stress.template leftCols<3>();
  if constexpr (Shape::kModes > 0) {
    const Eigen::Matrix<double, 3, Shape::kModes> of_modes = f_back * stress.template rightCols<Shape::kModes>();
    s -= f_back * at.template rightCols<Shape::kModes>() * of_modes.transpose();
    numbers.template tail<3 * Shape::kModes>() = of_modes.reshaped();
  }
  s = 0.5 * (s + s.transpose()).eval();
  numbers.template head<kSymmetric>() << s(0, 0), s(1, 1), s(2, 2), s(0, 1), s(1, 2), s(2, 0);
  return numbers;
}

/// Adds the force densities of a stress to q, those of its pairs of nodes i < j row by row.
template <class Shape>
void add_densities_of(const Shape& shape, const PulledBack<Shape>& stress, const std::uint32_t* pair, Vector& q) {
  Eigen::Matrix<double, 3, Shape::kNodes> z_g = symmetric_of(stress) * shape.b;
  Eigen::Matrix<double, Shape::kNodes, Shape::kNodes> density = shape.b.transpose() * z_g;
  if constexpr (Shape::kModes > 0) {
    z_g = stress.template tail<3 * Shape::kModes>().reshaped(3, Shape::kModes) * shape.gamma;
    const Eigen::Matrix<double, Shape::kNodes, Shape::kNodes> of_modes = shape.b.transpose() * z_g;
    density += of_modes + of_modes.transpose();
  }
  for (int i = 0; i < Shape::kNodes; ++i)
    for (int j = i + 1; j < Shape::kNodes; ++j) q[*pair++] += density(i, j);
}

}  // namespace

Eigen::MatrixXf side_by_side(const StressHistory& history) {
  if (history.relaxed.empty()) return {};
  const Eigen::Index elements = history.relaxed[0].cols();
  Eigen::MatrixXf all(history.relaxed[0].rows(), elements * static_cast<Eigen::Index>(history.relaxed.size()));
  for (std::size_t k = 0; k < history.relaxed.size(); ++k)
    all.middleCols(static_cast<Eigen::Index>(k) * elements, elements) = history.relaxed[k].cast<float>();
  return all;
}

Relaxation::Relaxation(const LumpedBody& body, const Tetrahedra& tetrahedra, const Hexahedra& hexahedra,
                       const BlockPattern& pattern)
    : body_(&body), tetrahedra_(&tetrahedra), hexahedra_(&hexahedra) {
  if (empty()) return;
  assert(body.is_solid() && left() > 0);
  std::vector<std::uint32_t> of_entry(pattern.block_count(), 0);
  first_.assign(body.nodes.size() + 1, 0);
  for (const auto& [a, b] : edges_of(body)) {
    of_entry[pattern.find(a, b)] = of_entry[pattern.find(b, a)] = static_cast<std::uint32_t>(pairs_.size());
    pairs_.push_back({a, b, pattern.find(a, b), pattern.find(b, a)});
    ++first_[a + 1], ++first_[b + 1];
  }
  for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
  incident_.resize(2 * pairs_.size());
  auto next = first_;
  for (std::uint32_t k = 0; k < pairs_.size(); ++k) incident_[next[pairs_[k].a]++] = incident_[next[pairs_[k].b]++] = k;
  const auto add_pairs = [&](const auto& nodes) {
    for (std::size_t i = 0; i < nodes.size(); ++i)
      for (std::size_t j = i + 1; j < nodes.size(); ++j) pair_of_.push_back(of_entry[pattern.find(nodes[i], nodes[j])]);
  };
  for (const Tetrahedron& t : body.tetrahedra)
    if (!t.is_triangle()) add_pairs(t.nodes);
  for (const Hexahedron& h : body.hexahedra) add_pairs(h.nodes);
}

double Relaxation::left() const {
  double left = 1;
  for (const PronyBranch& branch : branches()) left -= branch.share;
  return left;
}

std::uint32_t Relaxation::elements() const {
  if (!body_->hexahedra.empty()) return static_cast<std::uint32_t>(body_->hexahedra.size());
  const auto triangle = [](const Tetrahedron& t) { return t.is_triangle(); };
  return static_cast<std::uint32_t>(std::find_if(body_->tetrahedra.begin(), body_->tetrahedra.end(), triangle) -
                                    body_->tetrahedra.begin());
}

int Relaxation::numbers() const { return hexahedra_->empty() ? kNumbers<TetraShape> : kNumbers<HexaShape>; }

template <class Shape>
void Relaxation::find_elastic(const Elements<Shape>& elements, const Vector& x, Matrix& all) {
  for (Eigen::Index e = 0; e < all.cols(); ++e) {
    const auto element = static_cast<std::uint32_t>(e);
    const typename Shape::Gradient at = elements.gradient(element, x);
    all.col(e) = pulled_back<Shape>(at, elements.elastic_stress(element, at));
  }
}

Matrix Relaxation::elastic(const Vector& x) const {
  Matrix all(numbers(), elements());
  if (hexahedra_->empty())
    find_elastic(*tetrahedra_, x, all);
  else
    find_elastic(*hexahedra_, x, all);
  return all;
}

template <class Shape>
void Relaxation::add_densities(const Elements<Shape>& elements, const Matrix& stress, double share, Vector& q) const {
  constexpr std::size_t kPairs = std::size_t{Shape::kNodes} * (Shape::kNodes - 1) / 2;
  for (Eigen::Index e = 0; e < stress.cols(); ++e) {
    const auto element = static_cast<std::uint32_t>(e);
    add_densities_of<Shape>(elements.shape(element), share * stress.col(e), &pair_of_[kPairs * element], q);
  }
}

void Relaxation::add_densities(const Matrix& stress, double share, Vector& q) const {
  if (hexahedra_->empty())
    add_densities(*tetrahedra_, stress, share, q);
  else
    add_densities(*hexahedra_, stress, share, q);
}

Vector Relaxation::densities(const std::vector<Matrix>& relaxed) const {
  Vector q = Vector::Zero(static_cast<Eigen::Index>(pairs_.size()));
  for (std::size_t k = 0; k < relaxed.size(); ++k) add_densities(relaxed[k], branches()[k].share, q);
  return q;
}

void Relaxation::relax(double h_s, BodyState& state) const {
  if (empty()) return;
  auto next = std::make_shared<StressHistory>();
  const StressHistory* const before = state.history.get();
  next->elastic = before && before->at.size() == state.x.size() && before->at == state.x ? before->elastic : elastic(state.x);
  next->at = state.x;
  for (std::size_t k = 0; k < branches().size(); ++k) {
    const double stays = std::exp(-h_s / branches()[k].time_s);
    next->relaxed.push_back((1 - stays) * next->elastic);
    if (before) next->relaxed[k] += stays * before->relaxed[k];
  }
  next->densities = densities(next->relaxed);
  state.history = std::move(next);
}

void Relaxation::relax_fully(BodyState& state) const {
  if (empty()) return;
  auto next = std::make_shared<StressHistory>();
  next->elastic = elastic(state.x);
  next->at = state.x;
  next->relaxed.assign(branches().size(), next->elastic);
  next->densities = densities(next->relaxed);
  state.history = std::move(next);
}

bool Relaxation::take_up(const Eigen::MatrixXf& relaxed, BodyState& state) const {
  state.history.reset();
  const auto all = static_cast<Eigen::Index>(elements()), branches_of = static_cast<Eigen::Index>(branches().size());
  if (empty() || relaxed.rows() != numbers() || relaxed.cols() != all * branches_of) return empty() && relaxed.size() == 0;
  auto next = std::make_shared<StressHistory>();
  for (Eigen::Index k = 0; k < branches_of; ++k) next->relaxed.push_back(relaxed.middleCols(k * all, all).cast<double>());
  next->densities = densities(next->relaxed);
  state.history = std::move(next);
  return true;
}

void Relaxation::take_up(const StressHistory& was, std::span<const std::uint32_t> before, std::span<const double> share,
                         BodyState& state) const {
  const auto carried = [&](const Matrix& stress) {
    Matrix now(stress.rows(), static_cast<Eigen::Index>(before.size()));
    for (std::size_t e = 0; e < before.size(); ++e) now.col(static_cast<Eigen::Index>(e)) = share[e] * stress.col(before[e]);
    return now;
  };
  auto next = std::make_shared<StressHistory>();
  next->at = state.x;
  next->elastic = carried(was.elastic);
  for (const Matrix& relaxed : was.relaxed) next->relaxed.push_back(carried(relaxed));
  next->densities = densities(next->relaxed);
  state.history = std::move(next);
}

void Relaxation::add_forces(const BodyState& state, Vector& f) const {
  if (!state.history) return;
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    const Pair& p = pairs_[k];
    const Vec3 pull = state.history->densities[static_cast<Eigen::Index>(k)] * (at_node(state.x, p.b) - at_node(state.x, p.a));
    at_node(f, p.a) += pull;
    at_node(f, p.b) -= pull;
  }
}

Vec3 Relaxation::force_on(const BodyState& state, std::uint32_t node) const {
  Vec3 sum = Vec3::Zero();
  if (!state.history) return sum;
  for (std::uint32_t k = first_[node]; k < first_[node + 1]; ++k) {
    const Pair& p = pairs_[incident_[k]];
    sum += state.history->densities[incident_[k]] * (at_node(state.x, p.a == node ? p.b : p.a) - at_node(state.x, node));
  }
  return sum;
}

std::vector<Vector> Relaxation::pulls(const BodyState& state) const {
  std::vector<Vector> pulls;
  if (empty()) return pulls;
  const bool known = state.history && state.history->at.size() == state.x.size() && state.history->at == state.x;
  const Matrix now = known ? state.history->elastic : elastic(state.x);
  for (std::size_t k = 0; k < branches().size(); ++k) {
    auto of = std::make_shared<StressHistory>();
    of->densities = Vector::Zero(static_cast<Eigen::Index>(pairs_.size()));
    add_densities(state.history ? Matrix(now - state.history->relaxed[k]) : now, 1, of->densities);
    BodyState at{state.time_s, state.x, state.v, std::move(of)};
    add_forces(at, pulls.emplace_back(Vector::Zero(state.x.size())));
  }
  return pulls;
}

void Relaxation::add_tangents(const BodyState& state, double c_k, const std::vector<std::uint8_t>& held, bool clamp,
                              BlockMatrix& a) const {
  if (!state.history) return;
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    const Pair& p = pairs_[k];
    const double q = c_k * state.history->densities[static_cast<Eigen::Index>(k)];
    if (clamp && q < 0) continue;
    if (!held[p.a]) a.block(a.diagonal(p.a)).diagonal().array() += q;
    if (!held[p.b]) a.block(a.diagonal(p.b)).diagonal().array() += q;
    if (held[p.a] || held[p.b]) continue;
    a.block(p.upper).diagonal().array() -= q;
    a.block(p.lower).diagonal().array() -= q;
  }
}

void Relaxation::add_products(const StressHistory* history, const std::vector<NodeLanes>& y, double c_k,
                              std::vector<NodeLanes>& to) const {
  if (!history) return;
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    const Pair& p = pairs_[k];
    const double q = c_k * history->densities[static_cast<Eigen::Index>(k)];
    const NodeLanes &y_a = y[p.a], &y_b = y[p.b];
    NodeLanes &to_a = to[p.a], &to_b = to[p.b];
    const ColumnLanes x = q * (lanes(y_a.x) - lanes(y_b.x)), v = q * (lanes(y_a.y) - lanes(y_b.y)),
                      w = q * (lanes(y_a.z) - lanes(y_b.z));
    lanes(to_a.x) += x, lanes(to_a.y) += v, lanes(to_a.z) += w;
    lanes(to_b.x) -= x, lanes(to_b.y) -= v, lanes(to_b.z) -= w;
  }
}

double Relaxation::energy(const BodyState& state) const {
  double energy = 0;
  if (!state.history) return energy;
  for (std::size_t k = 0; k < pairs_.size(); ++k)
    energy += 0.5 * state.history->densities[static_cast<Eigen::Index>(k)] *
              (at_node(state.x, pairs_[k].b) - at_node(state.x, pairs_[k].a)).squaredNorm();
  return energy;
}

Mat3 Relaxation::relaxed_stress(const BodyState& state, std::uint32_t element) const {
  Mat3 sum = Mat3::Zero();
  if (!state.history) return sum;
  for (std::size_t k = 0; k < branches().size(); ++k)
    sum += branches()[k].share * symmetric_of(state.history->relaxed[k].col(element));
  return sum / (hexahedra_->empty() ? tetrahedra_->shape(element).volume_m3 : hexahedra_->shape(element).volume_m3);
}

}  // namespace palpate
