#include "client/core/client_core.hpp"

#include <algorithm>
#include <utility>

namespace palpate {

SchemeAsked SchemesFelt::mostly() const {
  const auto most = std::max_element(patches.begin(), patches.end());
  return *most > 0 ? SchemeAsked(static_cast<Scheme>(most - patches.begin())) : std::nullopt;
}

ClientCore::ClientCore(const ClientOptions& options, Micros now)
    : ClientSession(options.hello, now),
      ticked_(now),
      refuses_guidance_(options.refuses_guidance),
      intake_(patch_slot_, options.hello.shadow_of.empty() ? PatchIntake::kFutureMax : PatchIntake::kShadowFutureMax),
      haptic_(patch_slot_, sample_ring_, options.guard, options.coupling) {}

void ClientCore::tick(Micros now) {
  ticked_ = now;
  drain();
  if (advance(now) == Event::ended) stop_force();
  if (!joined()) return;
  if (has_unsent() && now >= next_send_) {
    send_due_ = true;
    next_send_ = std::max(next_send_ + pace_.interval(), now);  // keeps the cadence when woken late
    next_beat_ = now + kBeatEvery;
  }
  if (now >= next_beat_ || now >= next_report_ || guidance_report().hand != hand_said_) {
    beat_due_ = true;
    next_beat_ = now + kBeatEvery;
    next_report_ = now + kReportEvery;
  }
}

Micros ClientCore::deadline() const {
  const Micros at = std::min(ClientSession::deadline(), ticked_ + kDrainEvery);
  if (!joined()) return at;
  const Micros alive_at = std::min({at, next_beat_, next_report_});
  return has_unsent() ? std::min(next_send_, alive_at) : alive_at;
}

void ClientCore::leave() {
  stop_force();
  ClientSession::leave();
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
  drain_buttons();
  unsent_ = std::min(unsent_, kUnsentMost);
}

void ClientCore::drain_buttons() {
  for (ButtonChange change; haptic_.buttons().take(change);) {
    if (button_changes_.size() == std::size_t{kMaxButtonChanges}) button_changes_.erase(button_changes_.begin());
    button_changes_.push_back(change);
  }
}

void ClientCore::take(std::span<const std::byte> bytes, Micros now) {
  Message message;
  const bool known = clock().locked();
  const Micros offset = clock().offset();
  const Event event = receive(bytes, message, now);
  switch (event) {
    case Event::none:
    case Event::denied:
      return;
    case Event::joined:
      forget_server();
      [[fallthrough]];
    case Event::resumed:
      return begin(message, now);
    case Event::ended:
      return stop_force();
    case Event::unusable:
    case Event::message:
      break;
  }
  hear(now);
  seq_in_.take(message.seq);
  loss_in_.take(message.seq);
  if (event == Event::unusable) return;  // the link has not lost it
  // Where the server's clock steps ahead of ours, ours may have stood still.
  const Micros step = clock().offset() - offset;
  if (known && step > ClockSync::kStepLeast) intake_.stood_still(step);
  if (const auto* patch = std::get_if<PatchMessage>(&message.body)) take_patch(patch->patch, bytes.size(), now);
  if (const auto* piece = std::get_if<PatchTerms>(&message.body)) take_terms(*piece, bytes.size());
  if (const auto* beat = std::get_if<Beat>(&message.body)) take_beat(*beat, now);
  if (const auto* guidance = std::get_if<Guidance>(&message.body)) take_guidance(*guidance, now);
}

/// Clears what holds for one session only.
void ClientCore::forget_server() {
  intake_.reset();
  pause_.reset();
  seq_in_.reset();
  loss_in_.reset();
  pace_.reset();
  server_report_ = {};
}

/// Starts to send. Samples from before the join are obsolete; the server starts with the newest.
void ClientCore::begin(const Message& message, Micros now) {
  drain();
  unsent_ = std::min(unsent_, static_cast<std::size_t>(kMaxSamplesPerDatagram));
  intake_.expect(welcome().rate_hz);
  server_pace_ = {};
  in_use_ = {};
  tool_released_ = false;
  hear(now);
  next_send_ = next_beat_ = now;
  next_report_ = now + kReportEvery;
  seq_in_.take(message.seq);
}

/// Lets the tool meet the rigid parts, once they have arrived, while the server is there.
void ClientCore::meet_parts(Micros now) {
  if (parts().empty() || !hello().shadow_of.empty()) return haptic_.meet(nullptr, now);
  const std::uint64_t hash = welcome().scene_hash, joins = ClientSession::counts().joins;
  if (walls_.empty() || walls_of_ != hash || (hash == 0 && walls_since_ != joins)) {
    std::vector<TriangleMesh> meshes;
    std::vector<double> friction;
    for (const PartMesh& part : parts()) {
      TriangleMesh& mesh = meshes.emplace_back(TriangleMesh{{}, part.mesh.triangles});
      for (const MeshVertex& vertex : part.mesh.vertices) mesh.vertices.push_back(vertex.rest);
      friction.push_back(part.friction);
    }
    walls_.push_back(std::make_unique<const PartWalls>(meshes, friction, welcome().tool, welcome().coupling_n_m));
    walls_of_ = hash;
    walls_since_ = joins;
  }
  haptic_.meet(walls_.back().get(), now + kServerSilenceMost);
}

/// Notes that our server was heard.
void ClientCore::hear(Micros now) {
  meet_parts(now);
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
  tool_released_ = beat.released;
  if (!contact_in_reach_) pause_.interrupt();
  if (beat.renewed_from != 0) renew(beat, now);
  server_report_ = beat.link;
  in_use_ = beat.in_use;
  pace_.take(beat.link, now);
  if (!(beat.rate_hz > 0)) return;
  server_pace_.rate_min_hz = server_pace_.rate_hz > 0 ? std::min(server_pace_.rate_min_hz, beat.rate_hz) : beat.rate_hz;
  server_pace_.rate_hz = beat.rate_hz;
  server_pace_.behind = beat.behind;
  server_pace_.behind_max = std::max(server_pace_.behind_max, beat.behind);
}

/// A hand that refuses guidance does not rely on the server's relaying none.
void ClientCore::take_guidance(const Guidance& guidance, Micros now) {
  if (guidance.guides ? hello().guides != guidance.partner : refuses_guidance_) return;
  guidance_ = guidance;
  guidance_at_ = now;
  const bool willing = guidance.hand == GuidanceHand::ready || guidance.hand == GuidanceHand::holds;
  haptic_.hear({guidance.stamp, guidance.position, guidance.reach, willing});
}

GuidanceStatus ClientCore::guidance(Micros now) const {
  if (!guidance_ || now - guidance_at_ > kPartnerGone) return {};
  return {guidance_->partner, guidance_->guides, guidance_->hand, haptic_.guidance().hand};
}

GuidanceReport ClientCore::guidance_report() const {
  GuidanceReport report = haptic_.guidance();
  if (refuses_guidance_ && report.hand == GuidanceHand::ready && hello().guides.empty()) report.hand = GuidanceHand::refuses;
  return report;
}

/// Renews the patch in use, unless it is older than the oldest patch that the beat renews.
void ClientCore::renew(const Beat& beat, Micros now) {
  const std::uint32_t playing = intake_.playing();
  const bool meant = playing != 0 && static_cast<std::int32_t>(playing - beat.renewed_from) >= 0;
  if (!meant || beat.body_time > now + PatchIntake::kFutureMax) return;
  ++counts_.renewed;
  haptic_.renew_to(beat.body_time);
}

/// Ends the force until a patch arrives.
void ClientCore::stop_force() {
  vouched_ = false;
  pause_.interrupt();
  haptic_.server_until(Micros::min());
  guidance_.reset();
  haptic_.hear({});
  haptic_.meet(nullptr, Micros{});
}

std::size_t ClientCore::emit(std::span<std::byte> out, Micros now) {
  if (const auto size = emit_own(out, now)) return size;
  if (!joined()) return 0;
  if (send_due_)
    if (const auto size = emit_samples(out, now)) return size;
  if (std::exchange(beat_due_, false)) return emit_beat(out, now);
  return 0;
}

std::size_t ClientCore::emit_beat(std::span<std::byte> out, Micros now) {
  const GuidanceReport guidance = guidance_report();
  hand_said_ = guidance.hand;
  return say(Beat{.link = link_report(), .ticks_late = haptic_.late_ticks(), .guidance = guidance}, out, now);
}

/// Sends the oldest unsent samples, as many as fit, after some that were sent already: a lost datagram costs nothing. The
/// orientation of a point is for viewers alone: the last is enough.
std::size_t ClientCore::emit_samples(std::span<std::byte> out, Micros now) {
  const bool turns = welcome().turns;
  const auto most = static_cast<std::size_t>(welcome().jaws ? kMaxOpeningsPerDatagram
                                             : turns        ? kMaxTurnsPerDatagram
                                                            : kMaxSamplesPerDatagram);
  const SampleHistory<ToolSample>& history = intake_.history();
  while (unsent_ > 0) {
    const auto sent = history.size() - unsent_;
    constexpr std::size_t kLeastFresh = 8;
    const auto repeat = std::min({sent, static_cast<std::size_t>(pace_.repeat()), most - kLeastFresh});
    const auto fresh = std::min(unsent_, most - repeat);
    unsent_ -= fresh;
    Samples samples{{}, welcome().deadband > 0 ? intake_.playing() : 0, button_changes_};
    for (auto i = sent - repeat; i < sent + fresh; ++i) {
      samples.samples.push_back(history[i]);
      if (!turns && i + 1 < sent + fresh) samples.samples.back().orientation.reset();
      if (!welcome().jaws) samples.samples.back().opening = 0;
    }
    if (const auto size = say(std::move(samples), out, now)) return size;
  }
  send_due_ = false;
  return 0;
}

}  // namespace palpate
