#include "server/body/sutures.hpp"

#include <algorithm>
#include <cmath>

#include "server/body/needle_tissue.hpp"
#include "server/scene/sutures.hpp"

namespace palpate {
namespace {

Vec3 point_of(const NodeWeights& bite, const Vector& x) {
  Vec3 point = Vec3::Zero();
  for (const auto& [node, weight] : bite) point += weight * at_node(x, node);
  return point;
}

/// A thread in a step: bites that bear too much have moved on from their material points, where it pulls all the same.
struct Strung {
  SutureTear tear;
  SutureShape shape;
  SuturePull pull;

  Strung(const SutureState::Thread& thread, SuturePlace place) : tear(tear_of(thread.law, thread.length_m, place)) {
    for (std::size_t j = 0; j < thread.bites->size(); ++j) place.points[j] += tear.way[j];
    shape = shape_of(thread.law, place);
    pull = palpate::pull_of(thread.law, tear.spans_m, shape);
  }
  /// Returns true if a span has an end that moves on, so that its tension does not grow.
  bool yields(std::size_t span) const {
    const auto moves = [&](std::size_t bite) { return bite < kMaxBites && !tear.way[bite].isZero(0); };
    return moves(span - 1) || moves(span);
  }
};

std::size_t threads_of(const BodyState& state) { return state.sutures ? state.sutures->threads.size() : 0; }

/// Takes bite j out of a thread: its two spans become one.
void take_out(std::size_t j, SutureState::Thread& thread) {
  std::vector<SutureBite> bites = *thread.bites;
  const std::size_t n = bites.size();
  bites.erase(bites.begin() + static_cast<std::ptrdiff_t>(j));
  if (j == 0) thread.law.first_tied = false;
  if (j + 1 == n) thread.law.last_tied = false;
  thread.length_m[j] += thread.length_m[j + 1];
  for (std::size_t i = j + 1; i < n; ++i) thread.length_m[i] = thread.length_m[i + 1];
  thread.length_m[n] = 0;
  --thread.law.bites;
  thread.bites = std::make_shared<const std::vector<SutureBite>>(std::move(bites));
}

/// Returns the bite next to one end of a stretch of a path, at least a diameter of the thread below the surface; none if no cell
/// has one.
std::optional<SutureBite> bite_near(const LumpedBody& body, const NeedlePath& path, double end_m, double middle_m,
                                    double diameter_m) {
  const double way_m = middle_m - end_m, step_m = std::copysign(diameter_m, way_m);
  for (double far_m = step_m; std::abs(far_m) < std::abs(way_m); far_m += step_m)
    if (std::optional<SutureBite> bite = bite_at(body, path.rest_at(end_m + far_m)); bite && can_move(body, *bite)) return bite;
  return std::nullopt;
}

/// Returns the number of bites that were torn out.
std::uint32_t move_bites(const LumpedBody& body, const Vector& x, const SutureTear& tear, SutureState::Thread& thread) {
  std::uint32_t out = 0;
  for (std::size_t j = thread.bites->size(); j-- > 0;) {
    if (tear.way[j].isZero(0)) continue;
    if (std::optional<SutureBite> next =
            moved(body, {x.data(), static_cast<std::size_t>(x.size())}, (*thread.bites)[j], tear.way[j])) {
      std::vector<SutureBite> bites = *thread.bites;
      bites[j] = std::move(*next);
      thread.bites = std::make_shared<const std::vector<SutureBite>>(std::move(bites));
    } else {
      take_out(j, thread);
      ++out;
    }
  }
  return out;
}

/// Returns the parts of a thread that is cut at a share of a span: that with its first bite, and that with its last.
std::pair<SutureState::Thread, SutureState::Thread> parted(const SutureState::Thread& thread, std::size_t span, double share) {
  SutureState::Thread low = thread, high = thread;
  const auto at = thread.bites->begin() + static_cast<std::ptrdiff_t>(span);
  low.bites = std::make_shared<const std::vector<SutureBite>>(thread.bites->begin(), at);
  high.bites = std::make_shared<const std::vector<SutureBite>>(at, thread.bites->end());
  low.law.bites = static_cast<int>(low.bites->size());
  high.law.bites = static_cast<int>(high.bites->size());
  low.has_end = false;
  low.hand.reset();
  low.law.last_tied = high.law.first_tied = false;
  low.length_m.fill(0);
  high.length_m.fill(0);
  for (std::size_t i = 0; i < span; ++i) low.length_m[i] = thread.length_m[i];
  low.length_m[span] = share * thread.length_m[span];
  high.length_m[0] = (1 - share) * thread.length_m[span];
  for (std::size_t i = span + 1; i <= thread.bites->size(); ++i) high.length_m[i - span] = thread.length_m[i];
  return {std::move(low), std::move(high)};
}

/// Returns the number of the first span beyond the last that has two ends.
std::size_t spans_end(const SutureLaw& law, const SutureShape& shape) {
  return static_cast<std::size_t>(law.bites) + (shape.held ? 1 : 0);
}

}  // namespace

std::shared_ptr<const NodeWeights> last_bite(const BodyState& state, std::size_t which) {
  const std::shared_ptr<const std::vector<SutureBite>>& bites = state.sutures->threads[which].bites;
  return bites->empty() ? nullptr : std::shared_ptr<const NodeWeights>(bites, &bites->back().at);
}

std::shared_ptr<const SutureState> Sutures::begun() const {
  if (empty()) return nullptr;
  SutureState state;
  for (std::uint32_t k = 0; k < body_->sutures.size(); ++k) {
    const Suture& suture = body_->sutures[k];
    state.threads.push_back(
        {k, true, suture.law, std::make_shared<const std::vector<SutureBite>>(suture.bites), suture.length_m, std::nullopt});
  }
  return std::make_shared<const SutureState>(std::move(state));
}

SuturePlace Sutures::place_of(const BodyState& state, std::size_t which) const {
  SuturePlace place;
  place.points.fill(Vec3::Zero());
  const std::vector<SutureBite>& bites = *state.sutures->threads[which].bites;
  for (std::size_t j = 0; j < bites.size(); ++j) place.points[j] = point_of(bites[j].at, state.x);
  const std::optional<Vec3>& hand = state.sutures->threads[which].hand;
  place.held = hand.has_value();
  if (hand) place.points[bites.size()] = *hand;
  return place;
}

SuturePull Sutures::pull_of(const BodyState& state, std::size_t which, const SutureShape& shape) const {
  return palpate::pull_of(state.sutures->threads[which].law, state.sutures->threads[which].length_m, shape);
}

Vec3 Sutures::pull_to_hand(const BodyState& state, std::size_t which) const {
  const SutureState::Thread& thread = state.sutures->threads[which];
  const auto last = static_cast<std::size_t>(thread.law.bites);
  if (!thread.hand || last == 0) return Vec3::Zero();
  const Strung now(thread, place_of(state, which));
  return now.pull.tension_n[last] * now.shape.along[last];
}

void Sutures::add_forces(const BodyState& state, std::size_t which, Vector& f) const {
  const SutureState::Thread& thread = state.sutures->threads[which];
  const std::vector<SutureBite>& bites = *thread.bites;
  const Strung now(thread, place_of(state, which));
  const SutureShape& shape = now.shape;
  const SuturePull& pull = now.pull;
  for (std::size_t i = 1; i < spans_end(thread.law, shape); ++i) {
    const Vec3 force = pull.tension_n[i] * shape.along[i];
    if (pull.tension_n[i] == 0) continue;
    for (const auto& [node, weight] : bites[i - 1].at) at_node(f, node) += weight * force;
    if (i == bites.size()) continue;
    for (const auto& [node, weight] : bites[i].at) at_node(f, node) -= weight * force;
  }
}

void Sutures::add_forces(const BodyState& state, Vector& f) const {
  for (std::size_t which = 0; which < threads_of(state); ++which) add_forces(state, which, f);
}

Vec3 Sutures::force_on(const BodyState& state, std::uint32_t node) const {
  if (empty()) return Vec3::Zero();
  Vector f = Vector::Zero(state.x.size());
  add_forces(state, f);
  return at_node(f, node);
}

std::vector<Sutures::Block> Sutures::tangents(const BodyState& state) const {
  std::vector<Block> blocks;
  for (std::size_t which = 0; which < threads_of(state); ++which) add_tangents(state, which, blocks);
  return blocks;
}

void Sutures::add_tangents(const BodyState& state, std::size_t which, std::vector<Block>& blocks) const {
  const SutureState::Thread& thread = state.sutures->threads[which];
  const std::vector<SutureBite>& bites = *thread.bites;
  const Strung now(thread, place_of(state, which));
  const SutureShape& shape = now.shape;
  const SuturePull& pull = now.pull;
  const std::size_t end = spans_end(thread.law, shape);
  // Adds scale (w_(i-1)a - w_ia) u to y.
  const auto add = [&](std::size_t i, double scale, const Vec3& u, Block& block) {
    for (const auto& [node, weight] : bites[i - 1].at) block.y.emplace_back(node, scale * weight * u);
    if (i == bites.size()) return;
    for (const auto& [node, weight] : bites[i].at) block.y.emplace_back(node, -scale * weight * u);
  };
  for (std::size_t first = 1; first < end;) {
    std::size_t next = first + 1;
    bool yields = now.yields(first);
    for (; next < end && pull.group[next] == pull.group[first]; ++next) yields |= now.yields(next);
    if (pull.group_n_m[first] > 0 && !yields) {
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
  for (std::size_t which = 0; which < threads_of(state); ++which) {
    const SutureLaw& law = state.sutures->threads[which].law;
    const SuturePull pull = pull_of(state, which, shape_of(law, place_of(state, which)));
    for (const double tension_n : pull.tension_n) energy_j += 0.5 * tension_n * tension_n / law.stiffness_n_m;
  }
  return energy_j;
}

void Sutures::follow(BodyState& state) const {
  if (empty()) return;
  SutureState next = *state.sutures;
  for (std::size_t which = 0; which < next.threads.size(); ++which) {
    SutureState::Thread& thread = next.threads[which];
    SuturePlace place = place_of(state, which);
    const SutureTear tear = tear_of(thread.law, thread.length_m, place);
    thread.length_m = tear.spans_m;
    if (tear.length_m > 0) {
      next.torn_m += tear.length_m;
      next.torn_out += move_bites(*body_, state.x, tear, thread);
      for (std::size_t j = 0; j < thread.bites->size(); ++j) place.points[j] = point_of((*thread.bites)[j].at, state.x);
      if (thread.hand) place.points[thread.bites->size()] = *thread.hand;
    }
    thread.length_m = palpate::pull_of(thread.law, thread.length_m, shape_of(thread.law, place)).length_m;
  }
  state.sutures = std::make_shared<const SutureState>(std::move(next));
}

void Sutures::hold(BodyState& state, std::size_t which, const std::optional<Vec3>& hand) const {
  if (!hand && !state.sutures->threads[which].hand) return;
  SutureState next = *state.sutures;
  SutureState::Thread& thread = next.threads[which];
  if (hand && !thread.hand && thread.law.bites > 0) {
    double& tail_m = thread.length_m[thread.bites->size()];
    tail_m = std::max(tail_m, (*hand - point_of(thread.bites->back().at, state.x)).norm());
  }
  thread.hand = hand;
  state.sutures = std::make_shared<const SutureState>(std::move(next));
}

std::optional<std::uint32_t> Sutures::end_of(const BodyState& state, std::uint32_t suture) const {
  const std::vector<SutureState::Thread>& threads = state.sutures->threads;
  for (std::uint32_t which = 0; which < threads.size(); ++which) {
    const SutureState::Thread& thread = threads[which];
    if (thread.suture == suture && thread.has_end && thread.law.bites > 0 && !thread.law.last_tied) return which;
  }
  return std::nullopt;
}

std::optional<std::uint32_t> Sutures::on_needle(const BodyState& state, std::span<const std::uint32_t> sutures) const {
  const std::vector<SutureState::Thread>& threads = state.sutures->threads;
  for (const std::uint32_t suture : sutures)
    for (std::uint32_t which = 0; which < threads.size(); ++which) {
      const SutureState::Thread& thread = threads[which];
      if (thread.suture == suture && thread.has_end && !(thread.law.last_tied && thread.law.bites > 0)) return which;
    }
  return std::nullopt;
}

bool Sutures::draw_through(BodyState& state, std::size_t which, const NeedlePath& path, double depth_m) const {
  constexpr double kShortestTailM = 0.01;
  const std::vector<NeedlePath::Stretch> passed = path.passed(depth_m);
  if (passed.empty()) return false;
  SutureState next = *state.sutures;
  SutureState::Thread& thread = next.threads[which];
  const Suture& suture = body_->sutures[thread.suture];
  std::uint32_t number = 0;  // beyond those of all its parts
  for (const SutureState::Thread& part : next.threads)
    if (part.suture == thread.suture && !part.bites->empty()) number = std::max(number, part.bites->back().number + 1);
  std::vector<SutureBite> bites = *thread.bites;
  const std::size_t before = bites.size();
  for (const auto& [begins_m, ends_m] : passed)
    for (const double end_m : {begins_m, ends_m}) {
      std::optional<SutureBite> bite = bite_near(*body_, path, end_m, 0.5 * (begins_m + ends_m), 2 * suture.radius_m);
      if (!bite || number >= suture.most_bites()) return false;
      bite->number = number++;
      bites.push_back(std::move(*bite));
    }
  OfSpans& length_m = thread.length_m;
  double tail_m = length_m[before];
  if (before == 0) {
    tail_m -= length_m[0] = suture.first_tail_m;
    thread.law.first_tied = suture.law.first_tied;
  }
  for (std::size_t i = std::max<std::size_t>(before, 1); i < bites.size(); ++i) {
    length_m[i] = (point_of(bites[i].at, state.x) - point_of(bites[i - 1].at, state.x)).norm() + suture.slack_m;
    tail_m -= length_m[i];
  }
  if (tail_m < kShortestTailM) return false;
  length_m[bites.size()] = tail_m;
  thread.law.bites = static_cast<int>(bites.size());
  thread.bites = std::make_shared<const std::vector<SutureBite>>(std::move(bites));
  state.sutures = std::make_shared<const SutureState>(std::move(next));
  return true;
}

void Sutures::tie(BodyState& state, std::size_t which) const {
  SutureState next = *state.sutures;
  next.threads[which].law.last_tied = true;
  next.threads[which].hand.reset();
  state.sutures = std::make_shared<const SutureState>(std::move(next));
}

bool Sutures::cut(BodyState& state, const Vec3& at, double reach_m) const {
  struct Place {
    std::size_t which = 0, span = 0;
    double share = 0;
  };
  std::optional<Place> nearest;
  for (std::size_t which = 0; which < threads_of(state); ++which) {
    const SuturePlace place = place_of(state, which);
    const std::size_t n = state.sutures->threads[which].bites->size();
    for (std::size_t i = 1; n > 0 && i < n + (place.held ? 1 : 0); ++i) {
      const Vec3 from = place.points[i - 1], way = place.points[i] - from;
      const double share = way.isZero(0) ? 0 : std::clamp(way.dot(at - from) / way.squaredNorm(), 0.0, 1.0);
      const double far_m = (from + share * way - at).norm();
      if (far_m > reach_m) continue;
      reach_m = far_m;
      nearest = {which, i, share};
    }
  }
  if (!nearest) return false;
  SutureState next = *state.sutures;
  auto [low, high] = parted(next.threads[nearest->which], nearest->span, nearest->share);
  // A hand keeps the number of its thread.
  next.threads[nearest->which] = std::move(high);
  next.threads.push_back(std::move(low));
  state.sutures = std::make_shared<const SutureState>(std::move(next));
  return true;
}

}  // namespace palpate
