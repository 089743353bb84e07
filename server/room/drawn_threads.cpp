#include "server/room/drawn_threads.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace palpate {
namespace {

constexpr std::uint32_t kSides = 4;

/// The bites that a suture of the scene has now, in places of those that it began with.
struct DrawnBites {
  std::vector<const SutureState::Thread*> thread;  ///< whose each is
  std::vector<Vec3> at;
};

/// Returns no places if the suture has no bites left.
DrawnBites drawn_bites(const Sutures& sutures, const BodyState& state, std::uint32_t suture, std::size_t begun) {
  DrawnBites bites{std::vector<const SutureState::Thread*>(begun, nullptr), std::vector<Vec3>(begun, Vec3::Zero())};
  const std::vector<SutureState::Thread>& threads = state.sutures->threads;
  for (std::size_t which = 0; which < threads.size(); ++which) {
    if (threads[which].suture != suture) continue;
    const SuturePlace place = sutures.place_of(state, which);
    for (std::size_t j = 0; j < threads[which].bites->size(); ++j) {
      const std::uint32_t number = (*threads[which].bites)[j].number;
      bites.thread[number] = &threads[which];
      bites.at[number] = place.points[j];
    }
  }
  const auto there = std::ranges::find_if(bites.thread, [](const auto* thread) { return thread != nullptr; });
  if (there == bites.thread.end()) return {};
  std::size_t before = static_cast<std::size_t>(there - bites.thread.begin());
  for (std::size_t j = 0; j < begun; ++j) {
    if (bites.thread[j]) before = j;
    bites.thread[j] = bites.thread[before];
    bites.at[j] = bites.at[before];
  }
  return bites;
}

/// The surface of a body at rest, without the walls of cuts.
class OuterSurface {
 public:
  explicit OuterSurface(const LumpedBody& body) : x_(vertices_at_rest(body)) {
    std::vector<Triangle> outer;
    const auto is_wall = [&](std::uint32_t v) { return !body.is_node(v) && body.embedded[v - body.nodes.size()].is_wall; };
    for (const Triangle& t : body.triangles)
      if (std::ranges::none_of(t, is_wall)) outer.push_back(t);
    surface_ = Surface(std::move(outer), x_.size());
  }
  /// Returns the way from a point in the body to where a thread of this radius lies on the surface.
  Vec3 above(const Vec3& point, double radius_m) const {
    if (surface_.empty()) return Vec3::Zero();
    const NearestPoint nearest = nearest_point(surface_.view(), {x_.front().data(), 3 * x_.size()}, point);
    return nearest.position + radius_m * nearest.normal - point;
  }

 private:
  std::vector<Vec3> x_;
  Surface surface_;
};

}  // namespace

DrawnThreads::DrawnThreads(const LumpedBody& body) : body_(&body) {
  constexpr int kStubSegments = 2;  // to the surface, and to the middle
  if (body.sutures.empty()) return;
  const OuterSurface surface(body);
  for (const Suture& suture : body.sutures) {
    const std::vector<SutureBite>& bites = suture.bites;
    Thread thread{ThreadChain(bites.front().rest, Vec3::UnitZ(), suture.length_m.front()),
                  ThreadChain(bites.back().rest, Vec3::UnitX(), suture.length_m[bites.size()]),
                  {}};
    for (std::size_t j = 1; j < bites.size(); ++j) {
      const Vec3 middle = 0.5 * (bites[j - 1].rest + bites[j].rest);
      thread.spans.push_back({ThreadChain(bites[j - 1].rest, middle, kStubSegments),
                              ThreadChain(bites[j].rest, middle, kStubSegments),
                              surface.above(bites[j - 1].rest, suture.radius_m), surface.above(middle, suture.radius_m),
                              surface.above(bites[j].rest, suture.radius_m)});
    }
    threads_.push_back(std::move(thread));
  }
}

