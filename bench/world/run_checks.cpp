#include "bench/world/run_checks.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace palpate {
namespace {

std::vector<std::uint64_t> counters_of(const ClientCore& core) {
  const ClientCounts& c = core.counts();
  const IntakeCounts& i = core.intake_counts();
  const HapticCounts& h = core.haptic().counts();
  const GuardCounts& g = core.haptic().guard_counts();
  return {c.sent,         c.received,        c.bytes_sent, c.bytes_received, c.joins,       c.stale,          c.patches,
          c.patch_bytes,  c.samples_outside, h.ticks,      h.patches_used,   h.faded_ticks, g.clamped,        g.not_finite,
          g.slew_limited, g.damped,          i.stale,      i.too_old,        i.from_future, h.samples_dropped};
}

std::vector<std::uint64_t> counters_of(const ServerCore& server) {
  const ServerCounts c = server.counts();
  std::vector<std::uint64_t> all{c.received, c.bytes_received, c.sent,           c.bytes_sent, c.unknown_station, c.unexpected,
                                 c.joins,    c.refusals,       c.leaves,         c.timeouts,   c.frames,          c.frames_failed,
                                 c.steps,    c.frames_busy,    c.frames_waiting, c.cut_steps,  c.dropped_all()};
  for (const Micros time : {c.frame_time_sum, c.frame_time_max, c.simulated})
    all.push_back(static_cast<std::uint64_t>(time.count()));
  return all;
}

}  // namespace

void CountersCheck::compare(Micros at, const std::string& name, std::vector<std::uint64_t>& before,
                            std::vector<std::uint64_t> now) {
  for (std::size_t k = 0; k < std::min(before.size(), now.size()); ++k)
    if (now[k] < before[k]) fail(at, fmt::format("counter {} of {} went from {} back to {}", k, name, before[k], now[k]));
  before = std::move(now);
}

void CountersCheck::tick(const SeenTick& seen) {
  if (++ticks_ % kEvery != 0) return;
  judge();
  compare(seen.now, bounds_[seen.station].name, last_[seen.station], counters_of(world_.station(seen.station).core()));
  if (world_.server_up()) compare(seen.now, "the server", server_, counters_of(world_.server()));
}

void RecoveryCheck::tick(const SeenTick& seen) {
  Station& s = seen_[seen.station];
  const StationBounds& bounds = bounds_[seen.station];
  constexpr std::size_t kKept = 4096;
  s.felt.push_back({seen.now, seen.own, seen.out.force, seen.position});
  if (s.felt.size() > kKept) s.felt.pop_front();
  if (s.asked || seen.now < bounds.recovered) return;
  s.asked = true;
  if (world_.station(seen.station).core().link() != LinkState::joined)
    fail(seen.now, fmt::format("{} is not joined {} ms after everything was healed", bounds.name,
                               (seen.now - bounds.healed) / Micros{1000}));
  else if (s.in_reach && (!seen.out.has_patch || seen.now - seen.out.patch_age < bounds.healed - bounds.down_max))
    fail(seen.now, fmt::format("{} has no fresh patch {} ms after everything was healed", bounds.name,
                               (seen.now - bounds.healed) / Micros{1000}));
}

bool RecoveryCheck::rests(const std::deque<Felt>& felt) {
  Vec3 low = felt.back().position, high = low;
  for (auto tick = felt.end() - std::min<std::ptrdiff_t>(kRestTicks, std::ssize(felt)); tick != felt.end(); ++tick) {
    low = low.cwiseMin(tick->position);
    high = high.cwiseMax(tick->position);
  }
  return (high - low).norm() <= kRestM;
}

