// Leapfrog: second order, one evaluation of the forces per step, at nearly the largest stable step.
//
//     v*_n = v_(n-1/2) + h/2 a_(n-1)                       velocity for the dampers, also of second order
//     a_n = M^-1 (F(x_n, v*_n) + B mean of lambda)
//     v_(n+1/2) = v_(n-1/2) + h a_n,   x_(n+1) = x_n + h v_(n+1/2)
//
// Positions and velocities are synchronous at both ends of advance(). A touching tool applies the contact law at the end of each
// step, at the point that it has slid to (contact_law.hpp), which gives lambda_(n+1). The force on the body is the mean
//     (1 - 3/4 s) lambda_(n+1) + s/2 lambda_n + s/4 lambda_(n-1),   s = min(1, 1 / (k_c h^2 b)),   b = B^T M^-1 B
// With s = 1 that is Newmark's average acceleration: stable however stiff the contact, and of first order within a stroke as
// measured, but contacts that are too stiff for the step would ring. With s = 0, of first order, they do not. So p_free is the
// position of the point without lambda_(n+1), and C = (1 - 3/4 s) h^2 b I. Earlier values of lambda act at the earlier point. A
// node that a tool holds is at the tool.
//
// A mode of frequency w and damping g (x'' = -w^2 x - g x') is stable as long as the matrix of one step has no eigenvalue outside
// the unit circle: h w < 2 without damping, h g < 1 if damping dominates. w^2 and g are those of spectrum.hpp, multiplied by
// ExplicitBody::growth().
#pragma once

#include <optional>
#include <vector>

#include "server/body/explicit_stepper.hpp"
#include "server/body/spectrum.hpp"

namespace palpate {

/// Returns the largest stable step of one mode [s]: w2 = w^2 [1/s^2], g [1/s].
double leapfrog_step_s(double w2, double g);

class ExplicitIntegrator final : public ExplicitStepper {
 public:
  static constexpr double kShare = 0.9;          ///< share of the stable step that is used
  static constexpr double kResonantShare = 0.6;  ///< the same for a body that may_resonate() at large strains

  /// `dynamics` and `skin` must outlive it; ExplicitBody::covers() the body. `spectrum`: that of the body, if known.
  ExplicitIntegrator(const Dynamics& dynamics, const Skin& skin, const std::optional<Spectrum>& spectrum = {});
  /// Step at small strains [s].
  double step_s() const { return step_s_; }
  /// Returns true for a solid with hardly any damping: at large strains its stiffness oscillates with its modes (parametric
  /// resonance), and steps that are stable for each stiffness on the way may together gain energy.
  bool may_resonate() const {
    constexpr double kHardlyDamped = 0.1;  // w t / 2 of the fastest modes
    return hexahedra().size() > 0 && spectrum_.least_s < kHardlyDamped * step_s_;
  }

 private:
  Steps steps_for(double whole_s, double step_s, const std::vector<ToolPort>& ports) override;
  void go(const Steps& steps, std::vector<ToolPort>& ports, double begin_s, const ToolMotion& tools) override;
  void accelerate(const NodeArrays& velocity, const std::vector<ToolPort>& ports);
  void kick(double over_s);
  void step(std::vector<ToolPort>& ports, double begin_s, double h, const ToolMotion& tools);
  void close_contacts(std::vector<ToolPort>& ports, double end_s, double h, const ToolMotion& tools);
  bool share_nodes(const std::vector<std::size_t>& ports) const;
  void push(const Skin::Weights& b, const Vec3& lambda);

  Spectrum spectrum_;
  double step_s_ = 0;
  NodeArrays a_, predicted_;
  std::vector<Vec3> before_;  // lambda_(n-1), one per port; lambda_n at the begin
};

}  // namespace palpate
