// Leapfrog: second order, one evaluation of the forces a step, as long a step as is stable.
//
//     v*_n = v_(n-1/2) + h/2 a_(n-1)                       what the dampers see: second order too
//     a_n = M^-1 (F(x_n, v*_n) + B mean of lambda)
//     v_(n+1/2) = v_(n-1/2) + h a_n,   x_(n+1) = x_n + h v_(n+1/2)
//
// Positions and velocities are in step at both ends of advance(). A touching tool closes the contact law at the end of each step,
// where it has slid to by then (contact_law.hpp), with lambda_(n+1). On the body it is the mean
//     (1 - 3/4 s) lambda_(n+1) + s/2 lambda_n + s/4 lambda_(n-1),   s = min(1, 1 / (k_c h^2 b)),   b = B^T M^-1 B
// for s = 1 Newmark's average acceleration: stable however stiff the contact, and of first order still in a stroke as measured;
// but what is stiffer than a step would ring. With s = 0, of first order, it does not. So p_free is where the point would be
// without lambda_(n+1), and C = (1 - 3/4 s) h^2 b I. What of lambda is of before is where the point was. A node that a tool holds
// is where the tool is.
//
// A mode of frequency w and damping g (x'' = -w^2 x - g x') is stable as long as the matrix of one step has no eigenvalue outside
// the unit circle: h w < 2 without damping, h g < 1 where that rules. w^2 and g are those of spectrum.hpp, grown as
// ExplicitBody::growth() tells.
#pragma once

#include <optional>
#include <vector>

#include "server/body/explicit_stepper.hpp"
#include "server/body/spectrum.hpp"

namespace palpate {

/// Largest stable step of one mode [s]: w2 = w^2 [1/s^2], g [1/s].
double leapfrog_step_s(double w2, double g);

class ExplicitIntegrator final : public ExplicitStepper {
 public:
  static constexpr double kShare = 0.9;          ///< of the stable step that is used
  static constexpr double kResonantShare = 0.6;  ///< of one that may_resonate() and is strained far

  /// `dynamics` and `skin` must outlive it. ExplicitBody::covers() the body. `spectrum`: its own, where it is known.
  ExplicitIntegrator(const Dynamics& dynamics, const Skin& skin, const std::optional<Spectrum>& spectrum = {});
  /// That it takes at small strains [s].
  double step_s() const { return step_s_; }
  /// Whether it is a solid with hardly any dampers: far strained its stiffness swings as its modes do (parametric resonance), and
  /// steps that are stable for each of the stiffnesses that it passes through may together gain energy.
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
  std::vector<Vec3> before_;  // lambda_(n-1), a port; at the begin lambda_n
};

}  // namespace palpate
