// A room: one body and the stations that touch it. It turns a frame job into patches; it knows neither network nor clock.
//
// A frame moves the body from its present body time, in the server's clock, to its target t*, and describes it there:
//
//     M x'' = F(x, x') + sum_k B_k lambda_k,     x(t*), v(t*) -> a patch for each station that asks (patch_build.hpp)
//
// x, v 3 N [m], [m/s]; F of dynamics.hpp [N]; lambda_k [N] the force of tool k at its position h_k(t): in a touch by the contact
// law (contact_law.hpp) at a point of the skin, in a grasp the force that holds its node at the tool. h_k(t) comes from the
// samples (tool_track.hpp, tool_coupling.hpp). The caller (ServerCore) decides how far a frame advances and which samples it may
// use.
//
// A tool that does not touch gets a patch if it may meet the body before the next one, that is, if it is nearer to the surface
// than
//     |h'| tau + a tau^2 / 2 + 5 mm,     tau its horizon, a = kHandAccelerationMostMs2 (tool_prediction.hpp)
//
// A sphere of a tool whose other spheres touch is a contact of the patch if it is nearer than |h'| tau + 1 mm.
//
// A body that is reset is at rest from the beginning of that frame on, and no tool touches it. The force that a hand felt fades,
// and then its tool may touch again (tool_coupling.hpp); a grasp resumes where its node is in reach.
//
// A body in equilibrium (stillness.hpp) that no tool holds, touches or can reach within the frame sleeps: time passes and it
// stays exactly where it is. The frame in which a tool may reach it is stepped from its beginning.
//
// Steps that do not converge leave the last good shape, at rest and released, and no patches in that frame: FrameResult::failed.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/thread_pool.hpp"
#include "common/base/types.hpp"
#include "common/patch/nonlinear_terms.hpp"
#include "common/patch/patch.hpp"
#include "common/wire/shape_blocks.hpp"
#include "server/dynamics/stepper.hpp"
#include "server/reduction/build_phase.hpp"
#include "server/room/live_surface.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

struct StationJob {
  StationId id = 0;
  Scheme scheme = Scheme::port;
  int order = 0;                       ///< number of states requested, 0 = default
  StationId shadow_of = 0;             ///< if not 0: shares that station's tool, gets a patch, exerts no force
  Micros horizon{};                    ///< age that a patch will reach before the next one replaces it: latency + frame
  std::vector<ToolSample> samples;     ///< since the last frame, ascending, server clock; the last one may lie beyond the target
  Micros silence = kSilenceLeast;      ///< longest silence expected of its link between two patches
  double deadband = 0;                 ///< share of the force by which its patch may be wrong (deadband.hpp), 0 = none
  std::optional<Micros> playing = {};  ///< stamp of the patch that it is known to play, server clock
  bool wants_patch = true;             ///< false: its tool only exerts force in this frame
  std::optional<NeedleInBody> needle = {};  ///< where its needle begins, if its tool is not there yet
  std::uint32_t presses = 0;                ///< how often a button of its tool was pressed since it joined
  std::uint8_t held = 0;                    ///< number of its tool (Scene::tool_of()), not of one that shares another's
};

struct FrameJob {
  Micros begin{};                    ///< start, if the last frame ended earlier: nothing moved in between
  Micros target{};                   ///< simulate up to this time, server clock
  Micros frame{};                    ///< nominal length of a frame; a frame far behind schedule uses longer steps; 0 = never
  std::vector<StationJob> stations;  ///< a station that is missing has left: its tool is released
  bool reset = false;                ///< resets the body to rest at `begin` and releases all tools (stepped_body_tools.cpp)
  bool rollouts = true;     ///< steps the body ahead along predicted hand motions for nonlinear patches (state_prediction.hpp)
  bool may_sleep = true;    ///< false: the body is stepped in any case, for measurements
  bool shapes = false;      ///< fill FrameResult::positions
  std::uint8_t fields = 0;  ///< fill these of FrameResult::fields: bits of channels
  bool state = false;       ///< fill FrameResult::state
  bool asks_for(ShapeChannel field) const { return (fields & bit_of(field)) != 0; }
};

/// Changes of threads in a frame: stitches, knots, cuts, tears.
struct SutureNews {
  double torn_m = 0;                                                 ///< length that bites cut through the tissue
  std::uint32_t torn_out = 0;                                        ///< bites that left the body
  std::vector<std::string> tied = {}, cut = {}, drawn_through = {};  ///< names of sutures
  bool any() const { return torn_m > 0 || !tied.empty() || !cut.empty() || !drawn_through.empty(); }
};

