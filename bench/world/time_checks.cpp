#include "bench/world/time_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "client/guard/guard.hpp"
#include "client/intake/intake.hpp"
#include "server/room/tool_track.hpp"

namespace palpate {

using Kind = DatagramEvent::Kind;

void CausalityCheck::new_life(Micros, std::size_t station) {
  known_[station].clear();
  led_until_[station] = Micros{};
}

void CausalityCheck::new_server(Micros) {
  for (auto& known : known_) known.clear();
  frames_.clear();
}

void CausalityCheck::frame(Micros now) {
  constexpr std::size_t kKept = 256;
  frames_.push_back({now, frame_count_++, {}});
  for (const auto& known : known_) frames_.back().known.push_back(known.size());
  if (frames_.size() > kKept) frames_.pop_front();
}

/// Frame whose patches leave at t.
const CausalityCheck::Frame* CausalityCheck::frame_at(Micros t) const {
  for (auto frame = frames_.rbegin(); frame != frames_.rend(); ++frame)
    if (frame->at + compute_ <= t) return &*frame;
  return nullptr;
}

void CausalityCheck::tick(const SeenTick& seen) {
  const Micros most = bounds_[seen.station].future_max;
  if (seen.out.has_patch && seen.out.patch_stamp > seen.own + most)
    fail(seen.now, fmt::format("{} uses a patch of the future, stamped {} us ahead of its clock; at most {} are allowed",
                               bounds_[seen.station].name, (seen.out.patch_stamp - seen.own).count(), most.count()));
}

void CausalityCheck::datagram(Micros now, const DatagramEvent& event, const Message* message) {
  const StationBounds& bounds = bounds_[event.station];
  if (event.kind == Kind::sent) {
    const Micros stamp = event.to_server ? world_.station(event.station).clock(now) : world_.server_clock(now);
    const auto& known = known_[bounds.owner];
    const Sent& sent = sent_[event.number] = {now, stamp, known.empty() ? Micros::min() : known.back().t};
    if (const auto* patch = message ? std::get_if<PatchMessage>(&message->body) : nullptr) {
      check_tool(now, event.station, patch->patch, sent);
      check_place(now, event.station, patch->patch);
    }
    return;
  }
  const auto* samples = message ? std::get_if<Samples>(&message->body) : nullptr;
  const auto learn = [&](const ToolSample& s) {
    auto& known = known_[event.station];
    if (known.empty() || s.t > known.back().t) known.push_back(s);
  };
  if (event.kind == Kind::brought && event.to_server && samples) std::ranges::for_each(samples->samples, learn);
  if (event.kind != Kind::delivered) return;
  const auto sent = sent_.find(event.number);
  if (sent == sent_.end() || sent->second.at > now)
    return fail(now, fmt::format("a datagram of {} is delivered before it was sent", bounds.name));
  if (!message) return fail(now, fmt::format("a datagram of {} cannot be read", bounds.name));
  // A frame may be computed and leave in the same moment: the sender's clock and the stamp agree to the microsecond.
  if (message->clock.sent != sent->second.stamp)
    fail(now, fmt::format("a datagram of {} says that it was sent at {} us; its sender's clock was at {} us", bounds.name,
                          message->clock.sent.count(), sent->second.stamp.count()));
  if (!samples) return;
  for (const ToolSample& s : samples->samples) {
    if (s.t > sent->second.stamp) fail(now, fmt::format("{} sent a sample of its own future", bounds.name));
    learn(s);
  }
}

void CausalityCheck::check_tool(Micros now, std::size_t station, const Patch& patch, const Sent& sent) {
  if (!bounds_[station].pushes || sent.newest == Micros::min() || patch.stamp - sent.newest <= patch.valid_for) return;
  fail(now, fmt::format(
                "a patch for {} is stamped {} ms after the newest sample that the server had of its tool; it is valid for {} ms",
                bounds_[station].name, (patch.stamp - sent.newest) / Micros{1000}, patch.valid_for / Micros{1000}));
}

void CausalityCheck::check_place(Micros now, std::size_t station, const Patch& patch) {
  const StationBounds& bounds = bounds_[station];
  const auto& samples = known_[bounds.owner];
  const Frame* frame = frame_at(now);
  const std::size_t known = frame ? frame->known[bounds.owner] : 0;
  if (known == 0 || known > samples.size()) return;
  // The server did not wait for late samples: the tool was extrapolated, and is led back when they come. It may have done so in a
  // frame without a patch.
  const bool followed = frame->number <= told_[bounds.owner] + 1;
  told_[bounds.owner] = frame->number;
  if (!followed || patch.stamp > samples[known - 1].t) led_until_[bounds.owner] = patch.stamp + ToolTrack::kLeadBack;
  if (patch.stamp <= led_until_[bounds.owner]) return;
  if (!bounds.calm(now) || !bounds_[bounds.owner].calm(now)) return;
  judge();
  const auto end = samples.begin() + static_cast<std::ptrdiff_t>(known);
  const auto after = std::lower_bound(samples.begin(), end, patch.stamp, [](const ToolSample& s, Micros t) { return s.t < t; });
  if (after == end || after == samples.begin()) return;  // the server's beginning
  const auto before = after - 1;
  const double share = seconds(patch.stamp - before->t) / seconds(after->t - before->t);
  const Vec3 place = before->position + share * (after->position - before->position);
  const double off_m = (patch.tool - place).norm();
  if (off_m > kPlaceM)
    fail(now,
         fmt::format("a patch for {} stamped {} us has the tool {:.3g} mm from where it was then; at most {:g} mm are rounding",
                     bounds.name, patch.stamp.count(), 1e3 * off_m, 1e3 * kPlaceM));
}

void FreshnessCheck::datagram(Micros now, const DatagramEvent& event, const Message* message) {
  if (event.to_server) return;
  if (event.kind == Kind::sent) {
    sent_own_[event.number] = world_.station(event.station).clock(now);
    return;
  }
  if (event.kind != Kind::delivered || !message) return;
  Station& s = seen_[event.station];
  if (const auto* beat = std::get_if<Beat>(&message->body)) s.in_reach = beat->contact_in_reach;
  const StationBounds& bounds = bounds_[event.station];
  Newest& coming = s.coming;
  const auto is_due = [&] {
    if (coming.is_whole()) return true;
    return static_cast<std::int32_t>(coming.seq - coming.whole_seq) > PatchIntake::kBehindMost;
  };
  const auto note = [&] {
    if (!is_due()) return;
    if (coming.is_whole()) coming.whole_seq = coming.seq;
    if (coming.stamp >= s.plays_from && coming.stamp <= world_.station(event.station).clock(now) + bounds.future_max)
      s.arrived.push_back({now, coming.stamp});
  };
  if (const auto* piece = std::get_if<PatchTerms>(&message->body)) {
    if (static_cast<std::int32_t>(piece->patch_seq - coming.terms_seq) < 0) return;
    if (piece->patch_seq != coming.terms_seq) coming.pieces.clear();
    coming.terms_seq = piece->patch_seq;
    coming.of = piece->pieces;
    if (coming.pieces.insert(piece->piece).second && coming.terms_seq == coming.seq) note();
  }
  const auto* patch = std::get_if<PatchMessage>(&message->body);
  if (!patch) return;
  s.in_reach = true;
  if (static_cast<std::int32_t>(patch->patch.seq - coming.seq) > 0) {
    coming.seq = patch->patch.seq;
    coming.stamp = patch->patch.stamp;
    coming.has_terms = patch->patch.has_terms;
    note();
  }
  const Micros age = sent_own_[event.number] - patch->patch.stamp;
  if (bounds.calm(now) && age > bounds.sent_age_max)
    fail(now, fmt::format("a patch for {} left the server {} us old; expected at most {} us", bounds.name, age.count(),
                          bounds.sent_age_max.count()));
}

void FreshnessCheck::tick(const SeenTick& seen) {
  Station& s = seen_[seen.station];
  const StationBounds& bounds = bounds_[seen.station];
  if (bounds.joined != s.joined) {
    s.joined = bounds.joined;
    s.plays_from = seen.own;
    s.coming = {};  // its numbers begin anew
  }
  if (seconds(seen.own - std::exchange(s.ticked, seen.own)) > Guard::kGapMaxS) {
    s.newest.reset();
    s.arrived.clear();
  }
  while (!s.arrived.empty() && s.arrived.front().at + kNetWake <= seen.now) {
    s.newest = s.newest ? std::max(*s.newest, s.arrived.front().stamp) : s.arrived.front().stamp;
    s.arrived.pop_front();
  }
  if (!bounds.calm(seen.now) || !s.newest) return;
  judge();
  if (!seen.out.has_patch || seen.out.patch_stamp < *s.newest)
    fail(seen.now, fmt::format("{} uses {}, not the newest patch, stamped {} us, that came {} ms ago or earlier", bounds.name,
                               seen.out.has_patch ? fmt::format("that of {} us", seen.out.patch_stamp.count()) : "none",
                               s.newest->count(), kNetWake.count() / 1000));
  if (!s.in_reach) return;
  oldest_ = std::max(oldest_, seen.out.patch_age);
  const Micros most = bounds.sent_age_max + bounds.frames + bounds.down_max + kNetWake;
  if (seen.now >= bounds.healed && seen.out.patch_age > most)
    fail(seen.now, fmt::format("the patch in use at {} is {} us old, over a link that loses nothing; expected at most {} us",
                               bounds.name, seen.out.patch_age.count(), most.count()));
}

}  // namespace palpate
