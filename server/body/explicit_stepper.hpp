// Base class of explicit integrators: the body in single precision, the tools that touch it, and a fallback.
//
// A frame that would need too short steps, or in which the body becomes unstable all the same, is left to TR-BDF2 and counted as
// a cut step. A frame in which hexahedra stiffened so much that its steps may have been too long is first repeated in shorter
// steps.
#pragma once

#include "server/body/explicit_contacts.hpp"
#include "server/body/integrator.hpp"

namespace palpate {

class ExplicitStepper : public Stepper {
 public:
  AdvanceReport advance(BodyState& state, std::vector<ToolPort>& ports, double until_s, double step_s,
                        const ToolMotion& tools) final;
  bool is_stateless() const final { return true; }
  void set_quiescence_tolerance(double most_n) final { body_.set_quiescence_tolerance(most_n); }
  void use_threads(ThreadPool& pool) final { body_.use_threads(pool); }
  /// Size of an evaluation: springs, with gaps, and hexahedra.
  std::size_t springs() const { return body_.springs().size(); }
  const HexaForces& hexahedra() const { return body_.hexahedra(); }

 protected:
  static constexpr double kShortestShare = 0.2;  ///< of the step at rest: below that TR-BDF2 is cheaper

  /// `dynamics` and `skin` must outlive it; ExplicitBody::covers() the body.
  ExplicitStepper(const Dynamics& dynamics, const Skin& skin);

  struct Steps {
    int count = 0;  ///< 0: not worthwhile
    double h = 0;
  };
  /// Chooses the steps for `whole_s`, of `step_s` at most. body_ has been set to the state.
  virtual Steps steps_for(double whole_s, double step_s, const std::vector<ToolPort>& ports) = 0;
  virtual void go(const Steps& steps, std::vector<ToolPort>& ports, double begin_s, const ToolMotion& tools) = 0;

  using Growth = HexaForces::Growth;
  /// Growth of stiffness and damping since rest, present or expected until the end of the frame.
  const Growth& growth() const { return expected_; }
  /// Must be called at the end of each step of `h` [s].
  void watch(double h);
  /// Returns the nodes that ports push or hold.
  std::vector<std::uint32_t> busy_nodes(const std::vector<ToolPort>& ports);

  ExplicitBody body_;
  ExplicitContacts contacts_;

 private:
  static constexpr double kWatchedEveryS = 0.004;
  bool outgrown();

  const Dynamics* dynamics_;
  Growth expected_, most_;  // at the begin of the frame; largest within it
  double unwatched_s_ = 0;
  Integrator fallback_;
};

}  // namespace palpate
