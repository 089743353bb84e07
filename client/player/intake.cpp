#include "client/player/intake.hpp"

#include <algorithm>

namespace palpate {

SampleHistory::SampleHistory() : ring_(kSampleHistoryTicks) {}

void SampleHistory::add(const ToolSample& sample) {
  if (count_ < ring_.size()) {
    ring_[(first_ + count_++) % ring_.size()] = sample;
  } else {
    ring_[first_] = sample;
    first_ = (first_ + 1) % ring_.size();
  }
}

std::size_t SampleHistory::size() const { return count_; }
const ToolSample& SampleHistory::operator[](std::size_t age_from_oldest) const {
  return ring_[(first_ + age_from_oldest) % ring_.size()];
}

std::size_t SampleHistory::first_after(Micros t) const {
  std::size_t low = 0, high = count_;
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    if ((*this)[middle].t > t)
      high = middle;
    else
      low = middle + 1;
  }
  return low;
}

void SampleHistory::clear() { first_ = count_ = 0; }

bool PatchIntake::accept(const Patch& patch, Micros now) {
  if (counts_.accepted > 0 && static_cast<std::int32_t>(patch.seq - last_seq_) <= 0) {
    ++counts_.stale;
    return false;
  }
  const std::size_t begin = history_.first_after(patch.stamp);
  if (history_.size() > 0 && begin == 0) {
    ++counts_.too_old;
    return false;
  }
  if (patch.stamp > now + future_max_) {
    ++counts_.from_future;
    return false;
  }
  last_seq_ = patch.seq;
  ++counts_.accepted;
  patch_ = patch;
  const auto terms = terms_.terms_for(patch_);
  hand_over(terms ? *terms : CubicTerms{});
  return true;
}

bool PatchIntake::accept(const PatchTerms& piece) {
  if (!terms_.take(piece)) {
    ++counts_.stale_terms;
    return false;
  }
  if (counts_.accepted == 0 || (history_.size() > 0 && history_.first_after(patch_.stamp) == 0)) return true;
  if (const auto terms = terms_.terms_for(patch_)) hand_over(*terms);
  return true;
}

void PatchIntake::hand_over(const CubicTerms& terms) {
  PatchPlayer& player = slot_.back();
  player = PatchPlayer(patch_, terms);
  for (std::size_t i = history_.first_after(patch_.stamp); i < history_.size(); ++i) player.advance(history_[i]);
  slot_.publish();
  if (terms.variables > 0) ++counts_.bent;
}

void PatchIntake::reset() {
  last_seq_ = 0;
  counts_.accepted = 0;
  terms_.reset();
}

}  // namespace palpate
