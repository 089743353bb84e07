// A body and the tools on it in one process, in virtual time: what a program in another language uses in place of a server and a
// network. Room (server/room/room.hpp) computes; this class keeps the time and makes its jobs.
//
//     step      moves every tool along its poses at now + 1 ms, now + 2 ms, ..., and the body with them; then `now` is the
//               time of the last of them, and every tool has the force of the full model and, if wanted, a patch
//     patches   played by PatchPlayer (common/player/player.hpp) from `now` on, a tick of 1 ms at a time
//
// Units: metres, seconds, newtons, frame W; forces act on the tool. A new tool starts at the first of its poses, one without
// poses in a step is removed. A pose without orientation is that of a tool that stands upright. Nothing is drawn at random: the
// same calls give the same bits. Threads: one object, one thread at a time; objects share nothing.
#pragma once

#include <memory>
#include <set>
#include <span>
#include <string>

#include "common/wire/scheme_in_use.hpp"
#include "server/room/room.hpp"

namespace palpate {

/// Returns the scheme of this name; `where` names it in the error. Throws InputError for any other name.
Scheme scheme_named(const std::string& name, const std::string& where = "scheme");
/// The same with "auto", which is empty: the server chooses.
SchemeAsked scheme_asked(const std::string& name, const std::string& where = "scheme");

/// Longest step of a room and longest horizon of a patch [ticks].
inline constexpr std::size_t kMaxStepTicks = 1'000;

/// Throws InputError, with `where`, for a position that is not finite or outside the world, an orientation that is not of unit
/// length (kUnitLengthWithin), and an opening outside 0 to 1.
void check_pose(const ToolSample& pose, const std::string& where);

struct LocalTool {
  StationId id = 1;
  std::span<const ToolSample> path;  ///< poses at now + 1 ms, now + 2 ms, ...; their own times are not read
  std::string held = {};             ///< name of the scene's tool that it is from its first step on; empty: the first
};

struct LocalStep {
  bool patches = true;
  Scheme scheme = Scheme::hyper;
  int order = 0;            ///< number of states, 0 = the scheme's default
  Micros horizon{100'000};  ///< age that a patch will reach: it predicts the hand and the other tools as far as this
  bool shape = true;        ///< fill FrameResult::positions
};

class LocalRoom {
 public:
  /// The body at rest at 0 s. Throws what Room throws.
  explicit LocalRoom(const Scene& scene);

  /// Time of the body [us].
  Micros now() const { return now_; }
  /// Moves the tools, whose paths are equally long, and the body. The ids are at least 1 and differ. Throws InputError for paths
  /// of other lengths or none, for what check_pose() refuses, for a tool that the scene does not have, and for a second one in a
  /// grasp.
  FrameResult step(std::span<const LocalTool> tools, const LocalStep& options);
  /// Lets the body move without tools for `ticks` ms.
  FrameResult step_alone(std::size_t ticks, const LocalStep& options);
  /// Puts the body back to rest at the beginning of the next step; its last bits are not those of a new one.
  void reset() { reset_ = true; }
  /// Begins anew at 0 s, with the bits of LocalRoom(scene), in less time.
  void renew();
  /// Returns in one line which integrator moves the body, and why.
  const std::string& integrator() const { return room_.integrator(); }

 private:
  FrameResult run(FrameJob job);

  Room room_;
  Scene kinds_;  ///< its tools, without a body
  Micros now_{};
  bool reset_ = false;
  std::set<StationId> tools_;  ///< the tools of the last step
};

}  // namespace palpate
