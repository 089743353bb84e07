#include "client/core/client_session.hpp"

#include <algorithm>
#include <utility>

namespace palpate {

ClientSession::ClientSession(Hello hello, Micros now) : hello_(std::move(hello)), heard_(now), answered_(now), next_hello_(now) {}

ClientSession::Event ClientSession::advance(Micros now) {
  if (left_) return Event::none;
  const bool lost = link_ == LinkState::joined && now - heard_ >= kLostAfter;
  if (lost) {
    join_again(now);
    leave_due_ = true;
  }
  if (link_ != LinkState::joined && now >= next_hello_) {
    hello_due_ = true;
    next_hello_ = now + (link_ == LinkState::refused ? kRetryEvery : kHelloEvery);
  }
  return lost ? Event::ended : Event::none;
}

Micros ClientSession::deadline() const {
  if (left_) return Micros::max();
  return link_ == LinkState::joined ? std::min(heard_ + kLostAfter, parts_.deadline()) : next_hello_;
}

void ClientSession::leave() {
  leave_due_ = link_ == LinkState::joined;
  hello_due_ = false;
  left_ = true;
}

ClientSession::Event ClientSession::receive(std::span<const std::byte> bytes, Message& message, Micros now) {
  ++counts_.received;
  counts_.bytes_received += bytes.size();
  if (left_) return Event::none;
  if (const auto fault = decode(bytes, message); fault != WireFault::none) {
    note_fault(fault);
    const bool came = fault == WireFault::patch_refused && is_ours(message) && sent_.has(message.clock.echo);
    return came ? Event::unusable : Event::none;
  }
  const auto* const welcome = std::get_if<Welcome>(&message.body);
  const auto* const refusal = std::get_if<Refuse>(&message.body);
  if (!welcome && !refusal && !is_ours(message)) {
    ++counts_.stale;
    return Event::none;
  }
  if (!sent_.has(message.clock.echo)) {
    ++counts_.unproven;
    return Event::none;
  }
  answered_ = now;
  sent_away_ = refusal && refusal->reason == RefuseReason::shutting_down;
  if (welcome) return receive_welcome(message, *welcome, now);
  if (refusal) return receive_refuse(message, *refusal, now);
  hear(now);
  clock_.take(message.clock, now);
  if (const auto* beat = std::get_if<Beat>(&message.body)) reset_.hear(beat->resets);
  if (const auto* piece = std::get_if<PartPiece>(&message.body)) parts_.take(*piece);
  return Event::message;
}

void ClientSession::note_fault(WireFault fault) {
  ++counts_.dropped[static_cast<std::size_t>(fault)];
  if (fault != WireFault::version || link_ == LinkState::joined) return;
  link_ = LinkState::refused;
  refusal_ = {RefuseReason::version, "the server speaks another wire version than " + std::to_string(kWireVersion)};
}

bool ClientSession::is_ours(const Message& message) const {
  return link_ == LinkState::joined && message.instance == instance_ && message.station == station_;
}

void ClientSession::hear(Micros now) {
  heard_ = now;
  unproven_before_ = counts_.unproven;
}

ClientSession::Event ClientSession::receive_welcome(const Message& message, const Welcome& welcome, Micros now) {
  if (link_ == LinkState::joined) {
    // A second answer to a repeated Hello, or one from an earlier run of the server.
    if (is_ours(message))
      hear(now);
    else
      ++counts_.stale;
    return Event::none;
  }
  const bool resumes = message.instance == instance_ && message.station == station_;
  if (!resumes) {
    clock_ = ClockSync{};
    reset_.forget();
    seq_out_ = 0;
  }
  instance_ = message.instance;
  station_ = message.station;
  welcome_ = welcome;
  parts_.expect(welcome.parts, welcome.scene_hash);
  // If the server assigned a name, the client requests that name when it joins again.
  if (welcome_.station.empty())
    welcome_.station = hello_.station;
  else
    hello_.station = welcome_.station;
  refusal_ = {};
  link_ = LinkState::joined;
  ++counts_.joins;
  hello_due_ = false;
  hear(now);
  clock_.take(message.clock, now);
  return resumes ? Event::resumed : Event::joined;
}

ClientSession::Event ClientSession::receive_refuse(const Message& message, const Refuse& refusal, Micros now) {
  const bool unknown = refusal.reason == RefuseReason::unknown_station;
  if (link_ == LinkState::joined) {
    // A restarted server does not know us under its new instance number; every other refusal must come from ours.
    const bool ours = message.station == station_, ends = ours && (unknown || sent_away_);
    if (ours && (ends || reset_.pending())) refusal_ = refusal;
    if (ends)
      join_again(now);
    else
      ++counts_.stale;
    return ends ? Event::ended : ours ? Event::denied : Event::none;
  }
  if (unknown || message.station != 0) {
    ++counts_.stale;
    return Event::none;
  }
  link_ = LinkState::refused;
  refusal_ = refusal;
  next_hello_ = std::max(next_hello_, now + kRetryEvery);
  return Event::none;
}

void ClientSession::join_again(Micros now) {
  // The server answers another session in our name: make it forget that one.
  leave_due_ = counts_.unproven > unproven_before_;
  link_ = LinkState::joining;
  next_hello_ = now;
}

std::size_t ClientSession::emit_own(std::span<std::byte> out, Micros now) {
  if (std::exchange(leave_due_, false)) return say(Leave{}, out, now);
  if (std::exchange(hello_due_, false)) return say(hello_, out, now);
  if (!joined()) return 0;
  if (const auto resets = reset_.due(now)) return say(Reset{*resets}, out, now);
  const auto piece = parts_.due(now);
  return piece ? say(MeshRequest{*piece}, out, now) : 0;
}

std::size_t ClientSession::say(Payload body, std::span<std::byte> out, Micros now) {
  const Message message{instance_, station_, seq_out_, clock_.stamp(now), std::move(body)};
  const auto size = encode(message, out);
  if (size == 0) return 0;
  sent_.add(now);
  ++seq_out_;
  ++counts_.sent;
  counts_.bytes_sent += size;
  return size;
}

}  // namespace palpate
