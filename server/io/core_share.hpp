// Share of a processor core that the frames of a room get: processor time over wall time, averaged over about the last second of
// computing,
//
//     share = sum_k e_k p_k / sum_k e_k w_k,     e_k = exp(-(w_(k+1) + ... + w_n) / kOver)
//
// with the processor time p_k and the wall time w_k of frame k. A slow room with a core to itself has too large a body; a slow
// room with only a part of a core is starved by other load on the machine.
#pragma once

#include <algorithm>
#include <cmath>

#include "common/base/types.hpp"

namespace palpate {

class CoreShare {
 public:
  static constexpr Micros kOver{1'000'000};
  static constexpr double kStarvedBelow = 0.8;  ///< an undisturbed core gives 0.97 and more

  void add(Micros processor, Micros wall) {
    const double stays = std::exp(-seconds(wall) / seconds(kOver));
    processor_s_ = stays * processor_s_ + seconds(processor);
    wall_s_ = stays * wall_s_ + seconds(wall);
  }
  /// 0 to 1; 1 before the first frame.
  double share() const { return wall_s_ > 0 ? std::clamp(processor_s_ / wall_s_, 0.0, 1.0) : 1.0; }
  bool starved() const { return share() < kStarvedBelow; }

 private:
  double processor_s_ = 0, wall_s_ = 0;
};

}  // namespace palpate