/// Force felt at `stamp`, if the hand stood still long enough; otherwise end().
std::deque<RecoveryCheck::Felt>::const_iterator RecoveryCheck::felt_at_rest(const Station& s, const StationBounds& bounds,
                                                                            Micros stamp) {
  auto felt = std::lower_bound(s.felt.begin(), s.felt.end(), stamp, [](const Felt& f, Micros t) { return f.own < t; });
  if (felt == s.felt.end() && !s.felt.empty()) --felt;  // over a link without delay a patch is as new as the last tick
  if (felt - s.felt.begin() < kNearTicks) return s.felt.end();
  return (felt - kNearTicks)->now < std::max(bounds.at_rest, bounds.recovered) ? s.felt.end() : felt;
}

void RecoveryCheck::datagram(Micros, const DatagramEvent& event, const Message* message) {
  if (event.kind != DatagramEvent::Kind::delivered || event.to_server || !message) return;
  Station& s = seen_[event.station];
  const StationBounds& bounds = bounds_[event.station];
  if (const auto* beat = std::get_if<Beat>(&message->body)) {
    s.in_reach = beat->contact_in_reach;
    s.answered |= beat->renewed_from != 0 && felt_at_rest(s, bounds, beat->body_time) != s.felt.end();
  }
  const auto* answer = std::get_if<PatchMessage>(&message->body);
  if (!answer) return;
  s.in_reach = true;
  const Patch& patch = answer->patch;
  const auto felt = felt_at_rest(s, bounds, patch.stamp);
  if (felt == s.felt.end()) return;
  s.answered = true;
  if (bounds.lets_go && !rests(s.felt)) return;
  ++s.compared;
  judge();
  // Forces beyond the device's limit are clamped before the comparison.
  const double peak = bounds.limits.force_max_n;
  const Vec3 truth = patch.force.norm() > peak ? Vec3(peak / patch.force.norm() * patch.force) : patch.force;
  double apart = (felt->force - truth).norm();
  const auto behind = felt + std::min<std::ptrdiff_t>(kNearTicks + 1, s.felt.end() - felt);
  Vec3 sum = Vec3::Zero();
  for (auto near = felt - kNearTicks; near < behind; ++near) {
    apart = std::min(apart, (near->force - truth).norm());
    sum += near->force;
  }
  // A reading that steps within a millisecond is felt through dampers as a blow in that tick and as nothing between two.
  const Vec3 mean = sum / static_cast<double>(behind - (felt - kNearTicks));
  apart = std::min(apart, (mean - truth).norm());
  worst_n_ = std::max(worst_n_, apart);
  // A shadow of another scheme shows an old force while the hand trembles.
  const bool promised = bounds.unmoved && bounds.true_at_rest && (bounds.port || bounds.pushes);
  if (!promised || apart <= kForceN + kForceShare * truth.norm() + kFlickerMS * patch.d_port.norm()) return;
  ++s.apart;
  if (apart <= s.worst_n) return;
  s.worst_n = apart;
  s.worst = fmt::format("({:.3f}, {:.3f}, {:.3f}) N at {:.3f} s where the full model has ({:.3f}, {:.3f}, {:.3f}) N",
                        felt->force.x(), felt->force.y(), felt->force.z(), seconds(felt->now), truth.x(), truth.y(), truth.z());
}

void RecoveryCheck::end(Micros now) {
  for (std::size_t k = 0; k < bounds_.size(); ++k) {
    if (!bounds_[k].feels || bounds_[k].outside) continue;
    const Station& s = seen_[k];
    if (!s.asked) fail(now, fmt::format("{} does not tick any more", bounds_[k].name));
    if (s.apart > (1 - kShare) * s.compared)
      fail(now,
           fmt::format(
               "{} feels another force at rest than the full model has for {} of {} patches, such as {}; expected {:g} N and "
               "{:g} % at most between them, and what dampers make of a step of the reading, for {:g} %",
               bounds_[k].name, s.apart, s.compared, s.worst, kForceN, 100 * kForceShare, 100 * kShare));
    if (seen_[k].in_reach && !seen_[k].answered)
      fail(now, fmt::format("no patch came for {} while its hand rested", bounds_[k].name));
  }
}

}  // namespace palpate
