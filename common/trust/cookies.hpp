// Cookies of a server: a stateless proof that a client receives at its address.
//
//     cookie = BLAKE2b-128(R; address, port, index)          R: a secret, new every `lasts`; the one before it is valid too
#pragma once

#include "common/base/types.hpp"
#include "common/trust/channel_wire.hpp"

namespace palpate {

inline constexpr Micros kCookieLasts{120'000'000};

class Cookies {
 public:
  explicit Cookies(DrawBytes draw, Micros lasts = kCookieLasts) : draw_(std::move(draw)), lasts_(lasts) {}
  Mac cookie_for(const ChannelAddress& from, std::uint32_t index, Micros now);
  bool fits(Bytes cookie, const ChannelAddress& from, std::uint32_t index, Micros now);

 private:
  void renew(Micros now);

  DrawBytes draw_;
  Micros lasts_;
  SecretKey newest_, before_;
  Micros drawn_{};
  bool begun_ = false;
};

}  // namespace palpate
