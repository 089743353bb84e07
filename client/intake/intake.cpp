#include "client/intake/intake.hpp"

#include <algorithm>

namespace palpate {

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
  if (leads_too_far(patch, now)) {
    ++counts_.jumped;
    return false;
  }
  last_seq_ = patch.seq;
  last_came_ = now;
  ++counts_.accepted;
  patch_ = patch;
  if (const auto terms = terms_.terms_for(patch_))
    hand_over(*terms);
  else if (before_is_truer(now))
    ++counts_.held_back;
  else
    hand_over({});
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

/// Returns true when the seq of a patch that is newer than the last one is too far ahead.
bool PatchIntake::leads_too_far(const Patch& patch, Micros now) const {
  constexpr double kSlack = 1.25;  // for clocks and late frames
  if (counts_.accepted == 0) return false;
  const Micros since = std::max({now - last_came_, patch.stamp - patch_.stamp, Micros{}});
  return static_cast<double>(patch.seq - last_seq_) > kJumpFree + kSlack * rate_hz_ * seconds(since);
}

void PatchIntake::catch_up(PatchPlayer& player) const {
  for (std::size_t i = history_.first_after(player.time()); i < history_.size(); ++i) player.advance(history_[i]);
}

void PatchIntake::hand_over(const NonlinearTerms& terms) {
  PatchPlayer& player = slot_.back();
  player = PatchPlayer(patch_, terms);
  catch_up(player);
  if (terms.variables > 0) {
    ++counts_.with_terms;
    compare(player);
    whole_ = player;
  }
  whole_plays_ = terms.variables > 0;
  playing_ = patch_.has_terms && terms.variables == 0 ? 0 : patch_.seq;
  slot_.publish();
}

bool PatchIntake::before_is_truer(Micros now) const {
  if (!whole_plays_ || !patch_.has_terms) return false;
  const std::int32_t behind = patches_behind();
  if (behind > kBehindMost || now - whole_->patch().stamp > whole_->patch().valid_for) return false;
  return before_error_n_ * behind <= linear_error_n_;
}

/// Returns the distance from the patch last handed over with its terms to the newest one.
std::int32_t PatchIntake::patches_behind() const { return static_cast<std::int32_t>(patch_.seq - whole_->patch().seq); }

void PatchIntake::compare(const PatchPlayer& whole) {
  if (!whole_ || patches_behind() > kBehindMost) return;
  constexpr double kShare = 0.125;
  PatchPlayer linear(patch_);
  catch_up(linear);
  catch_up(*whole_);
  const Vec3 force = whole.output().force;
  const double behind = std::max(1, patches_behind());
  before_error_n_ += kShare * ((whole_->output().force - force).norm() / behind - before_error_n_);
  linear_error_n_ += kShare * ((linear.output().force - force).norm() - linear_error_n_);
}

void PatchIntake::reset() {
  last_seq_ = playing_ = 0;
  counts_.accepted = 0;
  terms_.reset();
  whole_.reset();
  whole_plays_ = false;
}

}  // namespace palpate
