// The last seconds of the plotted quantities: forces and patch ages, one series per station.
#pragma once

#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "common/wire/messages.hpp"

namespace palpate {

class History {
 public:
  static constexpr Micros kSpan{10'000'000};
  static constexpr Micros kStep{25'000};  ///< values closer in time than this are merged

  struct Point {
    Micros at{};
    float value = 0;
  };
  struct Series {
    std::string station;
    std::deque<Point> points;
  };

  void add(Micros now, const std::string& station, float value);
  /// Drops points older than kSpan, and stations without points.
  void forget(Micros now);
  const std::vector<Series>& series() const { return series_; }
  /// Largest value of all points, at least `floor`.
  float largest(float floor) const;

 private:
  std::vector<Series> series_;
};

}  // namespace palpate
