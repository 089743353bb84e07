// How far a frame goes, what the body is given for it, and what its results become.
#include <algorithm>
#include <utility>

#include "common/port/terms_parity.hpp"
#include "server/core/server_core.hpp"
#include "server/reduce/patch_builder.hpp"

namespace palpate {
namespace {

constexpr Micros kTimelineKept{4'000'000};  // of a station's timeline behind the body
constexpr Micros kLongestSaid{60'000'000};  // of what a beat says of how far the room is behind
// Shares of a frame that body and patches may take together. Rollouts leave time for datagrams, viewers and the scheduler, and
// for frames that take longer than others; the nonlinear scheme, which buys far more than the milliseconds that it makes patches
// older by, is given up where frames would be skipped.
constexpr double kSchemesMayTake = 0.95, kRolloutsMayTake = 0.8;
constexpr Micros kLongHorizon{120'000};
constexpr int kLongHorizonOrder = 16;  // as exact as 22 there, within 0.1 dB

void ask_for_shapes(const ShapeViewer& viewer, FrameJob& job) {
  job.shapes = true;
  const auto wants = [&](ShapeChannel channel) { return (viewer.channels >> static_cast<unsigned>(channel) & 1) != 0; };
  job.tension = job.tension || wants(ShapeChannel::tension);
  job.support = job.support || wants(ShapeChannel::support);
}

}  // namespace

Micros ServerCore::due(std::uint64_t frame) const {
  return first_tick_ + from_seconds(static_cast<double>(frame) / options_.rate_hz);
}

/// To the last frame that fell due while the room was idle, the next of them being the first not before `now`.
void ServerCore::wake(Micros now) {
  next_frame_ = static_cast<std::uint64_t>(seconds(now - first_tick_) * options_.rate_hz);
  while (due(next_frame_) < now) ++next_frame_;
  body_time_ = std::max(body_time_, due(next_frame_ - 1));
  owed_ = false;
}

void ServerCore::note_due(bool skipped) {
  lately_.push_back(skipped ? 1 : 0);
  while (static_cast<double>(lately_.size()) > std::max(1.0, options_.rate_hz)) lately_.pop_front();
  const auto busy = static_cast<double>(std::count(lately_.begin(), lately_.end(), std::uint8_t{1}));
  pace_.rate_hz = options_.rate_hz * (1 - busy / static_cast<double>(lately_.size()));
}

Micros ServerCore::playout(Micros now) const {
  const auto punctual = [&](const Station& s) { return now - s.sample_heard <= kLateAfter; };
  auto least_lag = Micros::max(), least_late = Micros::max();
  for (const auto& [id, station] : stations_) {
    if (!station.pushes() || station.timeline.empty()) continue;
    if (punctual(station))
      least_lag = std::min(least_lag, station.buffer.length());
    else
      least_late = std::min(least_late, station.sample_lag);
  }
  auto known = Micros::max(), wait = Micros{};
  int waited_for = 0;
  for (const auto& [id, station] : stations_) {
    if (!station.pushes() || station.timeline.empty() || !punctual(station)) continue;
    known = std::min(known, station.timeline.newest());
    wait = std::max(wait, std::min(station.buffer.length(), least_lag + kMostWait));
    ++waited_for;
  }
  auto target = now;
  if (known != Micros::max()) {
    target = known;  // exactly a sample, even where it lies ahead of `now` by an error of the clocks
    if (waited_for > 1) target = std::max(target, now - wait);
  } else if (least_late != Micros::max()) {
    target = now - least_late;
  }
  return std::min(target, body_time_ + kLongestFrame);
}

FrameJob ServerCore::make_job(Micros target) const {
  FrameJob job;
  job.begin = body_time_;
  job.target = target;
  job.frame = from_seconds(1 / options_.rate_hz);
  job.rollouts = rollouts_.taken();
  for (const auto& [id, station] : stations_) {
    if (station.views()) ask_for_shapes(station.shape, job);
    if (station.pushes() && !station.timeline.empty()) job.stations.push_back(make_station_job(station, target));
  }
  for (const auto& [id, station] : stations_) {
    if (station.hello.shadow_of.empty()) continue;
    const auto* owner = find(station.hello.shadow_of);
    if (owner && owner->pushes() && !owner->timeline.empty() && station.clock.locked())
      job.stations.push_back(make_station_job(station, target));
  }
  return job;
}

StationJob ServerCore::make_station_job(const Station& station, Micros target) const {
  StationJob job;
  job.id = station.id;
  job.scheme = station.in_use.scheme;
  job.horizon = horizon(station);
  job.order = order(station, job.horizon);
  job.silence = silence(station);
  job.deadband = options_.deadband;
  job.playing = station.playing;
  if (station.pushes())
    job.samples = station.timeline.between(body_time_, target);
  else
    job.shadow_of = find(station.hello.shadow_of)->id;
  return job;
}

/// What it asked for. Who left it to us gets fewer moments where a patch has long to last: from there on a linear patch is wrong
/// by what it leaves out of the body's bending, and more moments buy nothing but bytes.
int ServerCore::order(const Station& station, Micros horizon) const {
  if (station.hello.order > 0 || station.in_use.scheme != Scheme::port || facts_.contact != ContactKind::attach)
    return station.hello.order;
  return horizon >= kLongHorizon ? kLongHorizonOrder : 0;
}

/// How old its patches get before the next: as the station measures it, and no less than the body's age in this frame lets
/// expect. That is known before the station has said anything, and at once when the body lags behind for another's samples.
Micros ServerCore::horizon(const Station& station) const {
  const auto rtt = station.clock.rtt().mean;
  const auto expected = std::max(rtt, lag_ + rtt / 2) + compute_mean_ + from_seconds(1 / options_.rate_hz);
  return std::min(std::max(station.patch_age, expected), kHorizonMost);
}

/// From the last patch before the longest run of losses that the station has seen to the first behind it, and half as long again:
/// a link that loses datagrams in runs is silent for longer than its patches' usual age, and a force that is cut and comes back
/// is worse to feel than one of an old patch.
Micros ServerCore::silence(const Station& station) const {
  const double frames_lost = static_cast<double>(station.longest_run) / station.patch_copies;
  const double pause_s = station.longest_run > 0 ? (frames_lost + 1) / pace_.rate_hz : 0;
  return std::clamp(from_seconds(1.5 * pause_s), kSilenceLeast, kSilenceMost);
}

std::optional<FrameJob> ServerCore::next_job(Micros now) {
  if (!job_ || job_out_) return std::nullopt;
  job_out_ = true;
  job_began_ = now;
  job_->reset = std::exchange(reset_due_, false);
  return std::exchange(job_, std::nullopt);
}

void ServerCore::count(const FrameResult& result, Micros took) {
  const bool slept = result.asleep && result.steps == 0;
  counts_.frame_time_sum += took;
  counts_.frame_time_max = std::max(counts_.frame_time_max, took);
  longest_frame_ = std::max(longest_frame_, took);
  counts_.steps += static_cast<std::uint64_t>(result.steps);
  counts_.cut_steps += static_cast<std::uint64_t>(result.cut_steps);
  counts_.frames_failed += result.failed;
  ++counts_.frames;
  counts_.frames_asleep += slept;
  if (slept) return;
  // What a frame costs in which the body sleeps says nothing of those in which it is touched.
  const bool first = counts_.frames - counts_.frames_asleep == 1;
  compute_mean_ = first ? took : compute_mean_ + (took - compute_mean_) / 8;
  learn_costs(result);
  meter_.add(job_began_ + took, took, result.stamp - body_time_);
  counts_.simulated += result.stamp - body_time_;
  counts_.stepping += took;
}

/// Patches count as what was asked for: where a nonlinear one could not be had, to try it took the time. Those of a body that is
/// reset were not built.
void ServerCore::learn_costs(const FrameResult& result) {
  if (result.failed || result.asleep || result.step_took == Micros{}) return;
  costs_.take_step(result.step_took);
  FrameCosts::Patches patches{result.patches_took, result.rollouts_took, 0, 0};
  for (const StationFrame& frame : result.stations) {
    const auto station = stations_.find(frame.id);
    if (!frame.patch || station == stations_.end()) continue;
    const Scheme asked = station->second.in_use.scheme;
    if (frame.patch->scheme == Scheme::hold && asked != Scheme::hold) return;
    ++(asked == Scheme::hyper ? patches.nonlinear : patches.linear);
  }
  if (patches.nonlinear == 0) patches.rollouts = {};
  counts_.frames_without_rollouts += patches.nonlinear > 0 && !rollouts_.taken();
  costs_.take_patches(patches, result.stamp - body_time_);
}

/// For the frame that is about to be made: the scheme of each station, then whether there is time for rollouts as well.
void ServerCore::choose_detail(Micros now) {
  const double frame_s = 1 / options_.rate_hz;
  const auto patch_cost = [this](Scheme scheme) { return scheme == Scheme::hyper ? costs_.nonlinear() : costs_.linear(); };
  DetailCost schemes{from_seconds(kSchemesMayTake * frame_s), costs_.step(), Micros{}, costs_.nonlinear(), 0};
  for (const auto& [id, station] : stations_) {
    if (station.chosen()) ++schemes.shares;
    if (!station.views() && !station.chosen()) schemes.others += patch_cost(*station.hello.scheme);
  }
  choose_schemes(schemes, now);
  DetailCost rollouts{from_seconds(kRolloutsMayTake * frame_s), costs_.step(), Micros{}, costs_.rollouts(), 1};
  for (const auto& [id, station] : stations_)
    if (!station.views()) rollouts.others += patch_cost(station.in_use.scheme);
  rollouts_.decide(rollouts, 0, now);
  for (auto& [id, station] : stations_)
    if (station.chosen() && station.in_use.reason == SchemeReason::fits && !rollouts_.taken())
      station.in_use.reason = SchemeReason::fits_without_rollouts;
}

void ServerCore::choose_schemes(const DetailCost& cost, Micros now) {
  for (auto& [id, station] : stations_) {
    if (station.views()) continue;
    const SchemeInUse before = station.in_use;
    if (station.hello.scheme) {
      station.in_use = {*station.hello.scheme, SchemeReason::asked, Micros{}, Micros{}};
      continue;
    }
    const bool nonlinear = station.choice.decide(cost, station.lost, now);
    station.in_use = {nonlinear ? Scheme::hyper : Scheme::port, station.choice.reason(), cost.cost, DetailChoice::left(cost)};
    const bool was_known = before.reason > SchemeReason::not_known_yet,
               known = station.choice.reason() > SchemeReason::not_known_yet;
    if (on_scheme && known && (!was_known || before.scheme != station.in_use.scheme))
      on_scheme(station.hello.station, station.in_use);
  }
}

void ServerCore::finish(FrameResult result, Micros now) {
  count(result, now - job_began_);
  job_out_ = false;
  asleep_ = result.asleep;
  body_time_ = result.stamp;
  pace_.behind = std::max(Micros{}, now - body_time_);
  if (result.failed) return beat_all();

  for (auto& [id, station] : stations_) {
    const auto frame = std::find_if(result.stations.begin(), result.stations.end(), [&](const auto& f) { return f.id == id; });
    if (frame != result.stations.end())
      give(station, *frame, now);
    else if (station.views())
      report(station, now);
    else
      beat(station);
    station.timeline.forget_before(body_time_ - kTimelineKept);
  }
  if (!result.positions.empty()) show(result, now);
}

/// A viewer hears now and then how its link, the stations and the room do.
void ServerCore::report(Station& viewer, Micros now) {
  if (now < viewer.next_report) return;
  viewer.next_report = now + kLinkReportEvery;
  viewer.outbox.room = true;
  viewer.outbox.beat = beat_for(viewer);
}

void ServerCore::show(const FrameResult& result, Micros now) {
  ShapeFrame frame{body_time_, result.positions, {{{}, result.tension, result.support}}, {}};
  for (const StationFrame& station : result.stations)
    if (station.contact) frame.tools.push_back(station.tool);
  shapes_.take(frame);
  for (auto& [id, station] : stations_) {
    if (station.views()) shapes_.begin(station.shape, now);
  }
}

void ServerCore::give(Station& station, StationFrame& frame, Micros now) {
  station.shown = {station.hello.station, frame.tool, frame.force, frame.contact, station.orientation, station.buttons.pressed};
  station.has_shown = true;
  station.contact_in_reach = frame.patch.has_value();
  if (!frame.patch || is_lost(station, *frame.patch)) return beat(station);
  station.states = static_cast<std::uint16_t>(2 * frame.patch->modes());
  if (frame.lives_on) return let_live_on(station, *frame.lives_on);
  send_patch(station, frame);
  // Patches are all that a station in contact gets. Beside them it hears now and then how the link and the room do, and at once
  // when the room falls behind or keeps up again.
  const bool slow = pace_.rate_hz < kSlowBelow * options_.rate_hz;
  if (slow == station.slow_known && now < station.next_report) return;
  station.slow_known = slow;
  station.next_report = now + kLinkReportEvery;
  station.outbox.beat = beat_for(station);
}

void ServerCore::send_patch(Station& station, StationFrame& frame) {
  const Micros stamp = frame.patch->stamp;
  frame.patch->stamp = station_time(station, stamp);
  frame.patch->seq = ++station.patch_seq;
  auto pieces = frame.terms.variables > 0 ? to_pieces(frame.terms, frame.patch->seq) : std::vector<PatchTerms>{};
  if (!pieces.empty() && station.loss_known && station.patch_copies > 1) pieces.push_back(parity_of(pieces));
  station.outbox.terms.assign(pieces.begin(), pieces.end());
  station.outbox.patch = std::move(frame.patch);
  // The patch before one with terms, which has its own, is nearly as good: there is little to lose, and much to send.
  station.outbox.patch_copies = pieces.empty() ? station.patch_copies : 1;
  station.outbox.beat.reset();
  if (options_.deadband <= 0 || !station.pushes()) return;
  station.patches_sent.push_back({station.patch_seq, stamp});
  if (station.patches_sent.size() > Deadband::kMostSent) station.patches_sent.pop_front();
}

/// In place of a patch that says no more than those from the one stamped `stamp` on.
void ServerCore::let_live_on(Station& station, Micros stamp) {
  const auto& sent = station.patches_sent;
  const auto oldest = std::find_if(sent.begin(), sent.end(), [&](const Station::SentPatch& p) { return p.stamp == stamp; });
  beat(station);
  if (station.outbox.patch || oldest == sent.end()) return;
  ++station.counts.lived_on;
  station.outbox.beat->lives_on = oldest->seq;
  station.outbox.beat_copies = station.patch_copies;
}

/// Whether nothing is known of the tool for longer than the patch lasts: it would be played from where the tool is not any more.
/// The samples of a shadow's tool come over the way of another station, and may take as long as that one's prediction horizon.
bool ServerCore::is_lost(const Station& station, const Patch& patch) const {
  const Station* const owner = tool_of(station);
  if (!owner || owner->timeline.empty()) return false;
  const Micros allowed = owner == &station ? patch.valid_for : std::max(patch.valid_for, 2 * horizon(*owner));
  return patch.stamp - owner->timeline.newest() > allowed;
}

void ServerCore::beat_all() {
  for (auto& [id, station] : stations_) beat(station);
}

void ServerCore::beat(Station& station) {
  if (station.outbox.patch) return;  // not sent yet, and it says as much
  station.outbox.beat = beat_for(station);
  station.outbox.beat_copies = 1;
}

Beat ServerCore::beat_for(const Station& station) const {
  Beat beat{station_time(station, body_time_), station.contact_in_reach, pace_.rate_hz, std::min(pace_.behind, kLongestSaid), {}};
  beat.resets = static_cast<std::uint16_t>(counts_.resets);
  beat.in_use = station.in_use;
  station.loss.fill(beat.link);
  return beat;
}

/// The station whose samples say where the tool of this one is; none where that one has left.
const Station* ServerCore::tool_of(const Station& station) const {
  return station.hello.shadow_of.empty() ? &station : find(station.hello.shadow_of);
}

/// By the samples of its tool where there are any.
Micros ServerCore::station_time(const Station& station, Micros server_time) const {
  const Station* const owner = tool_of(station);
  if (owner && !owner->timeline.empty()) return owner->timeline.to_station(server_time);
  return station.clock.locked() ? station.clock.to_peer(server_time) : Micros{};
}

}  // namespace palpate
