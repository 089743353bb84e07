// TR-BDF2 for a body with tools on it: second order, L-stable, one matrix for both stages.
//
// A step of length h from t to t + h, gamma = 2 - sqrt(2), a = gamma h / 2, y = (x, v), y' = (v, M^-1 (F + B lambda)):
//     trapezoid to t + gamma h:   y1 = y0 + a y0' + a y1'
//     BDF2 to t + h:              y2 = c1 y1 - c0 y0 + a y2',   c1 = 1/(gamma (2 - gamma)),  c0 = (1 - gamma)^2/(gamma (2 -
//     gamma))
// so each stage solves, with x^ and v^ known,
//     x = x^ + a v,   M (v - v^) = a (F(x, v) + B lambda)
// by Newton's method on v with A = M + a D + a^2 K (symmetric part), kept as long as it converges well. The residual
// r = M (v^ - v) + a F points down the potential (v - v^)^T M (v - v^) / 2 + E(x^ + a v), and with A positive definite so does a
// move dv = A^-1 r: where r . dv has turned by more than half of what it was, the move is cut to where it vanishes. Contacts have
// no such potential; their moves are taken whole.
//
// A stage that does not converge, and a step in which a body that no tool touches gains energy (the trapezoid can, where forces
// change fast), is redone with half the step. What even the shortest does not get through takes a damped step: backward Euler,
// down the same potential from standstill, so that it can only calm the body. So does a step so long that the trapezoid would
// throw a node further than elements are long (far from balance, many periods at once: an abrupt release of a light stiff body).
// Contacts that contradict each other have no such way out: there the step is given up. All that is counted in cut_steps.
// Where tools touch, advance() gives up as well when it has taken kNewtonAStep iterations for each step that it would have uncut,
// or its steps with contact those that allow_touched() allows.
//
// A tool is a port on the body (ToolPort). attach: its node is where the tool is at the end of each stage, and its velocity is
// the one with which the scheme takes it there (the mean over the first stage, then y2' of the BDF2): the impulse of its dampers
// is that of the way it went, wherever inside the step a quantised reading jumped. touch: lambda comes from the contact law
// (contact_law.hpp) with p_free the point's end-of-stage position at lambda = 0 and C = a^2 B^T A^-1 B, and once more with the
// point and normal that the tool slides to in the stage. A needle in the body has contacts on its path instead
// (needle_ports.hpp). A hand that holds the end of a thread moves that end (sutures.hpp). A contact that no hand could hold
// (is_lost()) ends. A tool that is still inside touches again where it now is. A step in which a contact begins or ends is redone
// in pieces of at most event_step_s. The tool's own samples drive every stage.
//
// Source: Bank, Coughran, Fichtner, Grosse, Rose and Smith, IEEE Trans. Electron Devices 32 (1985), also in IEEE Trans. CAD 4;
// analysis with this gamma, for which both stages have one matrix: Hosea and Shampine, Appl. Numer. Math. 20 (1996).
#pragma once

#include <array>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "server/body/dynamics.hpp"
#include "server/body/skin.hpp"
#include "server/dynamics/stepper.hpp"
#include "server/solve/linear_solver.hpp"

namespace palpate {

struct IntegratorOptions {
  double step_s = 0.010;      ///< largest step
  double tolerance_m = 1e-7;  ///< Newton stops when no node would move further
  /// automatic: conjugate gradients where it does not pay to factorise (LinearSolver::factorises()).
  LinearSolver::Method solver = LinearSolver::Method::automatic;
  /// Relative, of linear solves: they steer Newton's method, they do not set its answer (docs/decisions/0003-linear-solver.md).
  double solve_tolerance = 0.1;
  double event_step_s = 0.002;  ///< of a step in which a contact begins or ends
  /// Bound on the iterations of Newton's method in one advance(), which then gives up before its next step.
  int most_iterations = std::numeric_limits<int>::max();
  double contact_tolerance_m = 0;  ///< of Newton's method while a tool is in contact, if larger than tolerance_m
};

class Integrator final : public Stepper {
 public:
  static constexpr double kMinStepS = 1e-5, kMostCut = 1024;  ///< shortest step: the longer of the first and step / kMostCut

  /// `dynamics` and `skin` must outlive the integrator. An empty skin has no touch.
  Integrator(const Dynamics& dynamics, const Skin& skin, const IntegratorOptions& options);

  /// In steps of the options' length.
  AdvanceReport advance(BodyState& state, std::vector<ToolPort>& ports, double until_s, const ToolMotion& tools) {
    return advance(state, ports, until_s, options_.step_s, tools);
  }
  AdvanceReport advance(BodyState& state, std::vector<ToolPort>& ports, double until_s, double step_s,
                        const ToolMotion& tools) override;
  void allow_touched(double most_iterations) override { most_touched_ = most_iterations; }
  std::unique_ptr<Stepper> anew(const Dynamics& dynamics, const Skin& skin) const override {
    return std::make_unique<Integrator>(dynamics, skin, options_);
  }

