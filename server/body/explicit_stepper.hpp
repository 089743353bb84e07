// What explicit integrators share: the body in single precision, the tools that touch it, and a way out.
//
// A frame that would need steps too short to be worth it, or in which the body flies apart all the same, is left to TR-BDF2, and
// told as a cut step. One in which hexahedra became so much stiffer on the way that its steps may have been too long is done
// again in shorter ones first.
#pragma once

#include "server/body/explicit_contacts.hpp"
#include "server/body/integrator.hpp"

namespace palpate {

class ExplicitStepper : public Stepper {
 public:
  AdvanceReport advance(BodyState& state, std::vector<ToolPort>& ports, double until_s, double step_s,
                        const ToolMotion& tools) final;
  bool leaves_no_trace() const final { return true; }
  void leave_out(double most_n) final { body_.leave_out(most_n); }
  void use_threads(ThreadPool& pool) final { body_.use_threads(pool); }
  /// What an evaluation goes through: springs, with gaps, and hexahedra.
  std::size_t springs() const { return body_.springs().size(); }
  const HexaForces& hexahedra() const { return body_.hexahedra(); }

 protected:
  static constexpr double kShortestShare = 0.2;  ///< of the step at rest: below that TR-BDF2 is cheaper

  /// `dynamics` and `skin` must outlive it. ExplicitBody::covers() the body.
  ExplicitStepper(const Dynamics& dynamics, const Skin& skin);

  struct Steps {
    int count = 0;  ///< 0: not worth it
    double h = 0;
  };
  /// For `whole_s`, in steps of `step_s` at most. body_ has been taken.
  virtual Steps steps_for(double whole_s, double step_s, const std::vector<ToolPort>& ports) = 0;
  virtual void go(const Steps& steps, std::vector<ToolPort>& ports, double begin_s, const ToolMotion& tools) = 0;

  using Growth = HexaForces::Growth;
  /// How much stiffer and thicker than at rest the body is, or is expected to become until the end of the frame.
  const Growth& growth() const { return expected_; }
  /// To be called at the end of each step, of `h`.
  void watch(double h);
  /// Nodes that ports push or hold.
  std::vector<std::uint32_t> busy_nodes(const std::vector<ToolPort>& ports);

  ExplicitBody body_;
  ExplicitContacts contacts_;

 private:
  static constexpr double kWatchedEveryS = 0.004;
  bool outgrown();

  const Dynamics* dynamics_;
  Growth expected_, most_;  // at its begin, on the way
  double unwatched_s_ = 0;
  Integrator fallback_;
};

}  // namespace palpate
