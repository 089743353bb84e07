// Explicit steps of s evaluations of the forces, for a body in single precision (explicit_body.hpp) and tools that touch or hold
// it. M x'' = F(x, x') + B lambda.
//
// s = 1 is leapfrog, of second order, in steps of kShare of the longest that is stable:
//
//     v*_n = v_(n-1/2) + h/2 a_(n-1)                       velocity for the dampers, also of second order
//     a_n = M^-1 (F(x_n, v*_n) + B mean of lambda)
//     v_(n+1/2) = v_(n-1/2) + h a_n,   x_(n+1) = x_n + h v_(n+1/2)
//
// Positions and velocities are synchronous at both ends of advance(). A mode of frequency w and damping g (x'' = -w^2 x - g x')
// is stable as long as the matrix of one step has no eigenvalue outside the unit circle: h w < 2 without damping, h g < 1 if
// damping dominates. s = 2 ... kMostStages are those of Runge-Kutta-Chebyshev (chebyshev.hpp), for bodies whose dampers rule how
// long a step may be: dampers proportional to stiffness have rates g, the eigenvalues of M^-1 D, that grow as fast as w^2, and s
// stages reach as far as 0.65 s^2 / g. What the stages add up is the change of a step, not the displacement: rounding, that s^2
// may magnify, is of that. Of the allowed s that are stable over the whole spectrum of the body (spectrum.hpp) with steps of
// kLongestS at most, or kTouchS where a tool may touch and of solids, plan() takes the cheapest.
//
// A step is taken with every lambda as it was. The contact law is closed at its end, where the tool has slid to by then
// (contact_law.hpp), with the step's own response W_jk = B_j^T d u_end / d lambda_k, 3 x 3, and what lambda changes by moves u
// and v. In leapfrog the force on the body is the mean
//     (1 - 3/4 c) lambda_(n+1) + c/2 lambda_n + c/4 lambda_(n-1),   c = min(1, 1 / (k_c h^2 b)),   b = B^T M^-1 B
// With c = 1 that is Newmark's average acceleration: stable however stiff the contact, and of first order within a stroke as
// measured, but contacts that are too stiff for the step would ring. With c = 0, of first order, they do not. So
// W = (1 - 3/4 c) h^2 B_j^T M^-1 B_k. With more stages lambda is the mean over the step, and the response is that of a step
// which is redone with a tenth of a newton more along each axis, kept while the contact stays within kNearSpacings; what
// advance() leaves is the force at its end, half a step further on.
//
// A node that a tool holds is where the tool is at the time of each stage.
//
// A frame that would need too short steps, or in which the body becomes unstable all the same, is left to TR-BDF2 and counted as
// a cut step. A frame in which hexahedra stiffened so much that its steps may have been too long is first repeated in shorter
// steps.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "server/dynamics/chebyshev.hpp"
#include "server/dynamics/explicit_contacts.hpp"
#include "server/dynamics/explicit_limits.hpp"
#include "server/dynamics/integrator.hpp"

namespace palpate {

class ExplicitIntegrator : public Stepper {
 public:
  static constexpr double kTouchS = 0.001;  ///< longest step of several stages with a tool that touches
  /// Share of leapfrog's stable step that is used for a body that may_resonate() at large strains.
  static constexpr double kResonantShare = 0.6;

  enum class Stages { one, more };  ///< leapfrog; Runge-Kutta-Chebyshev

  /// `dynamics` and `skin` must outlive it; ExplicitBody::covers() the body. `limits`: those of `dynamics`.
  ExplicitIntegrator(const Dynamics& dynamics, const Skin& skin, Stages stages, ExplicitLimits limits);

  struct Plan {
    int stages = 0;  ///< 0: none is stable, as of a body with little damping or none with more than one
    double h = 0;    ///< [s]
  };
  /// Returns the plan with the fewest evaluations a second for tools of this kind, in steps of `step_s` at most, at small
  /// strains.
  Plan plan(double step_s, ContactKind tools) const;
  /// Returns true for a solid with hardly any damping: at large strains its stiffness oscillates with its modes (parametric
  /// resonance), and leapfrog's steps that are stable for each stiffness on the way may together gain energy.
  bool may_resonate() const;

