// A recorded session as time series: motion and force of each hand, and what was written about it. Times are seconds since the
// recording's begin().
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
  Vec3 torque = Vec3::Zero();  ///< on a tool with a body, about the tool point [N m]; zero where a recording has none
};

struct SessionTurn {
  double t_s = 0;
  Rotation turn = Rotation::Identity();  ///< R_WT
  double opening = 0;
};

struct SessionHand {
  std::string name;
  std::vector<MotionPoint> path;     ///< ascending
  std::vector<SessionForce> forces;  ///< ascending
  std::vector<SessionTurn> turns{};  ///< ascending; empty if the device had no orientation
  std::string tool = {};             ///< name of the tool that it held when it joined last; empty: the scene's first
};

/// A time in which one hand guided another, with the mean forces of the coupling that the two reported.
struct SessionGuidance {
  std::string guide, guided;
  double from_s = 0, to_s = 0;
  double guide_force_n = 0, guided_force_n = 0;
  int reports = 0;
};

/// A remark of a person about a moment.
struct SessionNote {
  double t_s = 0;        ///< the moment
  double written_s = 0;  ///< when the server got it
  std::string author, text;
};

struct Session {
  std::vector<SessionHand> hands;          ///< in the order in which they first moved; a hand that rejoined continues its series
  std::vector<double> resets_s;            ///< resets of the body, ascending
  std::vector<SessionGuidance> guidances;  ///< in order of their beginnings
  std::vector<SessionNote> notes;          ///< in order of their moments
  std::size_t blocks_lost = 0;             ///< damaged blocks, whose content is unknown
};

Session read_session(const RecordingReader& recording);

/// Cuts a session to an interval; hands that did not move in it are omitted.
Session cut(Session session, double from_s, double to_s);

/// Returns the hands as motions over one interval, hand `which` first: from the first sample of any hand to the last. Before it
/// joined and after it left, a hand rests in its first and last pose. Throws InputError, with `name` for the recording, if a
/// hand has fewer than two samples or the session is longer than a motion can be.
std::vector<Motion> motions_of(const Session& session, std::size_t which, const std::string& name);
/// Per millisecond of those motions: 1 while hand `which` was present, that is between two samples at most kGoneS apart.
std::vector<std::uint8_t> presence_of(const Session& session, std::size_t which);
inline constexpr double kGoneS = 0.5;

/// Resets of the body, in the time of those motions.
std::vector<Micros> resets_of(const Session& session);

}  // namespace palpate
