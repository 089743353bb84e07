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
  std::vector<Vec3> at, rest;
};

/// Returns no places if the suture has no bites.
DrawnBites drawn_bites(const Sutures& sutures, const BodyState& state, std::uint32_t suture, std::size_t most) {
  const std::vector<Vec3> none(most, Vec3::Zero());
  DrawnBites bites{std::vector<const SutureState::Thread*>(most, nullptr), none, none};
  const std::vector<SutureState::Thread>& threads = state.sutures->threads;
  for (std::size_t which = 0; which < threads.size(); ++which) {
    if (threads[which].suture != suture) continue;
    const SuturePlace place = sutures.place_of(state, which);
    for (std::size_t j = 0; j < threads[which].bites->size(); ++j) {
      const std::uint32_t number = (*threads[which].bites)[j].number;
      bites.thread[number] = &threads[which];
      bites.at[number] = place.points[j];
      bites.rest[number] = (*threads[which].bites)[j].rest;
    }
  }
  const auto there = std::ranges::find_if(bites.thread, [](const auto* thread) { return thread != nullptr; });
  if (there == bites.thread.end()) return {};
  std::size_t before = static_cast<std::size_t>(there - bites.thread.begin());
  for (std::size_t j = 0; j < most; ++j) {
    if (bites.thread[j]) before = j;
    bites.thread[j] = bites.thread[before];
    bites.at[j] = bites.at[before];
    bites.rest[j] = bites.rest[before];
  }
  return bites;
}

}  // namespace

OuterSurface::OuterSurface(const LumpedBody& body) : x_(vertices_at_rest(body)) {
  std::vector<Triangle> outer;
  const auto is_wall = [&](std::uint32_t v) { return !body.is_node(v) && body.embedded[v - body.nodes.size()].is_wall; };
  for (const Triangle& t : body.triangles)
    if (std::ranges::none_of(t, is_wall)) outer.push_back(t);
  surface_ = Surface(std::move(outer), x_.size());
}

Vec3 OuterSurface::above(const Vec3& point, double radius_m) const {
  if (surface_.empty()) return Vec3::Zero();
  const NearestPoint nearest = nearest_point(surface_.view(), {x_.front().data(), 3 * x_.size()}, point);
  return nearest.position + radius_m * nearest.normal - point;
}

DrawnThreads::DrawnThreads(const LumpedBody& body) : body_(&body) {
  constexpr int kStubSegments = 2;  // to the surface, and to the middle
  if (body.sutures.empty()) return;
  surface_.emplace(body);
  for (const Suture& suture : body.sutures) {
    const bool on_needle = suture.bites.empty();
    const std::size_t most = suture.most_bites();
    const auto rest = [&](std::size_t j) { return on_needle ? body.nodes.front() : suture.bites[j].rest; };
    Thread thread{ThreadChain(rest(0), Vec3::UnitZ(), on_needle ? suture.first_tail_m : suture.length_m.front()),
                  ThreadChain(rest(most - 1), Vec3::UnitX(), on_needle ? suture.length_m.front() : suture.length_m[most]),
                  {}};
    if (on_needle) {  // out of sight until the needle is there
      thread.first.lay(rest(0), rest(0));
      thread.tail.lay(rest(0), rest(0));
    }
    for (std::size_t j = 1; j < most; ++j) {
      const Vec3 middle = 0.5 * (rest(j - 1) + rest(j));
      thread.spans.push_back({ThreadChain(rest(j - 1), middle, kStubSegments), ThreadChain(rest(j), middle, kStubSegments)});
    }
    threads_.push_back(std::move(thread));
  }
}

void DrawnThreads::Span::lie_over(const OuterSurface& surface, const Vec3& low_rest, const Vec3& high_rest, double radius_m) {
  if (low_rest == rest_low && high_rest == rest_high) return;
  rest_low = low_rest;
  rest_high = high_rest;
  over_low = surface.above(rest_low, radius_m);
  over_middle = surface.above(0.5 * (rest_low + rest_high), radius_m);
  over_high = surface.above(rest_high, radius_m);
}

/// Draws it with its bites, and all that is before them, at one place.
void DrawnThreads::Thread::hang_from(const Vec3& at) {
  first.lay(at, at);
  for (Span& span : spans) {
    span.low.lay(at, at);
    span.high.lay(at, at);
  }
}

void DrawnThreads::advance(const Dynamics& dynamics, const BodyState& state, const std::optional<ThreadOnNeedle>& on_needle) {
  const double over_s = state.time_s - std::exchange(time_s_, state.time_s);
  const Vec3& gravity = body_->gravity_m_s2;
  for (std::uint32_t k = 0; k < threads_.size(); ++k) {
    const DrawnBites bites = drawn_bites(dynamics.sutures(), state, k, body_->sutures[k].most_bites());
    Thread& thread = threads_[k];
    const bool is_on_needle = on_needle && state.sutures->threads[on_needle->which].suture == k;
    if (bites.at.empty()) {
      if (!is_on_needle) continue;  // it lies where it came out
      const double length_m = state.sutures->threads[on_needle->which].length_m[0];
      thread.hang_from(on_needle->at);
      if (std::exchange(thread.has_bites, false)) thread.tail.lay(on_needle->at, on_needle->at - length_m * Vec3::UnitZ());
      thread.tail.advance(over_s, on_needle->at, std::nullopt, length_m, gravity);
      continue;
    }
    const SutureState::Thread &first = *bites.thread.front(), &last = *bites.thread.back();
    const std::optional<Vec3> end = is_on_needle ? std::optional(on_needle->at) : last.hand;
    if (!std::exchange(thread.has_bites, true)) {
      thread.first.lay(bites.at.front(), bites.at.front() - first.length_m[0] * Vec3::UnitX());
      thread.tail.lay(bites.at.back(), end ? *end : bites.at.back());
    }
    thread.first.advance(over_s, bites.at.front(), std::nullopt, first.length_m[0], gravity);
    thread.tail.advance(over_s, bites.at.back(), end, last.length_m[last.bites->size()], gravity);
    for (std::size_t i = 0; i < thread.spans.size(); ++i) {
      Span& span = thread.spans[i];
      if (bites.rest[i] == bites.rest[i + 1]) {  // they are one bite
        span.low.lay(bites.at[i], bites.at[i]);
        span.high.lay(bites.at[i], bites.at[i]);
        continue;
      }
      span.lie_over(*surface_, bites.rest[i], bites.rest[i + 1], body_->sutures[k].radius_m);
      const SutureState::Thread &low = *bites.thread[i], &high = *bites.thread[i + 1];
      if (&low != &high) {  // it is cut
        span.low.advance(over_s, bites.at[i], std::nullopt, low.length_m[low.bites->size()], gravity);
        span.high.advance(over_s, bites.at[i + 1], std::nullopt, high.length_m[0], gravity);
      } else {
        const bool is_inside = body_->sutures[k].bites.empty() && i % 2 == 0 && !low.law.last_tied;  // where the needle went
        const double over = is_inside ? 0 : 1;
        const Vec3 &from = bites.at[i], &to = bites.at[i + 1], middle = 0.5 * (from + to) + over * span.over_middle;
        span.low.lay(std::array{from, Vec3(from + over * span.over_low), middle});
        span.high.lay(std::array{to, Vec3(to + over * span.over_high), middle});
      }
    }
  }
}

std::size_t DrawnThreads::Thread::points() const {
  std::size_t sum = first.points().size() + tail.points().size();
  for (const Span& span : spans) sum += span.low.points().size() + span.high.points().size() - (&span == &spans.front() ? 2 : 1);
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