  AdvanceReport advance(BodyState& state, std::vector<ToolPort>& ports, double until_s, double step_s,
                        const ToolMotion& tools) override;
  std::unique_ptr<Stepper> anew(const Dynamics& dynamics, const Skin& skin) const override {
    return std::make_unique<ExplicitIntegrator>(dynamics, skin, is_leapfrog() ? Stages::one : Stages::more, limits_);
  }
  bool is_stateless() const override { return true; }
  void allow_touched(double most_iterations) override { fallback_.allow_touched(most_iterations); }
  void set_quiescence_tolerance(double most_n) override { body_.set_quiescence_tolerance(most_n); }
  void use_threads(ThreadPool& pool) override { body_.use_threads(pool); }
  /// Size of an evaluation: springs, with gaps, and hexahedra.
  std::size_t springs() const { return body_.springs().size(); }
  const HexaForces& hexahedra() const { return body_.hexahedra(); }

 private:
  struct Response {  // of one touching port
    bool valid = false;
    Vec3 at_rest = Vec3::Zero();     // where it was computed
    std::array<NodeArrays, 3> u, v;  // along each axis, to kProbeN
    double share = 1;                // of leapfrog: 1 - 3/4 c
    Vec3 before = Vec3::Zero();      // of leapfrog: lambda_(n-1)
    int steps = 0;                   // since the contact began, or advance()
    Vec3 change = Vec3::Zero();      // of lambda in the last of them
  };
  using Growth = HexaForces::Growth;

  bool is_leapfrog() const { return methods_.empty(); }
  /// Sets method_, and returns the steps for `whole_s`: none where they would be so short that TR-BDF2 is cheaper.
  int steps_for(double whole_s, double step_s, const std::vector<ToolPort>& ports);
  void go(int steps, double h, std::vector<ToolPort>& ports, double begin_s, const ToolMotion& tools);
  void step(std::vector<ToolPort>& ports, double begin_s, double h, const ToolMotion& tools);
  void begin_frame(double whole_s, std::vector<ToolPort>& ports);
  void watch(double h);
  bool outgrown();

  void accelerate(const NodeArrays& u, const NodeArrays& v, const std::vector<ToolPort>& ports, NodeArrays& a);
  void start_held(const std::vector<ToolPort>& ports, double end_s, double h, const ToolMotion& tools);
  void leap(const std::vector<ToolPort>& ports, double h);
  void evolve(const std::vector<ToolPort>& ports, double begin_s, double h, const ToolMotion& tools);
  void hold(const std::vector<ToolPort>& ports, double at_s, const ToolMotion& tools);
  void respond(std::vector<ToolPort>& ports, double begin_s, double h, const ToolMotion& tools);
  void close_contacts(std::vector<ToolPort>& ports, double end_s, double h);
  void couple(double h);
  void move_on(std::size_t k, const Vec3& change, double h);
  void push(std::size_t k, const Vec3& lambda, NodeArrays& y) const;
  void kick(double by, const NodeArrays& a, NodeArrays& v) const;
  void bring_to_end(std::size_t k, ToolPort& port) const;

  const Dynamics* dynamics_;
  ExplicitBody body_;
  ExplicitContacts contacts_;
  ExplicitLimits limits_;
  std::vector<Chebyshev> methods_;  // of kFewestStages ... stages; none: leapfrog
  const Chebyshev* method_ = nullptr;
  NodeArrays u_, v_, a_, a_0_;                  // of a stage; a_0_ of the first; v_ of leapfrog: v*
  NodeArrays du_, dv_, du_before_, dv_before_;  // what this stage and the one before it add to the step's begin
  std::vector<Vec3> held_v_;                    // of ports that hold a node, over the step
  std::vector<std::size_t> touching_;
  std::vector<Response> responses_;
  std::vector<std::vector<Mat3>> coupling_;
  Growth expected_, most_;  // since rest: at the begin of the frame, and largest within it
  double unwatched_s_ = 0;
  Integrator fallback_;
};

}  // namespace palpate
