#include "common/session/clock_sync.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace palpate {
namespace {

constexpr Micros kWatchEvery{1'000'000};
constexpr std::size_t kWatched = 60, kWatchedLeast = 16;  // about a minute; a slope needs a base
constexpr double kAverage = 1.0 / 16;

double micros(Micros t) { return static_cast<double>(t.count()); }

Micros towards(Micros mean, Micros value) { return mean + Micros{std::llround(kAverage * micros(value - mean))}; }

}  // namespace

void WindowedMinimum::add(Micros t, double value) {
  const auto whole = t / kBucket;
  const auto index = std::max<std::int64_t>(whole - (whole * kBucket > t ? 1 : 0), newest_);
  auto& bucket = buckets_[static_cast<std::size_t>((index % kBuckets + kBuckets) % kBuckets)];
  if (bucket.index != index || value < bucket.value) bucket = {index, t, value};
  newest_ = index;
}

double WindowedMinimum::at(Micros now, double slope) const {
  double least = std::numeric_limits<double>::max();
  for (const auto& bucket : buckets_) {
    if (bucket.index == kNone || bucket.index + kBuckets <= newest_) continue;
    least = std::min(least, bucket.value + slope * micros(now - bucket.t));
  }
  return least;
}

ClockStamps ClockSync::stamp(Micros now) const {
  if (!heard_ || now - heard_at_ > kHoldMax) return {now, Micros{}, Micros{}};
  return {now, heard_sent_, now - heard_at_};
}

bool ClockSync::Doubt::grows(Micros now) {
  if (count++ == 0) since = now;
  return count >= kDoubted && now - since >= kDoubtFor;
}

void ClockSync::take(const ClockStamps& peer, Micros now) {
  if (is_to_be_ignored(peer, now)) return;
  if (!heard_ || peer.sent > heard_sent_) {
    heard_sent_ = peer.sent;
    heard_at_ = now;
    heard_ = true;
  }
  measure(peer, now);
  if (has_stepped(now)) {
    forget(peer, now);
    measure(peer, now);
  }
  if (!towards_us_.empty() && !towards_peer_.empty()) {
    slew(now);
    watch_drift(now);
  }
  if (locked_) keep_within(peer, now);
}

bool ClockSync::is_beyond(const ClockStamps& peer, Micros now) const {
  return heard_ && peer.sent - heard_sent_ > now - heard_at_ + kLeadMost;
}

bool ClockSync::is_to_be_ignored(const ClockStamps& peer, Micros now) {
  if (peer.sent >= ignored_before_ && !is_beyond(peer, now)) {
    doubt_ = {};
    return false;
  }
  if (!doubt_.grows(now)) return true;
  doubt_ = {};
  forget(peer, now);
  return false;
}

void ClockSync::measure(const ClockStamps& peer, Micros now) {
  const bool echoes = peer.echo != Micros{} || peer.echo_hold != Micros{};
  const auto rtt = now - peer.echo - peer.echo_hold;
  if (echoes && (rtt < Micros{} || rtt > kRttMax || peer.echo_hold < Micros{})) return;
  towards_us_.add(now, micros(now - peer.sent));
  if (!is_whole(peer)) return;
  towards_peer_.add(now, micros(peer.sent - peer.echo_hold - peer.echo));
  if (exchanges_++ == 0) rtt_ = {rtt, rtt, rtt, Micros{}};
  rtt_.jitter = towards(rtt_.jitter, Micros{std::llabs((rtt - rtt_.last).count())});
  rtt_.mean = towards(rtt_.mean, rtt);
  rtt_.last = rtt;
  rtt_.min = from_micros(towards_us_.at(now, -drift_) + towards_peer_.at(now, drift_));
}

/// Returns true for an exchange in both directions that is completely after the last step.
bool ClockSync::is_whole(const ClockStamps& peer) const {
  return (peer.echo != Micros{} || peer.echo_hold != Micros{}) && peer.echo >= echoes_from_;
}

bool ClockSync::has_stepped(Micros now) const {
  if (towards_us_.empty() || towards_peer_.empty()) return false;
  return towards_us_.at(now, -drift_) + towards_peer_.at(now, drift_) < -micros(kStepLeast);
}

void ClockSync::forget(const ClockStamps& peer, Micros now) {
  ++steps_;
  heard_sent_ = peer.sent;
  heard_at_ = now;
  filling_since_ = now;
  ignored_before_ = peer.sent;
  echoes_from_ = now;
  lost_ = true;
  towards_us_ = towards_peer_ = WindowedMinimum{};
  seen_.clear();
}

void ClockSync::keep_within(const ClockStamps& peer, Micros now) {
  offset_us_ = std::max(offset_us_, micros(peer.sent - now));
  const auto rtt = now - peer.echo - peer.echo_hold;
  if (is_whole(peer) && peer.echo_hold >= Micros{} && rtt >= Micros{})
    offset_us_ = std::min(offset_us_, micros(peer.sent - peer.echo_hold - peer.echo));
}

void ClockSync::slew(Micros now) {
  const double theta = (towards_peer_.at(now, drift_) - towards_us_.at(now, -drift_)) / 2;
  if (!locked_ || lost_) {
    locked_ = true;
    lost_ = false;
    filling_since_ = slewed_at_ = watched_at_ = now;
    offset_us_ = theta;
    return;
  }
  const double elapsed_us = std::max(0.0, micros(now - slewed_at_));
  const double share = std::min(1.0, elapsed_us / micros(kSlewTime));
  const double most = kSlewMax * elapsed_us;
  // The known drift is followed at once; only the remainder is slewed.
  offset_us_ += std::clamp((theta - offset_us_) * share + drift_ * elapsed_us, -most, most);
  slewed_at_ = now;
}

void ClockSync::watch_drift(Micros now) {
  // While the window fills, theta lags by a growing part of it, which would look like drift.
  if (now - filling_since_ < WindowedMinimum::kWindow || now - watched_at_ < kWatchEvery) return;
  watched_at_ = now;
  seen_.push_back({seconds(now), (towards_peer_.at(now, 0) - towards_us_.at(now, 0)) / 2});
  if (seen_.size() > kWatched) seen_.pop_front();
  if (seen_.size() < kWatchedLeast) return;
  const double n = static_cast<double>(seen_.size());
  double t_mean = 0, theta_mean = 0;
  for (const auto& s : seen_) t_mean += s.t_s / n, theta_mean += s.theta_us / n;
  double tt = 0, t_theta = 0;
  for (const auto& s : seen_) {
    tt += (s.t_s - t_mean) * (s.t_s - t_mean);
    t_theta += (s.t_s - t_mean) * (s.theta_us - theta_mean);
  }
  drift_ = std::clamp(t_theta / tt * 1e-6, -kDriftMax, kDriftMax);
}

}  // namespace palpate
