// What a checker of the simulated world sees, and what it says. It judges from outside: what the hand felt, what crossed the
// wire, what the counters say; never what a core thinks of itself.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bench/world/world.hpp"

namespace palpate {

struct Violation {
  Micros at{};        ///< world time
  std::string check;  ///< which one
  std::string what;   ///< who, what was seen, what was expected
};

/// One haptic tick of one station.
struct SeenTick {
  Micros now{}, own{};  ///< world time, the station's own clock
  std::size_t station = 0;
  Vec3 position = Vec3::Zero();
  TickOutput out;
};

/// What a station that just joined is given: for its clock, and for the way of a grasped node to the tool.
inline constexpr Micros kSettleAfterJoin{1'000'000};

/// What a station may do and when it is disturbed; the run works it out from the scenario.
struct StationBounds {
  std::string name;
  bool feels = true;         ///< ticks at all (not a viewer)
  bool pushes = true;        ///< its tool is its own
  bool port = true;          ///< it feels the scheme `port`
  bool true_at_rest = true;  ///< with as many states as truth at rest takes
  bool lets_go = false;      ///< nobody holds the device in the end: it comes to rest where the body calms it
  bool unmoved = true;       ///< by another hand: alone on the body, or no hand there gives way to what it feels
  std::size_t owner = 0;     ///< whose tool it feels with: itself, but for a shadow
  GuardLimits limits;        ///< of the device, whatever the station was told
  Micros future_max = PatchIntake::kFutureMax;  ///< that a patch in use may be ahead of the station's clock
  Micros sent_age_max{};                        ///< age of a patch when it leaves the server, at most
  Micros down_max{};                            ///< slowest way of a datagram towards the station
  Micros frames{};                              ///< from one patch to the next, at most
  Micros healed{}, recovered{}, at_rest{};  ///< nothing is lost any more; it must feel the body again; hand and force stand still
  std::vector<std::pair<Micros, Micros>> disturbed;  ///< from a fault's begin until it must have recovered

  // The run keeps these up to date.
  Micros joined = Micros::max();  ///< when it joined last
  bool outside = false;  ///< its tool was beyond where a datagram may say that it is: let go of, it may glide on for ever

  /// Joined, in the world and undisturbed for long enough: what is promised to a station in order holds.
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
  /// `message` is what the datagram says, decoded: as delivered, and as sent by the server; none where it cannot be read.
  virtual void datagram(Micros, const DatagramEvent&, const Message*) {}
  /// The server begins a frame, with what it knows now.
  virtual void frame(Micros) {}
  /// A new process of the station.
  virtual void new_life(Micros, std::size_t) {}
  virtual void new_server(Micros) {}
  virtual void end(Micros) {}

  const std::string& name() const { return name_; }
  /// How often there was something to judge: a check that never judges proves nothing.
  std::uint64_t judged() const { return judged_; }
  /// The first violation, if there was one.
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
