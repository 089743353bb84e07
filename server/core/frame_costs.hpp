// Recent costs of a frame's parts: the body's step, a linear patch, a nonlinear patch, and the rollouts that the nonlinear
// patches of a frame share. Each cost is a running mean over about eight measurements. It starts from the least of the first
// three, as the first frames of a touch are slower than later ones; an outlier counts as at most four times the mean. Before the
// third measurement the expected cost holds, if there is one; otherwise the cost is not known.
//
// The cost of a part that is no longer computed becomes outdated as the hand moves on, so it is halved every kForgotten, until
// the part is tried again.
#pragma once

#include "common/base/types.hpp"

namespace palpate {

class FrameCosts {
 public:
  static constexpr Micros kForgotten{30'000'000};

  /// Patches that a frame built and the time they took together; `rollouts` is the rollouts' part of that time (0: there were
  /// none).
  struct Patches {
    Micros took{}, rollouts{};
    int linear = 0, nonlinear = 0;
  };
  /// Costs measured before the first frame (server/io/frame_cost.hpp); 0 = not measured.
  struct Expected {
    Micros step{}, linear{}, nonlinear{}, rollouts{};
  };
  void expect(const Expected& costs);
  void take_step(Micros took);
  /// `passed` is the time since the frame before.
  void take_patches(const Patches& patches, Micros passed);

  // Mean costs; 0 = not known yet.
  Micros step() const { return step_.known(); }
  Micros linear() const { return linear_.known(); }
  Micros nonlinear() const { return nonlinear_.known(); }
  Micros rollouts() const { return rollouts_.known(); }
  // Mean costs from the first measurement on, before it those that are expected:
  Micros linear_so_far() const { return linear_.so_far(); }
  Micros nonlinear_so_far() const { return nonlinear_.so_far(); }

 private:
  static constexpr int kFirst = 3;
  struct Mean {
    double mean_s = 0, expected_s = 0;
    int taken = 0;
    void take(double sample_s);
    void forget(Micros passed);
    Micros so_far() const { return from_seconds(taken == 0 ? expected_s : mean_s); }
    Micros known() const { return from_seconds(taken < kFirst ? expected_s : mean_s); }
  };
  Mean step_, linear_, nonlinear_, rollouts_;
};

}  // namespace palpate
