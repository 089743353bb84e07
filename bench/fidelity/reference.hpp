// Reference force: the full nonlinear model of a scene, stepped at 1 kHz or finer along the tool's own path.
//
// It has the body, contact law and integrator of the server, at a step at which the integrator has converged (kFineStepS for
// bodies of up to kFineNodes nodes, one tick above). The body starts as the server's does: settled, with the tool coupled
// beforehand.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "server/scene/scene.hpp"

namespace palpate {

inline constexpr double kFineStepS = 0.0005, kTickStepS = 0.001;
inline constexpr std::size_t kFineNodes = 600;

/// The model, one millisecond at a time, for a tool whose path depends on the force.
class ReferenceModel {
 public:
  /// Tools begin at `tools`, one per station; `held`: their numbers in the scene (Scene::tool_of()), empty: all are the first.
  /// Throws what settled_state() throws.
  ReferenceModel(const Scene& scene, std::span<const Vec3> tools, std::span<const std::uint8_t> held = {});
  ~ReferenceModel();
  /// Advances to `tools`, held as `turns` (empty: upright) and opened by `openings` (empty: closed): to 0 ms at the first call, 1
  /// ms at the second, ... Throws std::runtime_error if the model cannot be stepped.
  void tick(std::span<const Vec3> tools, std::span<const Rotation> turns = {}, std::span<const double> openings = {});
  /// Copies the state of `at`, a model of the same scene with as many tools.
  void continue_from(const ReferenceModel& at);
  /// Puts the body back to rest, as a room does (tool_coupling.hpp).
  void reset();
  bool contact(std::size_t tool) const;
  Vec3 force(std::size_t tool) const;     ///< on the tool [N]
  NeedleTip tip(std::size_t tool) const;  ///< of a needle
  Vec3 torque(std::size_t tool) const;    ///< on a tool with a body, about the tool point [N m]
  double grip(std::size_t tool) const;    ///< on the opening of jaws (common/base/tool_shape.hpp) [N m]

 private:
  struct State;
  std::unique_ptr<State> state_;
};

struct ReferenceForce {
  std::vector<Vec3> force;  ///< on the tool, one entry per position [N]
  std::vector<std::uint8_t> contact;
  std::vector<Vec3> torque;         ///< about the tool point [N m]; empty for a tool that is a point
  std::vector<NeedleTip> tip = {};  ///< of a needle; empty for other tools
  std::vector<double> grip = {};    ///< on the opening of jaws [N m]; empty for other tools
};

/// Path of a tool: its positions at 0, 1, 2, ... ms; how it is held there, empty: upright; and the opening of its jaws, empty:
/// closed.
using ToolPath = std::vector<Vec3>;
using ToolTurns = std::vector<Rotation>;
using ToolOpenings = std::vector<double>;

/// Throws std::runtime_error if the model cannot be stepped.
ReferenceForce reference_force(const Scene& scene, const ToolPath& path, const ToolTurns& turns = {},
                               const ToolOpenings& openings = {});
/// Forces on several tools on one body, in the order of `paths` (and of `turns` and `openings`, if given), which are equally
/// long. `attach` has one node, so one tool. The body is reset at `resets`, ascending times into the paths. `progress` is called
/// every tick with the share of the paths that is done. `held`: as of ReferenceModel.
std::vector<ReferenceForce> reference_forces(const Scene& scene, std::span<const ToolPath> paths,
                                             std::span<const Micros> resets = {},
                                             const std::function<void(double)>& progress = {},
                                             std::span<const ToolTurns> turns = {}, std::span<const ToolOpenings> openings = {},
                                             std::span<const std::uint8_t> held = {});

/// Returns true if coupling the tool at `start` disturbs the body (it hangs in gravity, or the grasp begins off the node). Both
/// the server and the reference then get kSettle before the motion begins.
bool needs_settling(const Scene& scene, const Vec3& start);
inline constexpr Micros kSettle{5'000'000};

}  // namespace palpate
