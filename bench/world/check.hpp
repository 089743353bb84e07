// Interface of the checks of a simulated world. A check judges from outside: felt forces, datagrams on the wire, counters; never
// the internal state of a core.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bench/world/world.hpp"

namespace palpate {

struct Violation {
  Micros at{};        ///< world time
  std::string check;  ///< name of the check
  std::string what;   ///< station, observation, expectation
};

/// One haptic tick of one station.
struct SeenTick {
  Micros now{}, own{};  ///< world time, the station's own clock
  std::size_t station = 0;
  Vec3 position = Vec3::Zero();
  TickOutput out;
};

/// Time that a station gets after joining: for its clock, and for a grasped node to reach the tool.
inline constexpr Micros kSettleAfterJoin{1'000'000};

/// Bounds on a station and the times of its disturbances; the run derives them from the scenario.
struct StationBounds {
  std::string name;
  bool feels = true;         ///< has ticks at all (is no viewer)
  bool pushes = true;        ///< its tool is its own
  bool port = true;          ///< it feels the scheme `port`
  bool true_at_rest = true;  ///< its patches have as many states as accuracy at rest requires
  bool lets_go = false;      ///< nobody holds the device at the end: it comes to rest where the body calms it
  bool unmoved = true;       ///< no other hand moves it: it is alone on the body, or the others there do not react to forces
  std::size_t owner = 0;     ///< station whose tool it uses: itself, except for a shadow
  GuardLimits limits;        ///< limits of the device, whatever the station was configured with
  Micros future_max = PatchIntake::kFutureMax;       ///< largest lead of a patch in use over the station's clock
  Micros sent_age_max{};                             ///< largest age of a patch when it leaves the server
  Micros down_max{};                                 ///< largest delay of a datagram towards the station
  Micros frames{};                                   ///< longest interval between two patches
  Micros healed{}, recovered{}, at_rest{};           ///< end of losses; it must feel the body again; hand and force stand still
  std::vector<std::pair<Micros, Micros>> disturbed;  ///< from the begin of a fault until the station must have recovered

  // Updated by the run:
  Micros joined = Micros::max();  ///< time of its last join
  bool outside = false;  ///< true after its tool left the range that a datagram can represent: released, it may drift on for ever

  /// Returns true if the station has been joined, in range and undisturbed for long enough that all promises must hold.
  bool calm(Micros t) const {
    if (outside) return false;
    if (joined == Micros::max() || t < joined + kSettleAfterJoin + sent_age_max + down_max) return false;
    for (const auto& [begin, end] : disturbed)
      if (t >= begin && t <= end) return false;
    return true;
  }
};

class Check {
 public:
  explicit Check(std::string name) : name_(std::move(name)) {}
  virtual ~Check() = default;
  virtual void tick(const SeenTick&) {}
  /// `message` is the decoded content, of a datagram delivered or sent by the server; nullptr if it cannot be read.
  virtual void datagram(Micros, const DatagramEvent&, const Message*) {}
  /// The server begins a frame with what it has received so far.
  virtual void frame(Micros) {}
  /// A new process of the station has started.
  virtual void new_life(Micros, std::size_t) {}
  virtual void new_server(Micros) {}
  virtual void end(Micros) {}

  const std::string& name() const { return name_; }
  /// Number of judgements; a check that never judges proves nothing.
  std::uint64_t judged() const { return judged_; }
  /// First violation, if any.
  const std::vector<Violation>& violations() const { return violations_; }

 protected:
  void fail(Micros at, std::string what) {
    if (violations_.empty()) violations_.push_back({at, name_, std::move(what)});
  }

  void judge() { ++judged_; }

 private:
  std::string name_;
  std::uint64_t judged_ = 0;
  std::vector<Violation> violations_;
};

using Checks = std::vector<std::unique_ptr<Check>>;

}  // namespace palpate
