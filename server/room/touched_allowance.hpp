// Iterations of Newton's method that the steps with contact of a frame may take.
//
// A frame of n steps has N = 40 max(n, 5), ten times what hands take, and what frames before it left, up to 2 N in all: a body
// that snaps over under a tool takes more for a frame or two, a hand that jumps about inside it in every frame. A frame that
// begins again has N once more, up to 2 N, and N / 4, up to N / 2, each time after that. So however often the tools that cost too
// much are let go of one after another, and however many parts it is stepped in, a frame ends.
#pragma once

#include <algorithm>

namespace palpate {

class TouchedAllowance {
 public:
  /// A frame of this many steps begins.
  void begin(double steps) {
    frame_ = kAStep * std::max(kFewestSteps, steps);
    again_ = 0;
    add(1);
  }
  /// A part of it begins again.
  void begin_again() { add(again_++ == 0 ? 1 : kLater); }
  void take(double iterations) { left_ -= iterations; }
  double left() const { return left_; }

 private:
  static constexpr double kAStep = 40, kFewestSteps = 5;
  static constexpr double kFrames = 2;  // measured: a gallbladder that folds takes 370 and 219 of 200 in two frames
  static constexpr double kLater = 0.25;

  void add(double share) { left_ = std::min(left_ + share * frame_, kFrames * share * frame_); }

  double frame_ = 0, left_ = 0;
  int again_ = 0;
};

}  // namespace palpate
