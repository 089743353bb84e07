// A body that tears (server/room/tears.hpp) and tools that move as they are told: what they do, and what the body keeps of it.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/dynamics/integrator.hpp"
#include "server/room/live_cuts.hpp"

namespace palpate {

class PulledBody {
 public:
  using Motion = std::function<ToolAt(const ToolPort& port, double time_s)>;
  PulledBody(Scene scene, std::vector<ToolPort> ports, Motion motion);
  PulledBody(const PulledBody&) = delete;
  PulledBody& operator=(const PulledBody&) = delete;
  /// Moves on, and lets the body tear then. Returns true if it did. Throws std::runtime_error without an equilibrium.
  bool frame(double length_s);

  double time_s() const { return state_.time_s; }
  /// Length of the next frame, as of a room of 20 Hz.
  double due_s() const { return cuts_.due_s(); }
  const Scene& scene() const { return scene_; }
  const BodyState& state() const { return state_; }
  const std::vector<ToolPort>& ports() const { return ports_; }
  double work_j() const { return work_j_; }  ///< of the tools
  double energy_j() const { return dynamics_->energy(state_); }
  int cells() const { return cells_; }  ///< that have torn
  /// Largest change of the energy where a row parted, as a share of it, and of the momentum over the mass [m/s].
  double energy_jump() const { return energy_jump_; }
  double velocity_jump_m_s() const { return velocity_jump_m_s_; }

 private:
  Vec3 momentum() const;

  Scene scene_;
  Motion motion_;
  Skin skin_;
  std::unique_ptr<NeedleTissue> tissue_;
  std::optional<Dynamics> dynamics_;
  BodyState state_, at_rest_;
  std::vector<ToolPort> ports_;
  std::optional<Integrator> integrator_;
  LiveCuts cuts_;
  double work_j_ = 0, energy_jump_ = 0, velocity_jump_m_s_ = 0;
  int cells_ = 0;
};

/// A body whose nodes are held by grips: `grips` is where a node goes that was at rest there.
PulledBody gripped(Scene scene, const std::vector<std::uint32_t>& held,
                   std::function<Vec3(const Vec3& rest, double time_s)> grips);

/// A bar along x, held at its far end, with a cut of `cut_m` along its middle: two arms. `more`: of its body.
struct DoubleCantilever {
  static constexpr double kArmM = 0.02, kBroadM = 0.02, kLongM = 0.16, kYoungPa = 200000, kToughnessJM2 = 2;
};
Scene double_cantilever(double spacing_m, double cut_m, const std::string& more = "", const std::string& element = "hexahedron");
/// Displacements by a small force on each arm's end, and their distance.
struct OpenedArms {
  Vector u;
  double apart_m = 0;
};
OpenedArms opened_arms(const Dynamics& dynamics, double force_n);
/// Its arms are held at their ends, and are this far apart.
PulledBody pulled_arms(double spacing_m, double cut_m, const std::function<double(double)>& apart_m,
                       const std::string& more = "");

}  // namespace palpate
