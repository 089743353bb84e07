#include "common/mechanics/laws.hpp"

#include <Eigen/Eigenvalues>
#include <cassert>
#include <utility>

namespace palpate {
namespace {

/// Returns the law of this kind.
template <std::size_t... I>
ElasticLaw law_of(const LawParameters& of, std::index_sequence<I...>) {
  ElasticLaw law{NeoHookean(of)};
  const bool found = ((std::variant_alternative_t<I, ElasticLaw>::kKind == of.kind ? (law.emplace<I>(of), true) : false) || ...);
  assert(found);
  (void)found;
  return law;
}

}  // namespace

Elasticity::Elasticity(const LawParameters& of)
    : law_(law_of(of, std::make_index_sequence<std::variant_size_v<ElasticLaw>>{})), kind_(of.kind) {
  if (of.fibres.share > 0) fibres_.emplace(of.fibres);
  single_precision_ =
      !fibres_ && std::visit([](const auto& law) { return std::remove_cvref_t<decltype(law)>::kSinglePrecision; }, law_);
}

void limited_pair_sums(const double (&s)[9], double (&w)[9]) {
  using Matrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  const Eigen::Map<const Matrix> of_s(s);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(0.5 * (of_s + of_s.transpose()));
  const Eigen::Vector3d pairs = (of_s.trace() - eigen.eigenvalues().array()).max(kLeastPairSum);
  Eigen::Map<Matrix>(static_cast<double*>(w)) =
      eigen.eigenvectors() * pairs.cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose();
}

}  // namespace palpate
