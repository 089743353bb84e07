// How many pictures a window drew, and what one cost: said when it closes.
#pragma once

#include <ctime>
#include <string>
#include <vector>

#include "common/base/types.hpp"

namespace palpate {

class DrawTimes {
 public:
  void add(Micros begun, Micros drawn);
  /// In a line: pictures a second, in how many of them anything of the body or the camera moved, median and 99th percentile of
  /// the time of one, and the processor time of this program for each, of all its threads: what drawing in software takes from
  /// others.
  std::string summary(int drawn) const;

 private:
  std::vector<Micros> took_;
  Micros first_{}, last_{};
  std::clock_t processor_first_ = 0, processor_last_ = 0;
};

}  // namespace palpate
