#include "common/session/loss_meter.hpp"

#include <algorithm>

namespace palpate {

void LossMeter::take(std::uint32_t seq) {
  const auto step = known_ == 0 ? 1 : static_cast<std::int32_t>(seq - newest_);
  if (step > 0) {
    seen_ = step < kWindow ? seen_ << static_cast<std::size_t>(step) : std::bitset<kWindow>{};
    seen_.set(0);
    newest_ = seq;
    known_ = std::min(kWindow, step < kWindow ? known_ + step : kWindow);
  } else if (-static_cast<std::int64_t>(step) < known_) {
    seen_.set(static_cast<std::size_t>(-static_cast<std::int64_t>(step)));
  }
}

void LossMeter::fill(LinkReport& report) const {
  int lost = 0, run = 0, longest = 0;
  for (int k = kGrace; k < known_; ++k) {
    run = seen_[static_cast<std::size_t>(k)] ? 0 : run + 1;
    lost += run > 0;
    longest = std::max(longest, run);
  }
  report.judged = static_cast<std::uint16_t>(std::max(0, known_ - kGrace));
  report.lost = static_cast<std::uint16_t>(lost);
  report.longest_run = static_cast<std::uint16_t>(longest);
}

}  // namespace palpate
