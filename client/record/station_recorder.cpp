#include "client/record/station_recorder.hpp"

#include <fmt/format.h>

#include <utility>

namespace palpate {

void StationRecorder::event(Micros t, RecordedEventKind kind, const std::string& text) {
  RecordedEvent event;
  event.t = t;
  event.kind = kind;
  event.text = text;
  if (kind == RecordedEventKind::joined) event.tool.name = tool_;
  writer_.add(event);
}

void StationRecorder::hold(Micros t, const Orientation& orientation, double opening, std::uint32_t buttons) {
  const bool turned = orientation && (!orientation_ || orientation->coeffs() != orientation_->coeffs());
  const bool opened = opening != std::exchange(opening_, opening);
  if (turned || opened) writer_.add(RecordedTurn{t, 0, orientation.value_or(Rotation::Identity()), opening});
  orientation_ = orientation;
  if (buttons != std::exchange(buttons_, buttons)) writer_.add(RecordedButtons{t, 0, buttons});
}

void StationRecorder::datagram(const ClientCore& core, std::span<const std::byte> bytes, Micros now) {
  const ClientCounts& counts = core.counts();
  const std::uint64_t refused = counts.dropped[static_cast<std::size_t>(WireFault::patch_refused)];
  const bool taken = std::exchange(patch_bytes_, counts.patch_bytes) != counts.patch_bytes;
  const bool not_taken = std::exchange(refused_, refused) != refused;
  if (taken || not_taken) writer_.add(RecordedPacket{now, {bytes.begin(), bytes.end()}});
  if (not_taken) event(now, RecordedEventKind::refused, "a patch");
  if (now < next_links_ || core.link() != LinkState::joined) return;
  next_links_ = now + kLinksEvery;
  const RttStats& rtt = core.clock().rtt();
  writer_.add(RecordedLink{now, 0, rtt.mean, rtt.min, rtt.jitter, core.haptic().horizon(), core.clock().offset(),
                           core.loss().received, core.loss().lost});
}

void StationRecorder::look(LinkState link, const Welcome& welcome, const std::string& refusal, const ServerPace& pace,
                           Micros now) {
  const LinkState before = std::exchange(link_, link);
  if (link == LinkState::joined && before != link)
    event(now, RecordedEventKind::joined, fmt::format("scene {} at {:g} Hz", welcome.scene, welcome.rate_hz));
  if (link == LinkState::joining && before == LinkState::joined) event(now, RecordedEventKind::silent, "the server");
  if (link == LinkState::refused && std::exchange(refusal_, refusal) != refusal) event(now, RecordedEventKind::refused, refusal);
  const bool slow = link == LinkState::joined && pace.slow(welcome.rate_hz);
  if (slow != std::exchange(slow_, slow))
    event(now, slow ? RecordedEventKind::overrun : RecordedEventKind::kept_up,
          slow ? fmt::format("{:.1f} of {:g} frames a second, {:.0f} ms behind", pace.rate_hz, welcome.rate_hz,
                             1e3 * seconds(pace.behind))
               : "");
  writer_.tick(now);
}

}  // namespace palpate
