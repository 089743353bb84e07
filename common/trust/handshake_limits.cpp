#include "common/trust/handshake_limits.hpp"

#include <algorithm>

namespace palpate {
namespace {

std::array<std::uint8_t, 16> prefix_of(const ChannelAddress& from) {
  constexpr std::array<std::uint8_t, 12> kIpv4{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff};
  auto prefix = from.ip;
  if (!std::equal(kIpv4.begin(), kIpv4.end(), prefix.begin())) std::fill(prefix.begin() + 8, prefix.end(), std::uint8_t{0});
  return prefix;
}

}  // namespace

double TokenBucket::left_at(double rate, Micros now) const {
  return std::min(rate, left_ + rate * std::max(0.0, seconds(now - at_)));
}

bool TokenBucket::take(double rate, Micros now) {
  left_ = left_at(rate, now);
  at_ = now;
  if (left_ < 1) return false;
  left_ -= 1;
  return true;
}

bool PlaceLimits::allow(const ChannelAddress& from, Neighbour lives, Micros now) {
  if (lives == Neighbour::session) return sessions_.take(from, kHandshakesKey, now);
  const bool shares = lives == Neighbour::none;
  if (shares && !all_.has(all_rate_, now)) return false;
  return prefixes_.take(prefix_of(from), prefix_, now) && (!shares || all_.take(all_rate_, now));
}

}  // namespace palpate
