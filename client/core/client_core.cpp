#include "client/core/client_core.hpp"

#include <algorithm>
#include <utility>

namespace palpate {

SchemeAsked SchemesFelt::mostly() const {
  const auto most = std::max_element(patches.begin(), patches.end());
  return *most > 0 ? SchemeAsked(static_cast<Scheme>(most - patches.begin())) : std::nullopt;
}

ClientCore::ClientCore(const ClientOptions& options, Micros now)
    : options_(options),
      heard_(now),
      answered_(now),
      next_hello_(now),
      next_send_(now),
      next_beat_(now),
      ticked_(now),
      intake_(patch_slot_, options.hello.shadow_of.empty() ? PatchIntake::kFutureMax : PatchIntake::kShadowFutureMax),
      haptic_(patch_slot_, sample_ring_, options.guard, options.coupling) {}

void ClientCore::tick(Micros now) {
  ticked_ = now;
  drain();
  if (left_) return;
  if (link_ == LinkState::joined && now - heard_ >= kLostAfter) {
    join_again(now);
    leave_due_ = true;
  }
  if (link_ != LinkState::joined) {
    if (now < next_hello_) return;
    hello_due_ = true;
    next_hello_ = now + (link_ == LinkState::refused ? kRetryEvery : kHelloEvery);
    return;
  }
  if (has_unsent() && now >= next_send_) {
    send_due_ = true;
    next_send_ = std::max(next_send_ + pace_.interval(), now);  // keeps the cadence when woken late
    next_beat_ = now + kBeatEvery;
  }
  if (now >= next_beat_ || now >= next_report_) {
    beat_due_ = true;
    next_beat_ = now + kBeatEvery;
    next_report_ = now + kReportEvery;
  }
}

Micros ClientCore::deadline() const {
  const auto drain_at = ticked_ + kDrainEvery;
  if (left_) return drain_at;
  if (link_ != LinkState::joined) return std::min(next_hello_, drain_at);
  const auto alive_at = std::min({next_beat_, next_report_, heard_ + kLostAfter, drain_at});
  return has_unsent() ? std::min(next_send_, alive_at) : alive_at;
}

void ClientCore::leave(Micros) {
  let_go();
  leave_due_ = link_ == LinkState::joined;
  left_ = true;
  hello_due_ = send_due_ = beat_due_ = false;
}

/// Collects the samples of the haptic thread since the last call; the intake replays patches over them.
void ClientCore::drain() {
  ToolSample sample;
  while (sample_ring_.pop(sample)) {
    if (!in_world(sample.position)) {
      ++counts_.samples_outside;
      continue;
    }
    intake_.add_sample(sample);
    ++unsent_;
  }
  drain_hold();
  // Samples from before the join are obsolete; the server starts with the newest.
  unsent_ = std::min(unsent_, link_ == LinkState::joined ? kUnsentMost : static_cast<std::size_t>(kMaxSamplesPerDatagram));
}

void ClientCore::drain_hold() {
  if (const Orientation* newest = haptic_.hold().take_orientation()) orientation_ = *newest;
  for (ButtonChange change; haptic_.hold().take_change(change);) {
    if (button_changes_.size() == std::size_t{kMaxButtonChanges}) button_changes_.erase(button_changes_.begin());
    button_changes_.push_back(change);
  }
}

void ClientCore::take(std::span<const std::byte> bytes, Micros now) {
  ++counts_.received;
  counts_.bytes_received += bytes.size();
  if (left_) return;
  Message message;
  if (const auto fault = decode(bytes, message); fault != WireFault::none) return take_fault(fault);
  const bool answers = std::holds_alternative<Welcome>(message.body) || std::holds_alternative<Refuse>(message.body);
  if (!answers && !is_ours(message)) {
    ++counts_.stale;
    return;
  }
  if (!sent_.has(message.clock.echo)) {
    ++counts_.unproven;
    return;
  }
  answered_ = now;
  if (std::holds_alternative<Welcome>(message.body)) return take_welcome(message, now);
  if (std::holds_alternative<Refuse>(message.body)) return take_refuse(message, now);
  hear(now);
  seq_in_.take(message.seq);
  loss_in_.take(message.seq);
  take_clock(message.clock, now);
  if (const auto* patch = std::get_if<PatchMessage>(&message.body)) take_patch(patch->patch, bytes.size(), now);
  if (const auto* piece = std::get_if<PatchTerms>(&message.body)) take_terms(*piece, bytes.size());
  if (const auto* beat = std::get_if<Beat>(&message.body)) take_beat(*beat, now);
}

/// Processes clock stamps. Where the server's clock steps ahead of ours, ours may have stood still.
void ClientCore::take_clock(const ClockStamps& stamps, Micros now) {
  const bool known = clock_.locked();
  const Micros before = clock_.offset();
  clock_.take(stamps, now);
  const Micros step = clock_.offset() - before;
  if (known && step > ClockSync::kStepLeast) intake_.stood_still(step);
}

void ClientCore::take_fault(WireFault fault) {
  ++counts_.dropped[static_cast<std::size_t>(fault)];
  if (fault != WireFault::version || link_ == LinkState::joined) return;
  link_ = LinkState::refused;
  refusal_ = {RefuseReason::version, "the server speaks another wire version than " + std::to_string(kWireVersion)};
}

/// Notes that our server was heard.
void ClientCore::hear(Micros now) {
  heard_ = now;
  unproven_before_ = counts_.unproven;
  if (!vouched_) return;
  pause_.take(now);
  haptic_.server_until(now + std::clamp(2 * pause_.longest(), kServerSilenceLeast, kServerSilenceMost));
}

double ClientCore::patch_bytes_mean() const {
  const std::uint64_t patches = intake_.counts().accepted;
  return patches > 0 ? static_cast<double>(counts_.patch_bytes) / static_cast<double>(patches) : 0;
}

LinkReport ClientCore::link_report() const {
  LinkReport report;
  loss_in_.fill(report);
  report.patch_age = std::max(Micros{}, haptic_.horizon());  // a shadow's patches may be ahead of its clock
  return report;
}

bool ClientCore::is_ours(const Message& message) const {
  return link_ == LinkState::joined && message.instance == instance_ && message.station == station_;
}

void ClientCore::take_welcome(const Message& message, Micros now) {
  if (link_ == LinkState::joined) {
    // A second answer to a repeated Hello, or one from an earlier run of the server.
    if (is_ours(message))
      hear(now);
    else
      ++counts_.stale;
    return;
  }
  if (message.instance != instance_ || message.station != station_) {
    intake_.reset();
    pause_.reset();
    clock_ = ClockSync{};
    seq_in_.reset();
    loss_in_.reset();
    pace_.reset();
    reset_.forget();
    server_report_ = {};
    seq_out_ = 0;
  }
  drain();
  instance_ = message.instance;
  station_ = message.station;
  welcome_ = std::get<Welcome>(message.body);
  intake_.expect(welcome_.rate_hz);
  // If the server assigned a name, the station requests that name when it joins again.
  if (welcome_.station.empty())
    welcome_.station = options_.hello.station;
  else
    options_.hello.station = welcome_.station;
  server_pace_ = {};
  in_use_ = {};
  refusal_ = {};
  link_ = LinkState::joined;
  ++counts_.joins;
  hello_due_ = false;
  hear(now);
  next_send_ = next_beat_ = now;
  next_report_ = now + kReportEvery;
  seq_in_.take(message.seq);
  clock_.take(message.clock, now);
}

void ClientCore::take_refuse(const Message& message, Micros now) {
  const auto& refusal = std::get<Refuse>(message.body);
  const bool gone = refusal.reason == RefuseReason::unknown_station || refusal.reason == RefuseReason::shutting_down;
  if (link_ == LinkState::joined) {
    // A restarted server does not know us under its new instance number; every other refusal must come from ours.
    const bool ours = message.station == station_;
    if (ours && (gone || reset_.pending())) refusal_ = refusal;
    if (ours && gone)
      join_again(now);
    else
      ++counts_.stale;
    return;
  }
  if (refusal.reason == RefuseReason::unknown_station || message.station != 0) {
    ++counts_.stale;
    return;
  }
  link_ = LinkState::refused;
  refusal_ = refusal;
  next_hello_ = std::max(next_hello_, now + kRetryEvery);
}

void ClientCore::take_patch(const Patch& patch, std::size_t bytes, Micros now) {
  drain();
  ++counts_.patches;
  counts_.patch_bytes += bytes;
  contact_in_reach_ = true;
  if (!intake_.accept(patch, now)) return;
  const std::uint64_t before = counts_.patches_accepted++;
  schemes_felt_.changes += before > 0 && patch.scheme != last_patch_.scheme;
  ++schemes_felt_.patches[static_cast<std::size_t>(patch.scheme)];
  last_patch_ = patch;
  if (!std::exchange(vouched_, true)) hear(now);
}

void ClientCore::take_terms(const PatchTerms& piece, std::size_t bytes) {
  drain();
  counts_.patch_bytes += bytes;
  intake_.accept(piece);
}

void ClientCore::take_beat(const Beat& beat, Micros now) {
  contact_in_reach_ = beat.contact_in_reach;
  if (!contact_in_reach_) pause_.interrupt();
  if (beat.renewed_from != 0) renew(beat, now);
  server_report_ = beat.link;
  reset_.hear(beat.resets);
  in_use_ = beat.in_use;
  pace_.take(beat.link, now);
  if (!(beat.rate_hz > 0)) return;
  server_pace_.rate_min_hz = server_pace_.rate_hz > 0 ? std::min(server_pace_.rate_min_hz, beat.rate_hz) : beat.rate_hz;
  server_pace_.rate_hz = beat.rate_hz;
  server_pace_.behind = beat.behind;
  server_pace_.behind_max = std::max(server_pace_.behind_max, beat.behind);
}

/// Renews the patch in use, unless it is older than the oldest patch that the beat renews.
void ClientCore::renew(const Beat& beat, Micros now) {
  const std::uint32_t playing = intake_.playing();
  const bool meant = playing != 0 && static_cast<std::int32_t>(playing - beat.renewed_from) >= 0;
  if (!meant || beat.body_time > now + PatchIntake::kFutureMax) return;
  ++counts_.renewed;
  haptic_.renew_to(beat.body_time);
}

void ClientCore::join_again(Micros now) {
  let_go();
  // The server answers another session in our name: make it forget that one.
  leave_due_ = counts_.unproven > unproven_before_;
  link_ = LinkState::joining;
  next_hello_ = now;
  send_due_ = beat_due_ = false;
}

/// Ends the force until a patch arrives.
void ClientCore::let_go() {
  vouched_ = false;
  pause_.interrupt();
  haptic_.server_until(Micros::min());
}

std::size_t ClientCore::emit(std::span<std::byte> out, Micros now) {
  if (std::exchange(leave_due_, false)) return say(Leave{}, out, now);
  if (std::exchange(hello_due_, false)) return say(options_.hello, out, now);
  if (send_due_)
    if (const auto size = emit_samples(out, now)) return size;
  if (link_ == LinkState::joined)
    if (const auto resets = reset_.due(now)) return say(Reset{*resets}, out, now);
  if (std::exchange(beat_due_, false)) return say(Beat{.link = link_report(), .ticks_late = haptic_.late_ticks()}, out, now);
  return 0;
}

std::size_t ClientCore::say(Payload body, std::span<std::byte> out, Micros now) {
  const bool stranger = std::holds_alternative<Hello>(body);
  const Message message{stranger ? 0 : instance_, stranger ? 0 : station_, seq_out_, clock_.stamp(now), std::move(body)};
  const auto size = encode(message, out);
  if (size == 0) return 0;
  sent_.add(now);
  ++seq_out_;
  ++counts_.sent;
  counts_.bytes_sent += size;
  return size;
}

/// Sends the oldest unsent samples, as many as fit, after some that were sent already: a lost datagram costs nothing.
std::size_t ClientCore::emit_samples(std::span<std::byte> out, Micros now) {
  constexpr auto most = static_cast<std::size_t>(kMaxSamplesPerDatagram);
  const SampleHistory<ToolSample>& history = intake_.history();
  while (unsent_ > 0) {
    const auto sent = history.size() - unsent_;
    const auto repeat = std::min(sent, static_cast<std::size_t>(pace_.repeat()));
    const auto fresh = std::min(unsent_, most - repeat);
    unsent_ -= fresh;
    Samples samples{{}, welcome_.deadband > 0 ? intake_.playing() : 0, orientation_, button_changes_};
    for (auto i = sent - repeat; i < sent + fresh; ++i) samples.samples.push_back(history[i]);
    if (const auto size = say(std::move(samples), out, now)) return size;
  }
  send_due_ = false;
  return 0;
}

}  // namespace palpate
