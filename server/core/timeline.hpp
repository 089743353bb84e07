// One station's tool on the server's clock, and the way back from there into the station's own clock.
//
// Every sample is kept with both its times (t_station, t_server). Between neighbours the two clocks are related linearly, just
// as the tool moves linearly there, so an instant goes back exactly (to the microsecond) to where it came from, however the
// estimate of the clock offset moved meanwhile. Before the first and after the last sample that pair's offset holds.
#pragma once

#include <deque>
#include <vector>

#include "common/base/types.hpp"

namespace palpate {

class Timeline {
 public:
  static constexpr std::size_t kMost = 8192;  ///< samples kept at most, the oldest go first
  /// Of its station's clock, a quarter of a tick: what comes sooner after the one before is left out, as recordings and frames
  /// have to take all that is kept.
  static constexpr Micros kLeastApart{250};

  /// Appends a sample; t_server is raised where needed to stay ascending. False when the sample is not newer than the last
  /// (a repeat, or a late datagram): what a lost datagram left open stays open, the tool moves linearly there.
  bool add(Micros t_station, Micros t_server, const Vec3& position);
  /// Forgets what would be later than `t_station`: the clock of the station was not what it was taken for.
  void forget_after(Micros t_station);
  /// Forgets what is older than `t_server`, but never the last sample.
  void forget_before(Micros t_server);

  bool empty() const { return entries_.empty(); }
  std::size_t size() const { return entries_.size(); }
  Micros newest() const { return entries_.back().t_server; }  ///< server clock; not when empty

  /// From the server's clock into the station's. Not when empty.
  Micros to_station(Micros t_server) const;
  /// The newest sample not later than `after`, then all up to and with the first one at or beyond `target`, in the server's
  /// clock: what it takes to know the tool from `after` to `target`.
  std::vector<ToolSample> between(Micros after, Micros target) const;

 private:
  struct Entry {
    Micros t_station{}, t_server{};
    Vec3 position = Vec3::Zero();
  };
  std::deque<Entry> entries_;
};

}  // namespace palpate
