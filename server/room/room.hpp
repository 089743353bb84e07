// A room: one body and the stations that touch it. It turns a frame job into patches; it knows neither network nor clock.
//
// A frame moves the body from where it is in body time, the server's clock, to its target t*, and describes it there:
//
//     M x'' = F(x, x') + sum_k B_k lambda_k,     x(t*), v(t*) -> a patch for each station that asks (patch_builder.hpp)
//
// x, v 3 N [m], [m/s]; F of dynamics.hpp [N]; lambda_k [N] what tool k pushes with where it is, h_k(t): of a touch by the contact
// law (contact_law.hpp) at a point of the skin, of a grasp what holds its node at the tool. h_k(t) comes from the samples
// (tool_track.hpp, grasp.hpp). The caller (ServerCore) decides how far a frame goes and which samples it may use.
//
// A tool that does not touch gets a patch where it may meet the body before the next one: nearer to the surface than
//     |h'| tau + a tau^2 / 2 + 5 mm,     tau its horizon, a = kHandAccelerationMostMs2 (tool_prediction.hpp)
//
// A body that is reset is at rest from the beginning of that frame on, and no tool touches it. What a hand felt fades,
// and then its tool may touch again (let_go.hpp); a grasp takes hold again where it is in reach.
//
// A body that is still (stillness.hpp), that no tool holds or touches, and that no tool can get to within the frame sleeps: time
// passes, it stays exactly where it is. The frame in which a tool may get to it is stepped from its beginning.
//
// Steps that do not converge leave the last good shape, at rest and let go of, and no patches in that frame: FrameResult::failed.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/thread_pool.hpp"
#include "common/base/types.hpp"
#include "common/port/nonlinear_terms.hpp"
#include "common/port/patch.hpp"
#include "common/wire/shape_blocks.hpp"
#include "server/body/stepper.hpp"
#include "server/reduce/patch_part.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

struct StationJob {
  StationId id = 0;
  Scheme scheme = Scheme::port;
  int order = 0;                       ///< states wanted, 0 = default
  StationId shadow_of = 0;             ///< not 0: shares that station's tool, gets a patch, does not push
  Micros horizon{};                    ///< age that a patch will reach before the next one takes over: latency + frame
  std::vector<ToolSample> samples;     ///< since the last frame, ascending, server clock; the last one may lie beyond the target
  Micros silence = kSilenceLeast;      ///< that its link may make between two patches
  double deadband = 0;                 ///< share of the force by which its patch may be wrong (deadband.hpp), 0 = none
  std::optional<Micros> playing = {};  ///< stamp of the patch that it is known to play, server clock
  bool wants_patch = true;             ///< else its tool only pushes in this frame
};

struct FrameJob {
  Micros begin{};                    ///< from here on, where the last frame ended earlier: nothing moved in between
  Micros target{};                   ///< simulate up to here, server clock
  Micros frame{};                    ///< nominal length of a frame; one that has fallen far behind takes longer steps, 0 = never
  std::vector<StationJob> stations;  ///< a station that is missing has left: its tool lets go
  bool reset = false;       ///< the body is put back to rest at `begin`, and every tool let go of (stepped_body_tools.cpp)
  bool rollouts = true;     ///< before nonlinear patches the body is stepped ahead as hands may move on (state_prediction.hpp)
  bool may_sleep = true;    ///< else the body is stepped whatever it does, to measure by
  bool shapes = false;      ///< fill FrameResult::positions
  std::uint8_t fields = 0;  ///< and these of FrameResult::fields: bits of channels
  bool state = false;       ///< fill FrameResult::state
  bool asks_for(ShapeChannel field) const { return (fields & bit_of(field)) != 0; }
};

struct StationFrame {
  StationId id = 0;
  std::optional<Patch> patch;                      ///< stamp in the server's clock; empty: none in reach, wanted or to be had
  NonlinearTerms terms;                            ///< that go with it; without variables: none
  Vec3 tool = Vec3::Zero(), force = Vec3::Zero();  ///< at the stamp; force on the tool [N]
  bool contact = false;
  std::optional<Micros> renewed_from = {};  ///< stamp from which on all patches that it was given do as well as `patch`
};

struct FrameResult {
  Micros stamp{};  ///< moment up to which the body was simulated, server clock
  std::vector<StationFrame> stations;
  std::vector<Vec3> positions;                            ///< of the surface vertices (all nodes), when asked for
  std::array<std::vector<float>, kShapeChannels> fields;  ///< of all nodes (nodal_fields.hpp), by channel, when asked for
  std::optional<BodyState> state;                         ///< when asked for
  std::vector<StationId> too_dear;                        ///< whose tools were let go of, as they cost more than hands do
  int steps = 0, cut_steps = 0, newton_iterations = 0;
  bool failed = false;  ///< the step did not converge: no patches, the body was put back
  bool asleep = false;  ///< the body was not stepped, or need not be from here on until a tool comes (stillness.hpp)
  // By whoever ran the job, 0 = not measured:
  Micros step_took{}, patches_took{}, rollouts_took{};  ///< the last is part of the second
};

/// Where a tool should start: rest position of the attached node, or a point 20 mm above the top of the body.
Vec3 home_of(const Scene& scene);

class Room {
 public:
  explicit Room(const Scene& scene);
  ~Room();
  Room(Room&&) noexcept;
  Room& operator=(Room&&) noexcept;

  /// Body time at which the next frame starts; call before the first run(), and when another server takes the body over: nobody
  /// touches it then.
  void start(Micros body_time);
  /// The body as it is to be taken up: x and v of all nodes as FrameResult::state gave them, and side_by_side() of its history.
  /// What the scene holds fast stays where the scene says. Nobody touches it then; before the first run(). False where `relaxed`
  /// is not of this body, which then begins as if it had just been bent.
  bool resume(const Vector& x, const Vector& v, const Eigen::MatrixXf& relaxed = {});
  /// One frame: simulate(), then build_patches().
  FrameResult run(const FrameJob& job);
  /// Moves the body on; the result has everything but `stations`.
  FrameResult simulate(const FrameJob& job);
  /// Fills `result.stations` at the body's present state; none of them has a patch when the step failed.
  void build_patches(const FrameJob& job, FrameResult& result);
  /// Lets a large body's steps be shared by a thread pool, which must outlive the room.
  void use_threads(ThreadPool& pool);
  /// What a station's last patch was made of, for measurement: the body as it is, the station's port, the patch's modes.
  struct Origin {
    BodyState body;
    ToolPort port;
    Matrix modes;  ///< PatchModes::of_nodes()
  };
  /// Nothing for a station that has no port.
  std::optional<Origin> origin(StationId id) const;
  /// Which integrator moves the body, and why, in one line.
  const std::string& integrator() const;
  /// Hears of each part of build_patches() when it begins, for touches.
  void listen(std::function<void(PatchPart)> listener);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace palpate
