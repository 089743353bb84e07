// How one direction of a session loses datagrams now: how many of the newest kWindow numbers are missing, and the longest run.
//
// The newest kGrace numbers are not judged: they may still come, out of order.
#pragma once

#include <bitset>
#include <cstdint>

#include "common/wire/messages.hpp"

namespace palpate {

class LossMeter {
 public:
  static constexpr int kWindow = 1024, kGrace = 16;

  /// A datagram with this number arrived. Duplicates and order do not matter; numbers may wrap around.
  void take(std::uint32_t seq);
  /// Fills in what is known of the losses; the rest of the report is left alone.
  void fill(LinkReport& report) const;
  void reset() { *this = LossMeter{}; }

 private:
  std::bitset<kWindow> seen_;  ///< bit k: number newest_ - k came
  std::uint32_t newest_ = 0;
  int known_ = 0;  ///< numbers between the first that came and the newest, kWindow at most
};

}  // namespace palpate