void DrawnThreads::advance(const Dynamics& dynamics, const BodyState& state) {
  const double over_s = state.time_s - std::exchange(time_s_, state.time_s);
  const Vec3& gravity = body_->gravity_m_s2;
  for (std::uint32_t k = 0; k < threads_.size(); ++k) {
    const DrawnBites bites = drawn_bites(dynamics.sutures(), state, k, body_->sutures[k].bites.size());
    if (bites.at.empty()) continue;  // it lies where it came out
    Thread& thread = threads_[k];
    const SutureState::Thread &first = *bites.thread.front(), &last = *bites.thread.back();
    thread.first.advance(over_s, bites.at.front(), std::nullopt, first.length_m[0], gravity);
    thread.tail.advance(over_s, bites.at.back(), last.hand, last.length_m[last.bites->size()], gravity);
    for (std::size_t i = 0; i < thread.spans.size(); ++i) {
      Span& span = thread.spans[i];
      const SutureState::Thread &low = *bites.thread[i], &high = *bites.thread[i + 1];
      span.cut = &low != &high;
      if (span.cut) {
        span.low.advance(over_s, bites.at[i], std::nullopt, low.length_m[low.bites->size()], gravity);
        span.high.advance(over_s, bites.at[i + 1], std::nullopt, high.length_m[0], gravity);
      } else {
        const Vec3 &from = bites.at[i], &to = bites.at[i + 1], middle = 0.5 * (from + to) + span.over_middle;
        span.low.lay(std::array{from, Vec3(from + span.over_low), middle});
        span.high.lay(std::array{to, Vec3(to + span.over_high), middle});
      }
    }
  }
}

std::size_t DrawnThreads::Thread::points() const {
  std::size_t sum = first.points().size() + tail.points().size();
  for (const Span& span : spans) sum += span.low.points().size() + span.high.points().size() - 2;
  return sum;
}

std::vector<Vec3> DrawnThreads::Thread::line(std::vector<std::size_t>& ends) const {
  std::vector<Vec3> line(first.points().rbegin(), first.points().rend());
  for (const Span& span : spans) {
    if (&span != &spans.front()) line.push_back(span.low.points().front());
    line.insert(line.end(), span.low.points().begin() + 1, span.low.points().end());
    ends.push_back(line.size() - 1);
    line.insert(line.end(), span.high.points().rbegin(), span.high.points().rend() - 1);
  }
  line.insert(line.end(), tail.points().begin(), tail.points().end());
  ends.push_back(line.size() - 1);
  return line;
}

std::size_t DrawnThreads::vertices() const {
  std::size_t sum = 0;
  for (const Thread& thread : threads_) sum += kSides * thread.points();
  return sum;
}

void DrawnThreads::append(std::vector<Vec3>& positions) const {
  for (std::size_t k = 0; k < threads_.size(); ++k) {
    std::vector<std::size_t> ends;
    const std::vector<Vec3> line = threads_[k].line(ends);
    Vec3 across = Vec3::UnitX();  // carried along the line, so that the tube does not twist
    std::size_t begin = 0;
    for (const std::size_t end : ends) {
      for (std::size_t i = begin; i <= end; ++i) {
        Vec3 along = line[std::min(i + 1, end)] - line[i > begin ? i - 1 : begin];
        if (!(along.norm() > 1e-9)) along = Vec3::UnitZ();
        along.normalize();
        across -= across.dot(along) * along;
        if (!(across.norm() > 1e-3)) across = along.unitOrthogonal();
        across.normalize();
        const Vec3 beside = along.cross(across);
        const double r = body_->sutures[k].radius_m;
        for (const Vec3& side : {across, beside, Vec3(-across), Vec3(-beside)}) positions.push_back(line[i] + r * side);
      }
      begin = end + 1;
    }
  }
}

std::vector<Triangle> DrawnThreads::triangles(std::uint32_t first) const {
  std::vector<Triangle> all;
  for (const Thread& thread : threads_) {
    std::vector<std::size_t> ends;
    thread.line(ends);
    std::size_t begin = 0;
    for (const std::size_t end : ends) {
      for (std::size_t i = begin; i < end; ++i)
        for (std::uint32_t s = 0; s < kSides; ++s) {
          const std::uint32_t ring = first + kSides * static_cast<std::uint32_t>(i), a = ring + s, b = ring + (s + 1) % kSides;
          all.push_back({a, b, b + kSides});
          all.push_back({a, b + kSides, a + kSides});
        }
      begin = end + 1;
    }
    const std::uint32_t last = first + kSides * static_cast<std::uint32_t>(thread.points() - 1);
    all.push_back({first, first + 2, first + 1});
    all.push_back({first, first + 3, first + 2});
    all.push_back({last, last + 1, last + 2});
    all.push_back({last, last + 2, last + 3});
    first += kSides * static_cast<std::uint32_t>(thread.points());
  }
  return all;
}

}  // namespace palpate
