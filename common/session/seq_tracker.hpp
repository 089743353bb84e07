// Loss statistics of one direction of a session, from the sequence numbers that arrived.
#pragma once

#include <cstdint>

namespace palpate {

struct SeqCounts {
  std::uint64_t received = 0;    ///< datagrams without duplicates
  std::uint64_t lost = 0;        ///< missing between the first and the highest; decreases when one arrives late
  std::uint64_t late = 0;        ///< arrived after a younger one
  std::uint64_t duplicates = 0;  ///< arrived before; detected among the last 64 numbers
};

class SeqTracker {
 public:
  /// Notes that a datagram with this number arrived. Returns true when it is younger than all before. Numbers may wrap around.
  bool take(std::uint32_t seq);
  const SeqCounts& counts() const { return counts_; }
  void reset() { *this = SeqTracker{}; }

 private:
  bool take_late(std::uint32_t age);

  std::uint32_t highest_ = 0;
  std::uint64_t seen_ = 0;  ///< bit k: highest_ - k was received
  std::uint64_t expected_ = 0;
  SeqCounts counts_;
};

}  // namespace palpate
