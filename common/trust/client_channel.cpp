#include "common/trust/client_channel.hpp"

#include <algorithm>
#include <utility>

namespace palpate {

ClientChannel::ClientChannel(const ClientKeys& keys, std::uint16_t version, DrawBytes draw, Micros now, const ChannelTimes& times)
    : keys_(keys), version_(version), draw_(std::move(draw)), times_(times), heard_(now), next_begin_(now) {
  std::array<std::uint8_t, 8> session;
  draw_(session);
  session_ = number_at(session);
}

std::uint32_t ClientChannel::draw_number() {
  std::array<std::uint8_t, 4> bytes;
  draw_(bytes);
  return static_cast<std::uint32_t>(number_at(bytes));
}

void ClientChannel::begin(Micros now) {
  const std::uint32_t index = draw_number();
  std::array<std::uint8_t, kInitBytes> init{};
  const BytesOut out(init);
  put_head(out, ChannelKind::init, index);
  NoiseInitiator noise(keys_.self, keys_.server, draw_secret(draw_), out.first(kHeadBytes));
  const auto payload = pack_init({version_, session_, ++attempts_, keys_.token});
  handshake_.reset();
  next_begin_ = now + kBeginEvery;
  if (!noise.write(payload, out.subspan(kHeadBytes, kInitSigned - kHeadBytes))) return;  // not a valid public key
  const Mac mac1 = mac1_of(keys_.server, init);
  std::copy(mac1.begin(), mac1.end(), init.begin() + kInitSigned);
  handshake_.emplace(Handshake{noise, index, init, now, now, now, 0});
  hinted_ = false;
}

bool ClientChannel::wants_keys(Micros now) const {
  if (!current_ || hinted_ || now >= too_old()) return true;
  return asked_ && now - heard_ >= kChannelSilence;
}

Micros ClientChannel::too_old() const { return current_->born() + (confirmed_ ? times_.rekey : times_.stop); }

void ClientChannel::tick(Micros now) {
  if (old_ && now >= old_until_) old_.reset();
  const bool over = handshake_ && now - handshake_->begun >= kAttemptLasts;
  if (over || (!handshake_ && now >= next_begin_ && wants_keys(now))) begin(now);
}

std::size_t ClientChannel::emit(BytesOut out, Micros now) {
  if (!paths_.empty()) {
    const PathText path = paths_.front();
    paths_.pop_front();
    if (ready(now)) return current_->seal(path, out, ChannelKind::path);
  }
  if (!handshake_ || now < handshake_->next_send || out.size() < kInitBytes) return 0;
  handshake_->next_send = now + kInitEvery;
  handshake_->cookies = 0;
  std::copy(handshake_->init.begin(), handshake_->init.end(), out.begin());
  ++counts_.inits;
  return kInitBytes;
}

Micros ClientChannel::deadline() const {
  if (handshake_) return std::min(handshake_->next_send, handshake_->begun + kAttemptLasts);
  if (!current_ || hinted_) return next_begin_;
  return std::max(next_begin_, asked_ ? std::min(too_old(), heard_ + kChannelSilence) : too_old());
}

std::size_t ClientChannel::seal(Bytes plain, BytesOut out, Micros now) {
  if (!ready(now)) return 0;
  asked_ = true;
  return current_->seal(plain, out);
}

std::size_t ClientChannel::take(Bytes datagram, Micros now, BytesOut plain) {
  const auto kind = kind_of(datagram);
  if (kind == ChannelKind::data) return take_data(datagram, now, plain);
  if (kind == ChannelKind::path && datagram.size() == kPathBytes) take_path(datagram, now);
  if (kind == ChannelKind::cookie && datagram.size() == kCookieBytes) take_cookie(datagram, now);
  if (kind == ChannelKind::resp && datagram.size() == kRespBytes) take_resp(datagram, now);
  if (kind == ChannelKind::hint && datagram.size() == kHintBytes) take_hint(datagram);
  return 0;
}

/// Draws one of the cookies since the last Init with equal probability: reservoir sampling of one.
void ClientChannel::take_cookie(Bytes datagram, Micros now) {
  if (!handshake_ || index_of(datagram) != handshake_->index) return;
  if (draw_number() % ++handshake_->cookies != 0) return;
  const Bytes cookie = datagram.last(kMacBytes);
  const BytesOut place = BytesOut(handshake_->init).last(kMacBytes);
  if (std::equal(cookie.begin(), cookie.end(), place.begin())) return;
  std::copy(cookie.begin(), cookie.end(), place.begin());
  if (now < handshake_->next_answer) return;
  handshake_->next_answer = now + kInitEvery;
  handshake_->next_send = now;
}

void ClientChannel::take_resp(Bytes datagram, Micros now) {
  if (!handshake_ || index_of(datagram) != handshake_->index) return;
  NoiseInitiator noise = handshake_->noise;  // a forged answer must not corrupt it
  std::array<std::uint8_t, 4> index;
  if (!noise.read(datagram.subspan(kHeadBytes), index)) {
    ++counts_.forged;
    return;
  }
  const NoiseKeys keys = noise.split();
  old_ = std::move(current_);
  old_until_ = now + times_.keep_old;
  current_.emplace(keys.up, keys.down, handshake_->index, static_cast<std::uint32_t>(number_at(index)), now);
  handshake_.reset();
  heard_ = now;
  hinted_ = asked_ = confirmed_ = false;
  ++counts_.handshakes;
}

void ClientChannel::take_hint(Bytes datagram) {
  if (!current_ || index_of(datagram) != current_->other_index()) return;
  ++counts_.hints;
  hinted_ = true;
}

bool ClientChannel::open(Bytes datagram, Micros now, BytesOut plain) {
  if (datagram.size() < kDataOverhead || datagram.size() > kMaxSealedBytes) return false;
  const std::uint32_t index = index_of(datagram);
  std::optional<Transport>& keys = current_ && current_->own_index() == index ? current_ : old_;
  if (!keys || keys->own_index() != index || !keys->usable(now, times_)) {
    ++counts_.unknown;
    return false;
  }
  bool newest = false;
  const OpenFault fault = keys->open(datagram, plain.first(datagram.size() - kDataOverhead), newest);
  counts_.replayed += fault == OpenFault::replayed;
  counts_.forged += fault == OpenFault::forged;
  if (fault != OpenFault::none) return false;
  if (&keys == &current_) confirmed_ = true;
  return true;
}

std::size_t ClientChannel::take_data(Bytes datagram, Micros now, BytesOut plain) {
  if (!open(datagram, now, plain)) return 0;
  heard_ = now;
  asked_ = false;
  ++counts_.opened;
  return datagram.size() - kDataOverhead;
}

void ClientChannel::take_path(Bytes datagram, Micros now) {
  PathText text;
  if (!open(datagram, now, text)) return;
  ++counts_.paths;
  if (paths_.size() < kMostPaths) paths_.push_back(text);
}

}  // namespace palpate
