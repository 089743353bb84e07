// A recorded session as series over time: what each hand did and felt. Times are seconds since the recording's begin().
//
// A room's recording has the samples of every hand and the force at each frame; a station's has both at every tick.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/motion/motion.hpp"
#include "common/record/reader.hpp"

namespace palpate {

struct SessionForce {
  double t_s = 0;
  Vec3 force = Vec3::Zero();  ///< on the tool [N]
  bool contact = false;
};

struct SessionHand {
  std::string name;
  std::vector<MotionPoint> path;     ///< ascending
  std::vector<SessionForce> forces;  ///< ascending
};

struct Session {
  std::vector<SessionHand> hands;  ///< in the order in which they first moved; a hand that came back goes on
  std::vector<double> resets_s;    ///< of the body, ascending
  std::size_t blocks_lost = 0;     ///< damaged ones, of which nothing is known
};

Session read_session(const RecordingReader& recording);

/// What happened from one time to another; hands that did not move meanwhile are left out.
Session cut(Session session, double from_s, double to_s);

/// The hands as motions over one time, hand `which` first: from the first sample of any to the last of any. A hand rests where it
/// was first and last seen before it came and after it left. InputError, with `name` for the recording, when a hand was seen
/// less than twice or the session is longer than a motion can be.
std::vector<Motion> motions_of(const Session& session, std::size_t which, const std::string& name);
/// By millisecond of those motions: 1 where hand `which` was there, that is between two samples of at most kGoneS.
std::vector<std::uint8_t> presence_of(const Session& session, std::size_t which);
inline constexpr double kGoneS = 0.5;

/// When the body was put back to rest, in the time of those motions.
std::vector<Micros> resets_of(const Session& session);

}  // namespace palpate
