// Number of pictures that a window drew, and the cost of one: reported when it closes.
#pragma once

#include <ctime>
#include <string>
#include <vector>

#include "common/base/types.hpp"

namespace palpate {

class DrawTimes {
 public:
  void add(Micros begun, Micros drawn);
  /// Returns a line: pictures a second, the share of them in which the body or the camera moved, median and 99th percentile of
  /// the time of one, and the processor time of this program per picture over all its threads, i.e. the cost of software
  /// rendering to other programs.
  std::string summary(int drawn) const;

 private:
  std::vector<Micros> took_;
  Micros first_{}, last_{};
  std::clock_t processor_first_ = 0, processor_last_ = 0;
};

}  // namespace palpate
