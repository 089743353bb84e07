#include "common/trust/handshake_limits.hpp"

#include <algorithm>

namespace palpate {
namespace {

constexpr Micros kSweepEvery{1'000'000};

std::array<std::uint8_t, 16> prefix_of(const ChannelAddress& from) {
  constexpr std::array<std::uint8_t, 12> kIpv4{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff};
  auto prefix = from.ip;
  if (!std::equal(kIpv4.begin(), kIpv4.end(), prefix.begin())) std::fill(prefix.begin() + 8, prefix.end(), std::uint8_t{0});
  return prefix;
}

}  // namespace

double HandshakeLimits::Bucket::left_at(double rate, Micros now) const {
  return std::min(rate, left + rate * std::max(0.0, seconds(now - at)));
}

void HandshakeLimits::Bucket::fill(double rate, Micros now) {
  left = left_at(rate, now);
  at = now;
}

bool HandshakeLimits::Bucket::take(double rate, Micros now) {
  fill(rate, now);
  if (left < 1) return false;
  left -= 1;
  return true;
}

/// A prefix that may have all it wants is not remembered.
void HandshakeLimits::forget_full(Micros now) {
  if (now - swept_ < kSweepEvery) return;
  swept_ = now;
  std::erase_if(prefixes_, [&](const auto& entry) { return entry.second.left_at(kHandshakesPrefix, now) >= kHandshakesPrefix; });
}

bool HandshakeLimits::allow(const ChannelAddress& from, Neighbour lives, Micros now) {
  forget_full(now);
  all_.fill(kHandshakesAll, now);
  const bool shares = lives == Neighbour::none;
  if (shares && all_.left < 1) return false;
  const Prefix place = lives == Neighbour::session ? Prefix{from.ip, from.port} : Prefix{prefix_of(from), 0};
  const auto [prefix, fresh] = prefixes_.try_emplace(place, Bucket{kHandshakesPrefix, now});
  return prefix->second.take(kHandshakesPrefix, now) && (!shares || all_.take(kHandshakesAll, now));
}

}  // namespace palpate
