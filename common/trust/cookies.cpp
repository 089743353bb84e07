#include "common/trust/cookies.hpp"

#include <algorithm>

namespace palpate {
namespace {

Mac mac_with(const SecretKey& secret, const ChannelAddress& from, std::uint32_t index) {
  std::array<std::uint8_t, 16 + 2 + 4> text;
  std::copy(from.ip.begin(), from.ip.end(), text.begin());
  put_number(BytesOut(text).subspan(16, 2), from.port);
  put_number(BytesOut(text).subspan(18, 4), index);
  return keyed_mac(secret.bytes, text);
}

}  // namespace

void Cookies::renew(Micros now) {
  if (begun_ && now - drawn_ < lasts_) return;
  const bool recent = begun_ && now - drawn_ < 2 * lasts_;
  before_ = recent ? newest_ : draw_secret(draw_);
  newest_ = draw_secret(draw_);
  drawn_ = now;
  begun_ = true;
}

Mac Cookies::cookie_for(const ChannelAddress& from, std::uint32_t index, Micros now) {
  renew(now);
  return mac_with(newest_, from, index);
}

bool Cookies::fits(Bytes cookie, const ChannelAddress& from, std::uint32_t index, Micros now) {
  renew(now);
  return same_bytes(cookie, mac_with(newest_, from, index)) || same_bytes(cookie, mac_with(before_, from, index));
}

}  // namespace palpate
