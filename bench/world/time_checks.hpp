// Checks of the timing of information.
//
//   causality   every delivered datagram was sent before, and carries as its stamp the sender's clock at that moment; no sample
//               in it is later than that; no patch in use is stamped later than the station's clock (PatchIntake::kFutureMax
//               allowed, the client's own bound); none is sent whose stamp exceeds the newest sample of its tool by more than its
//               validity; and a patch has the right tool position: patch.tool is the tool's path at the stamp, interpolated
//               between the samples that had come to the server, directly or brought by the attacker, when it began the frame
//   freshness   while a station is calm: a patch leaves the server at most sent_age_max old; the one in use is not older than the
//               newest that was delivered kNetWake ago (except one from the future, from a server whose clock stepped, and those
//               that came before or while the haptic thread stood still, or its clock stepped ahead); and once nothing is lost
//               any more, the one in use is at most sent_age_max + frames + down_max + kNetWake old, unless the server says that
//               no contact is in reach
#pragma once

#include <deque>
#include <optional>
#include <set>
#include <unordered_map>

#include "bench/world/check.hpp"

namespace palpate {

class CausalityCheck final : public Check {
 public:
  /// Rounding on the wire, and twice that of a microsecond at 1 m/s.
  static constexpr double kPlaceM = 2e-5;
  /// `compute` is the time from the beginning of a frame until its patches leave.
  CausalityCheck(const std::vector<StationBounds>& bounds, const World& world, Micros compute)
      : Check("causality"),
        bounds_(bounds),
        world_(world),
        compute_(compute),
        known_(bounds.size()),
        led_until_(bounds.size()),
        told_(bounds.size()) {}
  void tick(const SeenTick& seen) override;
  void datagram(Micros now, const DatagramEvent& event, const Message* message) override;
  void frame(Micros now) override;
  void new_life(Micros, std::size_t station) override;
  void new_server(Micros) override;

 private:
  struct Sent {
    Micros at{}, stamp{};  ///< world time, the sender's clock
    Micros newest{};       ///< time of the tool's newest sample that had come to the server; min(): none
  };
  struct Frame {
    Micros at{};
    std::uint64_t number = 0;
    std::vector<std::size_t> known;  ///< number of samples of each tool that the server had
  };
  const Frame* frame_at(Micros t) const;
  void check_tool(Micros now, std::size_t station, const Patch& patch, const Sent& sent);
  void check_place(Micros now, std::size_t station, const Patch& patch);

  const std::vector<StationBounds>& bounds_;
  const World& world_;
  Micros compute_;
  std::vector<std::vector<ToolSample>> known_;  ///< as the server accepts them: only newer ones
  std::vector<Micros> led_until_;               ///< in the clock of the tool's station
  std::deque<Frame> frames_;
  std::uint64_t frame_count_ = 1;
  std::vector<std::uint64_t> told_;  ///< number of the last frame that a patch for the tool belonged to
  std::unordered_map<std::uint64_t, Sent> sent_;
};

class FreshnessCheck final : public Check {
 public:
  static constexpr Micros kNetWake{3'000};
  FreshnessCheck(const std::vector<StationBounds>& bounds, const World& world)
      : Check("freshness"), bounds_(bounds), world_(world), seen_(bounds.size()) {}
  void tick(const SeenTick& seen) override;
  void datagram(Micros now, const DatagramEvent& event, const Message* message) override;
  void new_life(Micros, std::size_t station) override { seen_[station] = {}; }
  Micros oldest_calm() const { return oldest_; }  ///< largest age of a patch in use, over calm stations in reach of the body

 private:
  struct Arrived {
    Micros at{}, stamp{};
  };
  /// The newest patch that came, and the pieces that came of the newest terms: a patch waits for its own while that before it is
  /// more accurate, but not longer than PatchIntake::kBehindMost patches.
  struct Newest {
    std::uint32_t seq = 0, terms_seq = 0, whole_seq = 0;
    Micros stamp{};
    bool has_terms = false;
    std::set<std::uint8_t> pieces;
    std::size_t of = 0;
    bool is_whole() const { return !has_terms || (terms_seq == seq && pieces.size() == of); }
  };
  struct Station {
    Newest coming;
    std::deque<Arrived> arrived;   ///< that must be in use from then on
    std::optional<Micros> newest;  ///< stamp that must be in use
    bool in_reach = true;
    Micros ticked{};                                            ///< own clock
    Micros joined = Micros::max(), plays_from = Micros::max();  ///< own clock: it has no tool samples for older patches
  };
  const std::vector<StationBounds>& bounds_;
  const World& world_;
  std::vector<Station> seen_;
  std::unordered_map<std::uint64_t, Micros> sent_own_;  ///< receiver's clock at the time of sending
  Micros oldest_{};
};

}  // namespace palpate
