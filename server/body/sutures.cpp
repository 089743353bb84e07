#include "server/body/sutures.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

Vec3 point_of(const NodeWeights& bite, const Vector& x) {
  Vec3 point = Vec3::Zero();
  for (const auto& [node, weight] : bite) point += weight * at_node(x, node);
  return point;
}

/// Returns the number of the first span beyond the last that has two ends.
std::size_t end_of(const SutureLaw& law, const SutureShape& shape) {
  return static_cast<std::size_t>(law.bites) + (shape.held ? 1 : 0);
}

}  // namespace

std::shared_ptr<const SutureState> Sutures::begun() const {
  if (empty()) return nullptr;
  SutureState state;
  for (const Suture& suture : body_->sutures) state.threads.push_back({suture.length_m, std::nullopt});
  return std::make_shared<const SutureState>(std::move(state));
}

SuturePlace Sutures::place_of(const BodyState& state, std::size_t which) const {
  SuturePlace place;
  place.points.fill(Vec3::Zero());
  const std::vector<NodeWeights>& bites = body_->sutures[which].bites;
  for (std::size_t j = 0; j < bites.size(); ++j) place.points[j] = point_of(bites[j], state.x);
  const std::optional<Vec3>& hand = state.sutures->threads[which].hand;
  place.held = hand.has_value();
  if (hand) place.points[bites.size()] = *hand;
  return place;
}

SuturePull Sutures::pull_of(const BodyState& state, std::size_t which, const SutureShape& shape) const {
  return palpate::pull_of(body_->sutures[which].law, state.sutures->threads[which].length_m, shape);
}

Vec3 Sutures::pull_to_hand(const BodyState& state, std::size_t which) const {
  const SutureLaw& law = body_->sutures[which].law;
  const SutureShape shape = shape_of(law, place_of(state, which));
  if (!shape.held) return Vec3::Zero();
  const auto last = static_cast<std::size_t>(law.bites);
  return pull_of(state, which, shape).tension_n[last] * shape.along[last];
}

void Sutures::add_forces(const BodyState& state, std::size_t which, Vector& f) const {
  const Suture& suture = body_->sutures[which];
  const SutureShape shape = shape_of(suture.law, place_of(state, which));
  const SuturePull pull = pull_of(state, which, shape);
  for (std::size_t i = 1; i < end_of(suture.law, shape); ++i) {
    const Vec3 force = pull.tension_n[i] * shape.along[i];
    if (pull.tension_n[i] == 0) continue;
    for (const auto& [node, weight] : suture.bites[i - 1]) at_node(f, node) += weight * force;
    if (i == suture.bites.size()) continue;
    for (const auto& [node, weight] : suture.bites[i]) at_node(f, node) -= weight * force;
  }
}

void Sutures::add_forces(const BodyState& state, Vector& f) const {
  for (std::size_t which = 0; which < body_->sutures.size(); ++which) add_forces(state, which, f);
}

Vec3 Sutures::force_on(const BodyState& state, std::uint32_t node) const {
  if (empty()) return Vec3::Zero();
  Vector f = Vector::Zero(state.x.size());
  add_forces(state, f);
  return at_node(f, node);
}

std::vector<Sutures::Block> Sutures::tangents(const BodyState& state) const {
  std::vector<Block> blocks;
  for (std::size_t which = 0; which < body_->sutures.size(); ++which) add_tangents(state, which, blocks);
  return blocks;
}

void Sutures::add_tangents(const BodyState& state, std::size_t which, std::vector<Block>& blocks) const {
  const Suture& suture = body_->sutures[which];
  const SutureShape shape = shape_of(suture.law, place_of(state, which));
  const SuturePull pull = pull_of(state, which, shape);
  const std::size_t end = end_of(suture.law, shape);
  // Adds scale (w_(i-1)a - w_ia) u to y.
  const auto add = [&](std::size_t i, double scale, const Vec3& u, Block& block) {
    for (const auto& [node, weight] : suture.bites[i - 1]) block.y.emplace_back(node, scale * weight * u);
    if (i == suture.bites.size()) return;
    for (const auto& [node, weight] : suture.bites[i]) block.y.emplace_back(node, -scale * weight * u);
  };
  for (std::size_t first = 1; first < end;) {
    std::size_t next = first + 1;
    while (next < end && pull.group[next] == pull.group[first]) ++next;
    if (pull.group_n_m[first] > 0) {
      Block& block = blocks.emplace_back(Block{{}, pull.group_n_m[first]});
      for (std::size_t i = first; i < next; ++i) add(i, std::sqrt(pull.share[i]), shape.along[i], block);
    }
    first = next;
  }
  for (std::size_t i = 1; i < end; ++i) {
    if (!(pull.tension_n[i] > 0)) continue;
    const Vec3& u = shape.along[i];
    const Vec3 across = u.unitOrthogonal(), beside = u.cross(across);
    for (const Vec3& v : {across, beside}) add(i, 1, v, blocks.emplace_back(Block{{}, pull.tension_n[i] / shape.distance_m[i]}));
  }
  for (Block& block : blocks) {  // each node once
    std::ranges::sort(block.y, {}, [](const auto& at) { return at.first; });
    std::size_t kept = 0;
    for (std::size_t i = 0; i < block.y.size(); ++i) {
      if (kept > 0 && block.y[kept - 1].first == block.y[i].first)
        block.y[kept - 1].second += block.y[i].second;
      else
        block.y[kept++] = block.y[i];
    }
    block.y.resize(kept);
  }
}

double Sutures::energy(const BodyState& state) const {
  double energy_j = 0;
  for (std::size_t which = 0; which < body_->sutures.size(); ++which) {
    const SutureLaw& law = body_->sutures[which].law;
    const SuturePull pull = pull_of(state, which, shape_of(law, place_of(state, which)));
    for (const double tension_n : pull.tension_n) energy_j += 0.5 * tension_n * tension_n / law.stiffness_n_m;
  }
  return energy_j;
}

void Sutures::follow(BodyState& state) const {
  if (empty()) return;
  SutureState next = *state.sutures;
  for (std::size_t which = 0; which < next.threads.size(); ++which)
    next.threads[which].length_m = pull_of(state, which, shape_of(body_->sutures[which].law, place_of(state, which))).length_m;
  state.sutures = std::make_shared<const SutureState>(std::move(next));
}

void Sutures::hold(BodyState& state, std::size_t which, const std::optional<Vec3>& hand) const {
  if (!hand && !state.sutures->threads[which].hand) return;
  SutureState next = *state.sutures;
  SutureState::Thread& thread = next.threads[which];
  const NodeWeights& last = body_->sutures[which].bites.back();
  if (hand && !thread.hand) {
    double& tail_m = thread.length_m[body_->sutures[which].bites.size()];
    tail_m = std::max(tail_m, (*hand - point_of(last, state.x)).norm());
  }
  thread.hand = hand;
  state.sutures = std::make_shared<const SutureState>(std::move(next));
}

}  // namespace palpate
