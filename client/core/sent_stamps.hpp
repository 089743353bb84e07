// The send times of the newest datagrams [us]. Only a receiver of a datagram knows its time.
#pragma once

#include <array>
#include <cstddef>

#include "common/base/types.hpp"

namespace palpate {

class SentStamps {
 public:
  /// Largest number sent while a datagram travels, is echoed for the 3 s that a silent station is kept, and returns.
  static constexpr std::size_t kSentKept = 4096;

  void add(Micros sent) {
    newest_ = (newest_ + 1) % kSentKept;
    sent_[newest_] = sent;
    count_ += count_ < kSentKept;
  }
  bool has(Micros sent) const {
    for (std::size_t age = 0; age < count_; ++age)
      if (sent_[(newest_ + kSentKept - age) % kSentKept] == sent) return true;
    return false;
  }

 private:
  std::array<Micros, kSentKept> sent_{};
  std::size_t newest_ = 0, count_ = 0;
};

}  // namespace palpate