struct StationFrame {
  StationId id = 0;
  std::optional<Patch> patch;                      ///< stamp in the server's clock; empty: out of reach, not wanted or failed
  NonlinearTerms terms;                            ///< terms of `patch`; without variables: none
  Vec3 tool = Vec3::Zero(), force = Vec3::Zero();  ///< at the stamp; force on the tool [N]
  Vec3 torque = Vec3::Zero();                      ///< on a tool with a body, about the tool point [N m]
  bool contact = false;
  std::optional<Micros> renewed_from = {};  ///< stamp from which on all patches sent to it are as good as `patch`
  Rotation turn = Rotation::Identity();     ///< of the tool, and the opening of its jaws, at the stamp
  double opening = 0;
  std::optional<NeedleInBody> needle = {};  ///< that is inside, if FrameJob::state
  bool released = false;                    ///< true: its tool cost too much, was released, and may not touch yet
};

struct FrameResult {
  Micros stamp{};  ///< time up to which the body was simulated, server clock
  std::vector<StationFrame> stations;
  std::vector<Vec3> positions;                            ///< of the surface vertices (all nodes) and of threads, if requested
  std::array<std::vector<float>, kShapeChannels> fields;  ///< of all nodes (nodal_fields.hpp), by channel, if requested
  std::shared_ptr<const BodySurface> surface;  ///< once the body was cut or tore; the two above are by its numbers then
  std::optional<BodyState> state;              ///< if requested
  /// Cuts and tears since the body was as its scene has it, from that body to that of `state`; null: none.
  std::shared_ptr<const std::vector<CutStep>> cuts;
  SutureNews sutures;
  std::size_t loose = 0;            ///< cells of pieces that a blade cut off in this frame, which are gone
  std::vector<StationId> released;  ///< stations whose tools were released because they cost too much
  int steps = 0, cut_steps = 0, newton_iterations = 0;
  bool failed = false;  ///< true if the step did not converge: no patches, the body was put back
  bool asleep = false;  ///< true if the body was not stepped, or need not be until a tool comes (stillness.hpp)
  // Measured by the caller that ran the job, 0 = not measured:
  Micros step_took{}, patches_took{}, rollouts_took{};  ///< the last is part of the second
};

/// Returns the starting position of a tool: the rest position of the attached node, or a point 20 mm above the top of the body.
Vec3 home_of(const Scene& scene);

class Room {
 public:
  explicit Room(const Scene& scene);
  /// Returns a new room of the same scene, with the bits of Room(scene): it copies what this one computed of the body at rest.
  Room at_rest() const;
  ~Room();
  Room(Room&&) noexcept;
  Room& operator=(Room&&) noexcept;

  /// Sets the body time at which the next frame starts, and releases all tools. Call it before the first run(), and when another
  /// server takes over the body.
  void start(Micros body_time);
  /// Restores a body: x and v of all nodes as FrameResult::state gave them, and side_by_side() of its history. Fixed nodes stay
  /// where the scene puts them, and no tool touches it. Call it before the first run(). Returns false if `relaxed` does not fit
  /// this body, which then starts as if it had just been deformed. `cuts`: FrameResult::cuts; x, v and `relaxed` are of the body
  /// that they make (CutBody::repeat()). `threads`: null: as the scene has them.
  bool resume(const Vector& x, const Vector& v, const Eigen::MatrixXf& relaxed = {}, const std::vector<CutStep>& cuts = {},
              std::shared_ptr<const SutureState> threads = nullptr);
  /// Runs one frame: simulate(), then build_patches().
  FrameResult run(const FrameJob& job);
  /// Advances the body; the result has everything but `stations`.
  FrameResult simulate(const FrameJob& job);
  /// Fills `result.stations` at the body's present state; none of them has a patch if the step failed.
  void build_patches(const FrameJob& job, FrameResult& result);
  /// Shares the steps of a large body among a thread pool, which must outlive the room.
  void use_threads(ThreadPool& pool);
  /// The inputs of a station's last patch, for measurements: the present body, the station's (first) port, the patch's modes.
  struct Origin {
    BodyState body;
    ToolPort port;
    Matrix modes;  ///< PatchModes::of_nodes()
  };
  /// Returns none for a station without a port.
  std::optional<Origin> origin(StationId id) const;
  /// Returns in one line which integrator moves the body, and why.
  const std::string& integrator() const;
  /// Sets a listener that is called when each part of build_patches() begins, for touches.
  void listen(std::function<void(BuildPhase)> listener);

 private:
  struct State;
  explicit Room(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace palpate
