#include "server/core/frame_scheduler.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include "server/reduction/patch_build.hpp"

namespace palpate {
namespace {

constexpr Micros kLongHorizon{120'000};
constexpr int kLongHorizonOrder = 16;  // as exact as 22 there, within 0.1 dB

void ask_for_shapes(const ShapeViewer& viewer, FrameJob& job) {
  job.shapes = true;
  job.fields |= viewer.channels;
}

bool gave_patches(const FrameResult& result) {
  return std::any_of(result.stations.begin(), result.stations.end(), [](const StationFrame& s) { return s.patch.has_value(); });
}

}  // namespace

FrameScheduler::FrameScheduler(ContactKind contact, const ServerOptions& options)
    : contact_(contact), rate_hz_(options.rate_hz), deadband_(options.deadband), detail_(options.rate_hz) {
  assert(rate_hz_ > 0);
  pace_.rate_hz = rate_hz_;
}

bool FrameScheduler::tick(Stations& stations, Micros now) {
  if (!started_) {
    started_ = true;
    first_tick_ = body_time_ = now;
  }
  if (is_idle(stations)) return true;
  const std::uint64_t before = next_frame_;
  for (; due(next_frame_) <= now; ++next_frame_) {
    const bool skipped = job_out_ && owed_;
    note_due(skipped);
    counts_.frames_busy += skipped;
    owed_ = true;
  }
  if (job_out_) return next_frame_ == before;
  if (!std::exchange(owed_, false)) return true;
  leave_out_lag(playout(stations, now, now));
  const auto target = playout(stations, body_time_, now);
  if (target < body_time_ + kLeastFrame) {
    ++counts_.frames_waiting;
    job_.reset();
    return false;
  }
  lag_ = now - target;
  detail_.choose(stations, now);
  job_ = make_job(stations, target);
  return true;
}

/// `known` is the time up to which the tools are known.
void FrameScheduler::leave_out_lag(Micros known) {
  if (known - body_time_ <= kBehindMost) return;
  counts_.left_out += known - kLongestFrame - body_time_;
  body_time_ = known - kLongestFrame;
}

Micros FrameScheduler::deadline(const Stations& stations) const {
  if (!started_) return Micros{};
  if (is_idle(stations)) return Micros::max();
  return owed_ && !job_out_ ? Micros{} : due(next_frame_);
}

Micros FrameScheduler::due(std::uint64_t frame) const {
  return first_tick_ + from_seconds(static_cast<double>(frame) / rate_hz_);
}

/// Advances to the last frame that fell due while the room was idle; the frame after it is the first not before `now`.
void FrameScheduler::wake(Micros now) {
  if (!asleep_ || job_out_) return;
  next_frame_ = static_cast<std::uint64_t>(seconds(now - first_tick_) * rate_hz_);
  while (due(next_frame_) < now) ++next_frame_;
  body_time_ = std::max(body_time_, due(next_frame_ - 1));
  owed_ = false;
}

void FrameScheduler::note_due(bool skipped) {
  lately_.push_back(skipped ? 1 : 0);
  while (static_cast<double>(lately_.size()) > std::max(1.0, rate_hz_)) lately_.pop_front();
  const auto busy = static_cast<double>(std::count(lately_.begin(), lately_.end(), std::uint8_t{1}));
  pace_.rate_hz = rate_hz_ * (1 - busy / static_cast<double>(lately_.size()));
}

FrameJob FrameScheduler::make_job(const Stations& stations, Micros target) const {
  FrameJob job;
  job.begin = body_time_;
  job.target = target;
  job.frame = from_seconds(1 / rate_hz_);
  job.rollouts = detail_.rollouts();
  for (const auto& [id, station] : stations) {
    if (station.views()) ask_for_shapes(station.shape, job);
    if (station.pushes() && !station.tool.timeline().empty()) job.stations.push_back(make_station_job(stations, station, target));
  }
  for (const auto& [id, station] : stations) {
    if (station.hello.shadow_of.empty()) continue;
    const auto* owner = stations.named(station.hello.shadow_of);
    if (owner && owner->pushes() && !owner->tool.timeline().empty() && station.clock.locked())
      job.stations.push_back(make_station_job(stations, station, target));
  }
  return job;
}

StationJob FrameScheduler::make_station_job(const Stations& stations, const Station& station, Micros target) const {
  StationJob job;
  job.id = station.id;
  job.scheme = station.in_use.scheme;
  job.horizon = horizon(station);
  job.order = order(station, job.horizon);
  job.silence = silence(station);
  job.deadband = deadband_;
  job.playing = station.playing;
  job.wants_patch = station.served;
  job.presses = station.tool.presses();
  job.held = station.held;
  if (station.pushes())
    job.samples = station.tool.timeline().between(body_time_, target);
  else
    job.shadow_of = stations.named(station.hello.shadow_of)->id;
  return job;
}

/// Returns the order that the station asked for. A station that left it to the server gets fewer moments for patches with a long
/// horizon: there the error of a linear patch is that of neglecting nonlinearity, and more moments only cost bytes.
int FrameScheduler::order(const Station& station, Micros horizon) const {
  if (station.hello.order > 0 || station.in_use.scheme != Scheme::port || contact_ != ContactKind::attach)
    return station.hello.order;
  return horizon >= kLongHorizon ? kLongHorizonOrder : 0;
}

Micros FrameScheduler::horizon(const Station& station) const {
  const auto rtt = station.clock.rtt().mean;
  const auto expected = std::max(rtt, lag_ + rtt / 2) + compute_mean_ + from_seconds(1 / rate_hz_);
  return std::min(std::max(station.link.patch_age, expected), kHorizonMost);
}

Micros FrameScheduler::silence(const Station& station) const {
  const ReportedLink& link = station.link;
  const double frames_lost = static_cast<double>(link.longest_run) / link.patch_copies;
  const double pause_s = link.longest_run > 0 ? (frames_lost + 1) / pace_.rate_hz : 0;
  return std::clamp(from_seconds(1.5 * pause_s), kSilenceLeast, kSilenceMost);
}

std::optional<FrameJob> FrameScheduler::next_job(Micros now) {
  if (!job_ || job_out_) return std::nullopt;
  job_out_ = true;
  job_began_ = now;
  job_->reset = std::exchange(reset_due_, false);
  return std::exchange(job_, std::nullopt);
}

void FrameScheduler::finish(const FrameResult& result, Stations& stations, Micros now) {
  assert(job_out_);
  count(result, stations, now - job_began_);
  job_out_ = false;
  asleep_ = result.asleep;
  body_time_ = result.stamp;
  pace_.behind = std::max(Micros{}, now - body_time_);
  for (auto& [id, station] : stations) station.horizon = horizon(station);
  for (const StationFrame& frame : result.stations) {
    const auto station = stations.find(frame.id);
    if (station == stations.end()) continue;
    std::optional<Micros>& touched = station->second.touched;
    if (frame.patch || (touched && !station->second.served)) touched = now;
  }
}

void FrameScheduler::count(const FrameResult& result, const Stations& stations, Micros took) {
  const bool slept = result.asleep && result.steps == 0;
  counts_.frame_time_sum += took;
  counts_.frame_time_max = std::max(counts_.frame_time_max, took);
  longest_frame_ = std::max(longest_frame_, took);
  counts_.steps += static_cast<std::uint64_t>(result.steps);
  counts_.cut_steps += static_cast<std::uint64_t>(result.cut_steps);
  counts_.frames_failed += result.failed;
  counts_.tools_released += result.released.size();
  counts_.bites_torn_out += result.sutures.torn_out;
  ++counts_.frames;
  counts_.frame_seconds.add(seconds(took));
  if (gave_patches(result)) counts_.patches_seconds.add(seconds(result.patches_took));
  counts_.frames_asleep += slept;
  if (slept) return;
  // The cost of a frame in which the body sleeps says nothing about frames in which it is touched.
  const bool first = counts_.frames - counts_.frames_asleep == 1;
  compute_mean_ = first ? took : compute_mean_ + (took - compute_mean_) / 8;
  counts_.frames_without_rollouts += detail_.learn(result, stations, result.stamp - body_time_);
  meter_.add(job_began_ + took, took, result.stamp - body_time_);
  counts_.simulated += result.stamp - body_time_;
  counts_.stepping += took;
}

void FrameScheduler::drop_job(bool ended) {
  ended_ = ended_ || ended;
  job_.reset();
}

void FrameScheduler::reset() {
  ++counts_.resets;
  reset_due_ = true;
}

BodyNow FrameScheduler::body(Micros now) const {
  return {body_time_, pace_, static_cast<std::uint16_t>(counts_.resets), asleep_, meter_.at(now)};
}

}  // namespace palpate