 private:
  static constexpr int kNewtonMax = 30, kNewtonMost = 200;  // of a stage; of a damped step
  // Bound of an advance(), by the steps of the options' length that it would have uncut.
  static constexpr double kNewtonAStep = 120, kFewestSteps = 5;

  struct Stage {
    double a = 0, end_s = 0;
    Vector x_hat, v_hat;
    int iterations_max = kNewtonMax;
  };
  struct PortResponse {  // of one touching port under the current matrix
    bool valid = false;
    ToolPort port;            // for which w was computed
    std::array<Vector, 3> w;  // columns of A^-1 B there
    NodeWeights b;            // of where the port is
  };

  enum class StepEnd { done, contact_event, failed };
  /// A step longer than event_step_s ends where a contact begins or ends, unfinished.
  StepEnd step(BodyState& state, std::vector<ToolPort>& ports, double h, const ToolMotion& tools, AdvanceReport& report);
  bool throws_over(const Vector& forces, double a) const;
  /// A free body may lose energy; one that has more than `most_j`, beyond rounding, was stepped too far.
  bool gains_energy(const BodyState& before, const BodyState& after, double most_j) const;
  /// One step of backward Euler, for a body that no tool touches: goes down a potential, however far Newton's method gets.
  bool damped_step(BodyState& state, std::vector<ToolPort>& ports, double h, const ToolMotion& tools, AdvanceReport& report);
  bool newton(const Stage& stage, const std::vector<Vec3>& tool_points, BodyState& state, std::vector<ToolPort>& ports,
              AdvanceReport& report);
  bool refresh_matrix(const BodyState& state, double a, bool indefinite, AdvanceReport& report);
  void place(const Stage& stage, BodyState& state) const;
  /// Normals at the contacts where the skin was placed last; of those on a path its direction.
  std::vector<Vec3> normals_of(const std::vector<ToolPort>& ports, const Vector& x) const;
  /// Moves contacts that slip on to where they are closed again; false where none slips by more than kSlipToleranceM.
  bool slide_on(std::vector<Vec3>& slips, const BodyState& state, std::vector<ToolPort>& ports);
  void finish_contacts(const std::vector<Vec3>& tool_points, const std::vector<Vec3>& slips, const BodyState& state,
                       std::vector<ToolPort>& ports);
  void update_responses(const std::vector<ToolPort>& ports, const std::vector<std::size_t>& touching, const Vector& x,
                        AdvanceReport& report);
  void couple(const std::vector<std::size_t>& touching, double a);
  void close_ports(const Stage& stage, const std::vector<Vec3>& tool_points, const std::vector<Vec3>& normals,
                   const BodyState& state, std::vector<ToolPort>& ports, Vector& dv, std::vector<Vec3>& slips,
                   AdvanceReport& report);
  bool begin_contacts(const std::vector<Vec3>& tool_points, const BodyState& state, std::vector<ToolPort>& ports) const;
  void total_forces(const BodyState& state, const std::vector<ToolPort>& ports, Vector& f) const;
  void hold_threads(const std::vector<ToolPort>& ports, const std::vector<Vec3>& tool_points, BodyState& state) const;
  void pull_hands(const BodyState& state, std::vector<ToolPort>& ports) const;
  void start_held(const std::vector<ToolPort>& ports, const ToolMotion& tools, double end_s, BodyState& state) const;
  void hold_nodes(const Stage& stage, const std::vector<ToolPort>& ports, const std::vector<Vec3>& tool_points,
                  BodyState& state) const;

  const Dynamics* dynamics_;
  const Skin* skin_;
  IntegratorOptions options_;
  double spacing_m_ = 0;  // mean length of an element
  std::vector<std::uint8_t> held_;
  std::optional<BlockMatrix> a_;  // made when first needed: beside explicit steps it hardly ever is
  LinearSolver solver_;
  double matrix_a_ = 0;  // the a of the factorised matrix, 0 = none
  bool matrix_clamped_ = false;
  std::vector<std::uint8_t> matrix_held_;
  std::vector<PortResponse> responses_;
  std::vector<std::vector<Mat3>> coupling_;  // of touching ports j and k: a^2 B_j^T A^-1 B_k; for j = k its symmetric part
  bool touched_ = false;                     // a contact began in this step, though it may have ended
  double most_touched_ = std::numeric_limits<double>::infinity();
  Vector trend_;  // acceleration over the last stage [m/s^2], empty after a jump
  std::vector<double> skin_positions_;
  Vector f_, r_;
};

}  // namespace palpate
