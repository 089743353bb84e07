// Samples of one station's tool on the server's clock, with the mapping back to the station's own clock.
//
// Every sample is kept with both its times (t_station, t_server). Between neighbours the two clocks are related linearly, and the
// tool moves linearly, so an instant maps back exactly (to the microsecond) however the estimate of the clock offset changed
// meanwhile. Before the first and after the last sample, the offset of that sample holds.
#pragma once

#include <vector>

#include "common/base/sample_history.hpp"

namespace palpate {

class Timeline {
 public:
  static constexpr std::size_t kMost = 8192;  ///< most samples kept; the oldest are dropped first
  /// Least distance of two samples on the station's clock, a quarter of a tick. A sample that follows sooner is dropped, as
  /// recordings and frames have to hold all that is kept.
  static constexpr Micros kLeastApart{250};

  /// Appends a sample of the station's clock; t_server is raised if needed to stay ascending. Returns false if the sample is not
  /// newer than the last (a repeat or a late datagram): the gap of a lost datagram stays open, and the tool moves linearly across
  /// it.
  bool add(const ToolSample& sample, Micros t_server);
  /// Drops the samples later than `t_station`, after the station's clock turned out to be wrong.
  void forget_after(Micros t_station);
  /// Drops the samples that between() does not return from `t_server` on.
  void forget_before(Micros t_server) { entries_.forget_before(t_server); }

  bool empty() const { return entries_.empty(); }
  std::size_t size() const { return entries_.size(); }
  Micros newest() const { return entries_.newest().t; }                       ///< server clock; must not be empty
  const Vec3& newest_position() const { return entries_.newest().position; }  ///< must not be empty

  /// Converts server time to the station's clock. Must not be empty.
  Micros to_station(Micros t_server) const;
  /// Returns the newest sample not later than `after`, then all up to and including the first one at or beyond `target`, in the
  /// server's clock: the samples that define the tool's path from `after` to `target`.
  std::vector<ToolSample> between(Micros after, Micros target) const;

 private:
  struct Entry {
    Micros t{}, t_station{};  // t: on the server's clock
    Vec3 position = Vec3::Zero();
    Orientation orientation;
    double opening = 0;
  };
  SampleHistory<Entry> entries_{kMost};
};

}  // namespace palpate
