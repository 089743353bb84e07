// Asking a server to put its body back to rest, until it has.
//
// A server counts its resets and says the count in its beats. Who wants one says which count it knows; the server resets when
// that is its own, and counts on. So a request that is repeated because the first was lost, or because the beat that answers it
// was, resets once; and so do two that were made at the same time.
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
  /// The server's count, as it says. One that has changed tells that the body was reset.
  void hear(std::uint16_t resets) {
    if (resets_ && *resets_ != resets) asked_ = false;
    resets_ = resets;
  }
  /// Another server, or another life of it: its count is not known yet.
  void forget() { resets_.reset(); }
  /// The count to send now, if it is time to.
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
