// Stabilised explicit steps (chebyshev.hpp) for bodies whose dampers rule how long a step may be.
//
//     y = (u, v),   y' = (v, M^-1 (F(u, v) + B lambda))
//
// Dampers proportional to stiffness have rates g, the eigenvalues of M^-1 D, that grow as fast as w^2: leapfrog must take
// steps of 1 / g, one evaluation of the forces each; s stages reach as far as 0.65 s^2 / g. Of the s that are stable over the
// whole spectrum of the body (spectrum.hpp) with steps of kLongestS at most, or kTouchS where a tool may touch and of solids,
// plan() takes the cheapest. A body with little damping or none has no such s: it is not for this method.
//
// A node that a tool holds is where the tool is at the time of each stage; its velocity is that of the way over the step. A
// touch pushes with one lambda over a step, that of the step before at first. The contact law is closed at the step's end, where
// the tool has slid to by then (contact_law.hpp), with the step's own response,
//
//     W_jk = B_j^T d u_end / d lambda_k        3 x 3, symmetric part for j = k
//
// and what lambda changes by moves u and v by their responses, d u_end / d lambda and d v_end / d lambda: a step is redone
// with a tenth of a newton more along each axis and compared. These are kept while the contact stays within kNearSpacings, but
// not from one advance() to the next. That lambda is the mean of a step; what advance() leaves is the force at its end, half a
// step further on. Over steps of 1 ms the force is as true as leapfrog's; its error grows with the step.
//
// What the stages add up is the change of a step, not the displacement: rounding, that s^2 may magnify, is of that.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "server/body/chebyshev.hpp"
#include "server/body/contact_sweeps.hpp"
#include "server/body/explicit_stepper.hpp"

namespace palpate {

class StabilisedIntegrator final : public ExplicitStepper {
 public:
  static constexpr int kMostStages = 24;
  static constexpr double kLongestS = 0.004, kTouchS = 0.001;
  static constexpr double kShare = 0.9;  ///< of the stable step that is used

  /// `dynamics` and `skin` must outlive it. ExplicitBody::covers() the body. `spectrum`: its own, where it is known.
  StabilisedIntegrator(const Dynamics& dynamics, const Skin& skin, const std::optional<Spectrum>& spectrum = {});

  struct Plan {
    int stages = 0;  ///< 0: none is stable
    double h = 0;    ///< [s]
  };
  /// The fewest evaluations a second with tools of this kind, in steps of `step_s` at most.
  Plan plan(double step_s, ContactKind tools) const;

 private:
  struct Response {  // of one touching port
    bool valid = false;
    Vec3 at_rest = Vec3::Zero();     // where it was computed
    std::array<NodeArrays, 3> u, v;  // along each axis, to kProbeN
  };

  struct Trend {                 // of one touching port
    int steps = 0;               // since the contact began, or advance()
    Vec3 change = Vec3::Zero();  // of lambda in the last of them
  };

  Steps steps_for(double whole_s, double step_s, const std::vector<ToolPort>& ports) override;
  void go(const Steps& steps, std::vector<ToolPort>& ports, double begin_s, const ToolMotion& tools) override;
  void step(std::vector<ToolPort>& ports, double begin_s, double h, const ToolMotion& tools);
  void start_held(const std::vector<ToolPort>& ports, double end_s, double h, const ToolMotion& tools);
  void evolve(const std::vector<ToolPort>& ports, double begin_s, double h, const ToolMotion& tools);
  void accelerate(const NodeArrays& u, const NodeArrays& v, const std::vector<ToolPort>& ports, NodeArrays& a);
  void hold(const std::vector<ToolPort>& ports, double at_s, const ToolMotion& tools);
  void respond(std::vector<ToolPort>& ports, double begin_s, double h, const ToolMotion& tools);
  void close_contacts(std::vector<ToolPort>& ports, double end_s);
  void bring_to_end(std::size_t k, ToolPort& port) const;
  void couple();
  void move_on(const Response& response, const Vec3& change);

  Spectrum spectrum_;
  std::vector<Chebyshev> methods_;  // of 2, 3, ... stages
  std::vector<double> reach_s_;     // the longest stable step of each
  const Chebyshev* method_ = nullptr;
  NodeArrays u_, v_, a_, a_0_;                  // of a stage; a_0_ of the first
  NodeArrays du_, dv_, du_before_, dv_before_;  // what this stage and the one before it add to the step's begin
  std::vector<Vec3> held_v_;                    // of ports that hold a node, over the step
  std::vector<std::size_t> touching_;
  std::vector<Response> responses_;
  std::vector<Trend> trends_;
  std::vector<std::vector<Mat3>> coupling_;
};

}  // namespace palpate
