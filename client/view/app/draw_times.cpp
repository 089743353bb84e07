#include "client/view/app/draw_times.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace palpate {

void DrawTimes::add(Micros begun, Micros drawn) {
  last_ = begun;
  processor_last_ = std::clock();
  if (took_.empty()) {
    first_ = begun;
    processor_first_ = processor_last_;
  }
  took_.push_back(drawn - begun);
}

std::string DrawTimes::summary(int drawn) const {
  if (took_.size() < 2) return "the window showed nothing";
  std::vector<Micros> sorted = took_;
  std::sort(sorted.begin(), sorted.end());
  const auto share_ms = [&](std::size_t percent) { return 1e3 * seconds(sorted[(sorted.size() - 1) * percent / 100]); };
  const double since_first = static_cast<double>(took_.size() - 1);
  const double processor_ms = 1e3 * static_cast<double>(processor_last_ - processor_first_) / CLOCKS_PER_SEC / since_first;
  return fmt::format(
      "{} pictures in {:.1f} s, {:.1f} a second, {} of them drawn anew; {:.1f} ms each, 99 of 100 at most {:.1f} ms, {:.1f} ms "
      "of processor time",
      took_.size(), seconds(last_ - first_), since_first / seconds(last_ - first_), drawn, share_ms(50), share_ms(99),
      processor_ms);
}

}  // namespace palpate
