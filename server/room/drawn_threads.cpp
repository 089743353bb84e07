#include "server/room/drawn_threads.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace palpate {
namespace {

constexpr std::uint32_t kSides = 4;

Vec3 at_rest(const LumpedBody& body, const NodeWeights& bite) {
  Vec3 x = Vec3::Zero();
  for (const auto& [node, weight] : bite) x += weight * body.nodes[node];
  return x;
}

}  // namespace

DrawnThreads::DrawnThreads(const LumpedBody& body) : body_(&body) {
  for (const Suture& suture : body.sutures) {
    const std::vector<NodeWeights>& bites = suture.bites;
    const Vec3 from = at_rest(body, bites.front()), to = at_rest(body, bites.back());
    Thread thread{ThreadChain(from, Vec3::UnitZ(), suture.length_m.front()),
                  ThreadChain(to, Vec3::UnitX(), suture.length_m[bites.size()]),
                  {}};
    for (std::size_t j = 1; j + 1 < bites.size(); ++j) thread.between.push_back(at_rest(body, bites[j]));
    threads_.push_back(std::move(thread));
  }
}

void DrawnThreads::advance(const Dynamics& dynamics, const BodyState& state) {
  const double over_s = state.time_s - std::exchange(time_s_, state.time_s);
  for (std::size_t k = 0; k < threads_.size(); ++k) {
    const SuturePlace place = dynamics.sutures().place_of(state, k);
    const auto n = body_->sutures[k].bites.size();
    const OfSpans& lengths = state.sutures->threads[k].length_m;
    Thread& thread = threads_[k];
    thread.first.advance(over_s, place.points[0], std::nullopt, lengths[0], body_->gravity_m_s2);
    thread.tail.advance(over_s, place.points[n - 1], state.sutures->threads[k].hand, lengths[n], body_->gravity_m_s2);
    for (std::size_t j = 1; j + 1 < n; ++j) thread.between[j - 1] = place.points[j];
  }
}

std::size_t DrawnThreads::vertices() const {
  std::size_t sum = 0;
  for (const Thread& thread : threads_) sum += kSides * thread.points();
  return sum;
}

void DrawnThreads::append(std::vector<Vec3>& positions) const {
  for (std::size_t k = 0; k < threads_.size(); ++k) {
    const Thread& thread = threads_[k];
    std::vector<Vec3> line(thread.first.points().rbegin(), thread.first.points().rend());
    line.insert(line.end(), thread.between.begin(), thread.between.end());
    line.insert(line.end(), thread.tail.points().begin(), thread.tail.points().end());
    Vec3 across = Vec3::UnitX();  // carried along the line, so that the tube does not twist
    for (std::size_t i = 0; i < line.size(); ++i) {
      Vec3 along = line[std::min(i + 1, line.size() - 1)] - line[i > 0 ? i - 1 : 0];
      if (!(along.norm() > 1e-9)) along = Vec3::UnitZ();
      along.normalize();
      across -= across.dot(along) * along;
      if (!(across.norm() > 1e-3)) across = along.unitOrthogonal();
      across.normalize();
      const Vec3 beside = along.cross(across);
      const double r = body_->sutures[k].radius_m;
      for (const Vec3& side : {across, beside, Vec3(-across), Vec3(-beside)}) positions.push_back(line[i] + r * side);
    }
  }
}

std::vector<Triangle> DrawnThreads::triangles(std::uint32_t first) const {
  std::vector<Triangle> all;
  for (const Thread& thread : threads_) {
    const auto points = static_cast<std::uint32_t>(thread.points());
    for (std::uint32_t i = 0; i + 1 < points; ++i)
      for (std::uint32_t s = 0; s < kSides; ++s) {
        const std::uint32_t a = first + kSides * i + s, b = first + kSides * i + (s + 1) % kSides;
        all.push_back({a, b, b + kSides});
        all.push_back({a, b + kSides, a + kSides});
      }
    const std::uint32_t end = first + kSides * (points - 1);
    all.push_back({first, first + 2, first + 1});
    all.push_back({first, first + 3, first + 2});
    all.push_back({end, end + 1, end + 2});
    all.push_back({end, end + 2, end + 3});
    first += kSides * points;
  }
  return all;
}

}  // namespace palpate
