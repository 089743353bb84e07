// Turns a frame's result into messages for the stations: patches with their terms, or beats.
//
// A patch is stamped, when it is sent, in the clock of the station that receives it. For a station's own samples this is the
// exact inverse of the mapping of those samples (timeline.hpp). A shadow runs in the process of the station whose tool it shares
// and gets its stamps through that station's timeline.
//
// A beat replaces a patch in three cases: no contact is in reach; the patch would add nothing to those that the station has
// (deadband.hpp; the beat says from which one on); or the newest sample is older at the stamp than the patch's validity. In the
// last case the force fades as on any silence, and returns with the samples.
//
// Each patch is sent as often as the station's losses require (reported_link.hpp). A patch with terms is sent once, as it is
// large and the one before it, which has terms too, is nearly as good. In addition to patches, a station gets a report on link
// and room every kLinkReportEvery, and at once when the room falls behind or catches up.
#pragma once

#include "server/core/frame_scheduler.hpp"
#include "server/core/server_options.hpp"
#include "server/core/station.hpp"

namespace palpate {

inline constexpr double kSlowBelow = 0.95;  ///< share of the configured frame rate below which a room reports that it is slow

/// Beat for a station, in its clock, when no patch is due.
Beat beat_for(const Stations& stations, const Station& station, const BodyNow& body);

class PatchSender {
 public:
  explicit PatchSender(const ServerOptions& options) : rate_hz_(options.rate_hz), deadband_(options.deadband) {}

  /// Accepts a finished frame and queues a message for every station that is not a viewer.
  void take(FrameResult& result, Stations& stations, const BodyNow& body, Micros now);
  /// Queues a beat about the body for everyone, viewers included, when there is no frame.
  void beat_all(Stations& stations, const BodyNow& body);
  /// Notes that the station plays the patch with this seq; 0: none that we know.
  void heard_playing(Station& station, std::uint32_t seq) const;
  /// Writes the next datagram for the station; returns its bytes, 0 if there is none.
  std::size_t emit(const Stations& stations, Station& station, std::span<std::byte> out, Micros now);
  /// Counts over all stations that ever joined.
  const PatchCounts& counts() const { return counts_; }

 private:
  void beat(const Stations& stations, Station& station) const;
  void give(const Stations& stations, Station& station, StationFrame& frame, Micros now);
  void send_patch(const Stations& stations, Station& station, StationFrame& frame) const;
  void renew(const Stations& stations, Station& station, Micros stamp);
  bool is_lost(const Stations& stations, const Station& station, const StationFrame& frame) const;
  std::size_t emit_patch(const Stations& stations, Station& station, std::span<std::byte> out, Micros now);
  void count(Station& station, const PatchCounts& more);

  double rate_hz_, deadband_;
  BodyNow body_;  ///< last reported state
  PatchCounts counts_;
};

}  // namespace palpate
