// Interface of the integrators, which advance a body with tools on it in time.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "common/base/thread_pool.hpp"
#include "common/base/tool_shape.hpp"
#include "common/patch/contact_law.hpp"
#include "common/patch/onset.hpp"
#include "server/body/dynamics.hpp"
#include "server/body/needle_tissue.hpp"

namespace palpate {

/// Part of a needle that a port is; its ports are consecutive, the tip first, then the shaft at each point of its path.
enum class NeedlePart : std::uint8_t { none, tip, shaft };
struct NeedlePort {
  NeedlePart part = NeedlePart::none;
  const NeedleTissue* tissue = nullptr;             ///< that outlives the port
  std::shared_ptr<const NeedlePath> path;           ///< outside: that which it would take, if known
  NeedleTip tip;                                    ///< also of the shaft's ports, at the begin of a step
  int point = 0;                                    ///< shaft: j
  double bond_m = 0;                                ///< shaft: u_j
  Vec3 axis = Vec3::UnitZ(), edge = Vec3::UnitX();  ///< z and x of the tool's frame at the end of the stage
};

struct ToolPort {
  ContactKind kind = ContactKind::touch;
  std::uint32_t node = 0;        ///< attach
  ContactParameters parameters;  ///< touch
  std::uint32_t tool = 0;        ///< of which this is a part; its own number where tools are points
  bool body = false;             ///< true: one sphere of the tool's body (tool_shape.hpp), at whose centre the tool is
  ToolSphere sphere;             ///< touch
  bool touching = false;         ///< touch
  std::uint8_t skin_copy = 0;    ///< touch: number of the skin's copy for its contact radius (skin.hpp)
  SurfacePoint point;            ///< touch: material point in contact, or the nearest one seen last
  Vec3 lambda = Vec3::Zero();    ///< force on the body [N]; for attach what the tool has to push with
  Clearance clearance;           ///< touch: while it does not
  NeedlePort needle;
  std::optional<std::uint32_t> suture = {};  ///< thread whose end the tool holds: its force is that of Dynamics, at `bite`
  std::shared_ptr<const NodeWeights> bite;   ///< the last of the thread
  /// Returns true if it is not on the surface, but on a needle's path in the body or at the bite of a thread.
  bool on_path() const { return needle.part == NeedlePart::shaft || needle.tip.inside || suture; }
  /// Returns true if its contact with the body is closed in each step.
  bool in_contact() const { return kind == ContactKind::touch && touching && !suture; }
  /// Returns the lowest point of the sphere around `centre` over a surface with this normal.
  Vec3 lowest(const Vec3& centre, const Vec3& normal) const { return centre - sphere.radius_m * normal; }
};

struct ToolAt {
  Vec3 position = Vec3::Zero();                     ///< [m]
  Vec3 velocity = Vec3::Zero();                     ///< [m/s]
  Vec3 axis = Vec3::UnitZ(), edge = Vec3::UnitX();  ///< z and x of the tool's frame
};
/// Position and velocity of tool `port` at body time `time_s`.
using ToolMotion = std::function<ToolAt(std::size_t port, double time_s)>;

struct AdvanceReport {
  int steps = 0, cut_steps = 0, newton_iterations = 0, solver_iterations = 0, factorisations = 0;
  int touched_iterations = 0;  ///< those of Newton's method in steps with contact
  double needed_share = 1;     ///< of the springs, on average: the others rested
  bool converged = true;       ///< false: contacts that contradict each other, or not even a damped step stayed in the world,
                               ///< or it was given up, as tools cost too much; the state is the last good one, at its time

  AdvanceReport& operator+=(const AdvanceReport& next);
};

/// A contact that no hand could hold has gone wrong: more than kMostN, or more than kFarN with `gap_m`, from the tool to its
/// point, beyond kFarSpacings times `spacing_m`, the mean length of an element.
inline bool is_lost(const ToolPort& port, double gap_m, double spacing_m) {
  constexpr double kFarSpacings = 3, kFarN = 20, kMostN = 200;
  const double force_n = port.lambda.norm();
  return force_n > kMostN || (force_n > kFarN && gap_m > kFarSpacings * spacing_m);
}

/// Sets lambda of every port that holds a node: what its tool has to push with.
void find_holding_forces(const Dynamics& dynamics, const BodyState& state, std::vector<ToolPort>& ports);
/// 1 for every node that is fixed or held by an attached port.
std::vector<std::uint8_t> held_nodes(const LumpedBody& body, const std::vector<ToolPort>& ports);

class Stepper {
 public:
  virtual ~Stepper() = default;
  /// Moves `state` and `ports` on to body time `until_s`, in steps of `step_s` at most.
  virtual AdvanceReport advance(BodyState& state, std::vector<ToolPort>& ports, double until_s, double step_s,
                                const ToolMotion& tools) = 0;
  /// Returns one of the same kind for the body of another Dynamics of the same scene. `dynamics` and `skin` must outlive it.
  virtual std::unique_ptr<Stepper> anew(const Dynamics& dynamics, const Skin& skin) const = 0;
  /// True if advance() leaves nothing behind that the next one could tell, first guesses of solves aside: rollouts may then
  /// use it.
  virtual bool is_stateless() const { return false; }
  /// Forces that may be left out of balance, in total [N], in regions where nothing happens and which need not be computed then;
  /// 0, as at first: none. Explicit integrators of large bodies do so.
  virtual void set_quiescence_tolerance(double most_n) { (void)most_n; }
  /// Bounds the iterations of Newton's method that steps with contact may take in each advance(), which then gives up before its
  /// next step; at first nothing does. Explicit steps take none, those that replace them do.
  virtual void allow_touched(double most_iterations) = 0;
  /// Lets it share its work with a thread pool, which must outlive it. Not all do, and none for small bodies; what they compute
  /// is the same.
  virtual void use_threads(ThreadPool& pool) { (void)pool; }
};

}  // namespace palpate
