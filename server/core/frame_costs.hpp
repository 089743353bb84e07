// What frames cost lately: the body's step, a linear patch, a nonlinear one, and the rollouts that the nonlinear ones of a frame
// share. Means of the last eight or so that were measured, known from the third on: the least of three is where they begin, as
// the first frames of a touch are slower than those that follow, and one that something else holds up counts for no more than
// four times the mean.
//
// What is not done any more may cost something else by now, as the hand is elsewhere: its figure is halved every kForgotten, so
// that it is tried again some time.
#pragma once

#include "common/base/types.hpp"

namespace palpate {

class FrameCosts {
 public:
  static constexpr Micros kForgotten{30'000'000};

  /// What a frame built and the time that it took together, of that for rollouts (0: there were none).
  struct Patches {
    Micros took{}, rollouts{};
    int linear = 0, nonlinear = 0;
  };
  void take_step(Micros took);
  /// `passed`: since the frame before.
  void take_patches(const Patches& patches, Micros passed);

  // 0 = not known.
  Micros step() const { return step_.known(); }
  Micros linear() const { return linear_.known(); }
  Micros nonlinear() const { return nonlinear_.known(); }
  Micros rollouts() const { return rollouts_.known(); }
  // From the first one on:
  Micros linear_so_far() const { return linear_.so_far(); }
  Micros nonlinear_so_far() const { return nonlinear_.so_far(); }

 private:
  static constexpr int kFirst = 3;
  struct Mean {
    double mean_s = 0;
    int taken = 0;
    void take(double sample_s);
    void forget(Micros passed);
    Micros so_far() const { return from_seconds(mean_s); }
    Micros known() const { return taken < kFirst ? Micros{} : from_seconds(mean_s); }
  };
  Mean step_, linear_, nonlinear_, rollouts_;
};

}  // namespace palpate
