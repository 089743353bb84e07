// Current losses of one direction of a session: the number of missing ones among the newest kWindow numbers, and the longest run.
//
// The newest kGrace numbers are not judged: they may still arrive out of order.
#pragma once

#include <bitset>
#include <cstdint>

#include "common/wire/messages.hpp"

namespace palpate {

class LossMeter {
 public:
  static constexpr int kWindow = 1024, kGrace = 16;

  /// Notes that a datagram with this number arrived. Duplicates and order do not matter; numbers may wrap around.
  void take(std::uint32_t seq);
  /// Fills in the known losses; the rest of the report is unchanged.
  void fill(LinkReport& report) const;
  void reset() { *this = LossMeter{}; }

 private:
  std::bitset<kWindow> seen_;  ///< bit k: number newest_ - k arrived
  std::uint32_t newest_ = 0;
  int known_ = 0;  ///< numbers between the first one received and the newest, kWindow at most
};

}  // namespace palpate
