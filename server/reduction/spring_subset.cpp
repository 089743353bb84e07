#include "server/reduction/spring_subset.hpp"

#include <algorithm>
#include <cassert>
#include <map>

#include "server/elements/spring_kernel.hpp"
#include "server/reduction/local_body.hpp"

namespace palpate {

namespace {

Eigen::Array<double, SpringSubset::kNumbers, 1> upper(const Mat3& m) {
  Eigen::Array<double, SpringSubset::kNumbers, 1> six;
  six << m(0, 0), m(0, 1), m(0, 2), m(1, 1), m(1, 2), m(2, 2);
  return six;
}

std::vector<std::uint32_t> nodes_of_all(const LumpedBody& body, std::span<const std::uint32_t> elements) {
  std::vector<std::uint32_t> nodes;
  std::array<std::uint32_t, 2> scratch;
  for (const std::uint32_t e : elements)
    for (const std::uint32_t i : nodes_of(body, e, scratch)) nodes.push_back(i);
  return nodes;
}

}  // namespace

void BunchLinks::take_nodes(std::vector<std::uint32_t> nodes) {
  nodes_ = std::move(nodes);
  std::sort(nodes_.begin(), nodes_.end());
  nodes_.erase(std::unique(nodes_.begin(), nodes_.end()), nodes_.end());
}

std::uint32_t BunchLinks::place(std::uint32_t node) const {
  return static_cast<std::uint32_t>(std::lower_bound(nodes_.begin(), nodes_.end(), node) - nodes_.begin());
}

SpringSubset::SpringSubset(const Dynamics& dynamics, std::span<const std::uint32_t> elements) : body_(&dynamics.body()) {
  take_nodes(nodes_of_all(*body_, elements));
  for (std::uint32_t i = 0; i < nodes_.size(); ++i) links_.push_back({i, i});
  for (const std::uint32_t e : elements) {
    const Spring& spring = springs_.emplace_back(Spring{e, place(body_->elements[e].a), place(body_->elements[e].b)});
    links_.push_back({std::min(spring.a, spring.b), std::max(spring.a, spring.b)});
  }
}

std::vector<SpringSubset::Pair> SpringSubset::sums(const BodyState& state, bool clamp) const {
  std::vector<Pair> sums(links_.size(), Pair::Zero());
  const SpringKernel kernel(body_->law, body_->stiffening);
  for (std::size_t k = 0; k < springs_.size(); ++k) {
    const Element& e = body_->elements[springs_[k].element];
    const ElementState s =
        kernel.evaluate(e, at_node(state.x, e.b) - at_node(state.x, e.a), at_node(state.v, e.b) - at_node(state.v, e.a));
    Pair own;
    own << upper(SpringKernel::stiffness_symmetric(s, clamp)), upper(SpringKernel::damping(e, s));
    sums[springs_[k].a] += own;
    sums[springs_[k].b] += own;
    sums[nodes_.size() + k] -= own;
  }
  return sums;
}

SolidBunch::SolidBunch(const Dynamics& dynamics, std::span<const std::uint32_t> elements) : dynamics_(&dynamics) {
  take_nodes(nodes_of_all(dynamics.body(), elements));
  const auto hexahedra = static_cast<std::uint32_t>(dynamics.body().hexahedra.size());
  std::vector<std::uint32_t> of_tetrahedra, of_hexahedra;
  for (const std::uint32_t e : elements) {
    if (e < hexahedra)
      of_hexahedra.push_back(e);
    else
      of_tetrahedra.push_back(e - hexahedra);
  }
  if (!of_tetrahedra.empty()) tetrahedra_ = dynamics.tetrahedra().batches(of_tetrahedra);
  if (!of_hexahedra.empty()) hexahedra_ = dynamics.hexahedra().batches(of_hexahedra);
  take_links(tetrahedra_);
  take_links(hexahedra_);
}

template <typename Batch>
void SolidBunch::take_links(const std::vector<Batch>& batches) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> known;
  for (const Batch& batch : batches)
    for (std::size_t lane = 0; lane < batch.group.count; ++lane)
      for (std::size_t i = 0; i < batch.group.nodes.size(); ++i)
        for (std::size_t j = 0; j <= i; ++j) {
          const std::uint32_t row = place(batch.group.nodes[i][lane]), column = place(batch.group.nodes[j][lane]);
          const auto [link, fresh] = known.try_emplace(std::minmax(row, column), static_cast<std::uint32_t>(links_.size()));
          if (fresh) links_.push_back({std::min(row, column), std::max(row, column)});
          targets_.push_back(2 * link->second + (row > column ? 1 : 0));  // at pair_index(i, j)
        }
}

SolidBunch::Pair SolidBunch::transposed(const Pair& pair) {
  Pair other;
  for (int half = 0; half < 2 * kNumbers; half += kNumbers)
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) other[half + 3 * r + c] = pair[half + 3 * c + r];
  return other;
}

template <typename Elements>
void SolidBunch::add_sums(const Elements& elements, const std::vector<typename Elements::Batch>& batches, const Vector& x,
                          bool clamp, std::vector<Pair>& sums) const {
  typename Elements::Blocks k, d;
  auto target = targets_.begin();
  for (const auto& batch : batches) {
    elements.blocks(batch, x, 0, 1, clamp, k);
    elements.blocks(batch, x, 1, 0, clamp, d);
    for (std::size_t lane = 0; lane < batch.group.count; ++lane)
      for (std::size_t p = 0; p < k.at.size(); ++p, ++target) {
        Pair& to = sums[*target / 2];
        const bool turned = *target % 2 != 0;
        for (std::size_t n = 0; n < kNumbers; ++n) {
          const std::size_t at = turned ? 3 * (n % 3) + n / 3 : n;
          to[static_cast<Eigen::Index>(n)] += k.at[p][at].of[lane];
          to[static_cast<Eigen::Index>(n + kNumbers)] += d.at[p][at].of[lane];
        }
      }
  }
}

std::vector<SolidBunch::Pair> SolidBunch::sums(const BodyState& state, bool clamp) const {
  std::vector<Pair> sums(links_.size(), Pair::Zero());
  add_sums(dynamics_->tetrahedra(), tetrahedra_, state.x, clamp, sums);
  add_sums(dynamics_->hexahedra(), hexahedra_, state.x, clamp, sums);
  return sums;
}

const NodeArrays& SolidBunch::Forces::at(const BodyState& state) {
  Vector f = Vector::Zero(state.x.size());
  dynamics_->tetrahedra().add_forces(state.x, state.v, f);
  dynamics_->hexahedra().add_forces(state.x, state.v, f);
  dynamics_->relaxation().add_forces(state, f);
  for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i) f_.set(i, at_node(f, i));
  return f_;
}

}  // namespace palpate
