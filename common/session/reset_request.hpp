// A client's request for a reset of the server's body, repeated until it is done.
//
// A server counts its resets and sends the count in its beats. A request carries the count that the client knows; the server
// resets when that equals its own, and increments it. So a request that is repeated, because it or the beat that answers it was
// lost, resets once; and so do two requests made at the same time.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "common/base/types.hpp"

namespace palpate {

class ResetRequest {
 public:
  static constexpr Micros kEvery{100'000};

  void ask() { asked_ = true; }
  bool pending() const { return asked_; }
  /// Processes the count in a beat. A changed count means that the body was reset.
  void hear(std::uint16_t resets) {
    if (resets_ && *resets_ != resets) asked_ = false;
    resets_ = resets;
  }
  /// Forgets the count: another server, or a restarted one.
  void forget() { resets_.reset(); }
  /// Returns the count to send now, if a request is due.
  std::optional<std::uint16_t> due(Micros now) {
    if (!asked_ || !resets_ || now < next_) return std::nullopt;
    next_ = now + kEvery;
    return resets_;
  }

 private:
  bool asked_ = false;
  std::optional<std::uint16_t> resets_;
  Micros next_{};
};

}  // namespace palpate
