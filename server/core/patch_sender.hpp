// What a frame's result becomes on the wire for the stations: patches with their terms and parity, or beats.
//
// A patch is stamped, on its way out, in the clock of the station it goes to: for a station's own samples that is the exact
// inverse of the mapping they came by (timeline.hpp). A shadow lives in the process of the station whose tool it shares and gets
// its stamps through the timeline of that station.
//
// In place of a patch goes a beat where no contact is in reach, where the patch would say no more than those that the station has
// (deadband.hpp: the beat says from which one on), and where the newest sample is older at the stamp than the patch is valid for:
// the force fades as if nothing came from here either, and comes back with the samples.
//
// Each patch goes as often as the station's losses ask for (link_said.hpp). One with terms goes once, as the one before it, which
// has terms too, is nearly as good: there is little to lose, and much to send; its pieces are followed by their parity where the
// link loses more than kPatchesLost. Beside patches a station hears every kLinkReportEvery how link and room do, and at once when
// the room falls behind or keeps up again.
#pragma once

#include "server/core/frame_scheduler.hpp"
#include "server/core/server_options.hpp"
#include "server/core/station.hpp"

namespace palpate {

inline constexpr double kSlowBelow = 0.95;  ///< of the frame rate: a room that has time for less says so to its stations

/// What a station is told in its clock when it gets nothing else.
Beat beat_for(const Stations& stations, const Station& station, const BodyNow& body);

class PatchSender {
 public:
  explicit PatchSender(const ServerOptions& options) : rate_hz_(options.rate_hz), deadband_(options.deadband) {}

  /// A frame is done: something waits for every station that is no viewer.
  void take(FrameResult& result, Stations& stations, const BodyNow& body, Micros now);
  /// There is no frame: all are told how the body does, viewers too.
  void beat_all(Stations& stations, const BodyNow& body);
  /// The station plays the patch of this seq, 0: none that we know.
  void heard_playing(Station& station, std::uint32_t seq) const;
  /// Bytes of the next datagram for the station, 0 when there is none.
  std::size_t emit(const Stations& stations, Station& station, std::span<std::byte> out, Micros now);
  /// To all stations that were ever here.
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
  BodyNow body_;  ///< as it was told last
  PatchCounts counts_;
};

}  // namespace palpate
