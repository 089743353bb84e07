#include "server/core/tool_input.hpp"

#include <algorithm>

namespace palpate {

bool ToolInput::add(const Samples& samples, const ClockSync& clock, Micros body_time, Micros now) {
  if (clock.locked()) timeline_.forget_after(clock.to_peer(now) + kSampleAhead);
  const bool first = timeline_.empty();
  const auto age = first ? Micros{} : std::max(Micros{}, now - timeline_.newest());
  const auto before = heard_;
  for (const auto& sample : samples.samples) {
    const auto t = clock.locked() ? clock.from_peer(sample.t) : Micros::max();
    if (t > now + kSampleAhead) {
      ++counts_.samples_refused;
      continue;
    }
    if (!timeline_.add(sample, t)) continue;
    ++counts_.samples;
    if (t <= body_time) ++counts_.samples_late;
    heard_ = now;
    lag_ = std::max(Micros{}, now - timeline_.newest());
  }
  if (heard_ == before) return false;
  if (first)
    buffer_.begin(lag_, now);
  else
    buffer_.take(age, now);
  return true;
}

}  // namespace palpate
