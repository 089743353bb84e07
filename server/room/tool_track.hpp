// The path of one tool in body time, from the samples that came so far: linear between samples, still after the last.
#pragma once

#include <deque>
#include <span>

#include "server/body/integrator.hpp"

namespace palpate {

class ToolTrack {
 public:
  bool empty() const { return samples_.empty(); }
  Micros begin() const { return samples_.front().t; }
  const Vec3& last() const { return samples_.back().position; }
  /// Ascending; a sample that is not newer than the last one is left out.
  void add(std::span<const ToolSample> samples);
  /// Position, and velocity of the segment that ends at or contains `t`; zero before the first and after the last sample.
  ToolAt at(Micros t) const;
  /// Forgets what no call of at() from `t` on needs.
  void forget_before(Micros t);

 private:
  std::deque<ToolSample> samples_;
};

}  // namespace palpate
