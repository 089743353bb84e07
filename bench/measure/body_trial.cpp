#include "bench/measure/body_trial.hpp"

#include <algorithm>
#include <cmath>

#include "bench/measure/gestures.hpp"
#include "common/base/random.hpp"
#include "server/dynamics/integrator.hpp"
#include "server/scene/lattice.hpp"

namespace palpate {
namespace {

constexpr int kNodes = 4;
constexpr double kSpacingM = 0.02, kHeightM = (kNodes - 1) * kSpacingM, kSoftestNM = 10;
constexpr double kGestureS = 0.2, kPieceS = 0.05, kWatchedS = 2.0, kWatchedSteps = 4000;
constexpr double kBackSpacings = 0.01;  // distance at which a node counts as at its rest position
constexpr double kFolds = 0.5;          // a block compressed further may come to rest in folds
constexpr double kSwings = 0.5;         // share of the energy: a block that has more still oscillates and may end anywhere
constexpr double kGrowth = 1e-3;        // share of the energy that the tolerance of Newton's method can add

double log_uniform(Random& random, double low, double high) { return low * std::pow(high / low, random.uniform()); }

bool is_top(const LumpedBody& body, std::uint32_t i) { return body.nodes[i].z() > kHeightM - 1e-9; }

std::vector<ToolPort> grip(const LumpedBody& body, Treatment treatment) {
  std::vector<ToolPort> ports;
  for (std::uint32_t i = 0; i < body.nodes.size(); ++i) {
    if (!is_top(body, i) || (treatment == Treatment::pull && !ports.empty())) continue;
    ToolPort port;
    port.kind = ContactKind::attach;
    port.node = i;
    ports.push_back(port);
  }
  return ports;
}

class Trial {
 public:
  explicit Trial(const BodyTrial& trial)
      : trial_(trial),
        body_(trial_body(trial)),
        dynamics_(body_),
        state_(dynamics_.rest_state()),
        integrator_(dynamics_, skin_, {1e-3 * trial.step_ms}) {}

  BodyTrialResult go() {
    treat();
    watch();
    if (result_.finite) relax();
    return result_;
  }

 private:
  void treat();
  void watch();
  void relax();
  void advance(std::vector<ToolPort>& ports, const ToolMotion& tools);
  double off_spacings() const { return (state_.x - dynamics_.rest_state().x).cwiseAbs().maxCoeff() / kSpacingM; }
  double softest_period_s() const;

  BodyTrial trial_;
  LumpedBody body_;
  Skin skin_;
  Dynamics dynamics_;
  BodyState state_;
  Integrator integrator_;
  BodyTrialResult result_;
};

void Trial::advance(std::vector<ToolPort>& ports, const ToolMotion& tools) {
  const double until_s = state_.time_s + kPieceS;
  const AdvanceReport report = integrator_.advance(state_, ports, until_s, tools);
  result_.steps += report.steps;
  result_.cut_steps += report.cut_steps;
  const int longest = static_cast<int>(std::ceil(kPieceS / (1e-3 * trial_.step_ms) - 1e-6));
  result_.hidden_cut |= report.steps > longest && report.cut_steps == 0;
  result_.finite &= state_.x.allFinite() && state_.v.allFinite();
  if (report.converged) return;
  ++result_.failed;
  state_.v.setZero();
  state_.time_s = until_s;
}

void Trial::treat() {
  if (trial_.treatment == Treatment::compress) {
    for (Eigen::Index z = 2; z < state_.x.size(); z += 3) state_.x[z] *= 1 - trial_.amount;
    return;
  }
  std::vector<ToolPort> ports = grip(body_, trial_.treatment);
  const Vec3 way = trial_.treatment == Treatment::pull ? Vec3(0.8, 0, 0.6) : Vec3(0, 0, -1);
  const auto tool = [&](std::size_t k, double t_s) {
    const auto part = [&](double at_s) { return trial_.amount * kHeightM * minimum_jerk(at_s / kGestureS); };
    constexpr double kH = 1e-6;
    return ToolAt{body_.nodes[ports[k].node] + part(t_s) * way, (part(t_s + kH) - part(t_s - kH)) / (2 * kH) * way};
  };
  while (state_.time_s < kGestureS - 1e-9 && result_.finite) advance(ports, tool);
}

void Trial::watch() {
  std::vector<ToolPort> none;
  const double begin_s = state_.time_s, watched_s = std::min(kWatchedS, kWatchedSteps * 1e-3 * trial_.step_ms);
  result_.released_j = dynamics_.energy(state_);
  double highest = 0, energy = result_.released_j;
  while (state_.time_s < begin_s + watched_s - 1e-9 && result_.finite) {
    advance(none, {});
    energy = dynamics_.energy(state_);
    highest = std::max(highest, energy);
  }
  result_.growth = highest / result_.released_j - 1;
  result_.left = energy / result_.released_j;
  result_.off_spacings = off_spacings();
}

/// Period of the heaviest mass on the softest spring, several of them in a row.
double Trial::softest_period_s() const {
  return 2 * M_PI * kNodes * std::sqrt(*std::max_element(body_.masses_kg.begin(), body_.masses_kg.end()) / kSoftestNM);
}

void Trial::relax() {
  constexpr int kPiecesMax = 400;
  constexpr double kStillSpacings = 1e-7, kLonger = 1.3;
  const bool was_back = off_spacings() < kBackSpacings;
  const double longest_s = 10 * softest_period_s();
  double piece_s = std::min(1e-3 * trial_.step_ms, longest_s);
  Integrator integrator(dynamics_, skin_, {longest_s});
  std::vector<ToolPort> none;
  for (int k = 0; k < kPiecesMax; ++k, piece_s = std::min(kLonger * piece_s, longest_s)) {
    const Vector before = state_.x;
    state_.v.setZero();
    const bool converged = integrator.advance(state_, none, state_.time_s + piece_s, {}).converged;
    if (!converged || piece_s < longest_s || (state_.x - before).cwiseAbs().maxCoeff() > kStillSpacings * kSpacingM) continue;
    const bool at_rest = off_spacings() < kBackSpacings;
    result_.end = !at_rest ? BodyEnd::elsewhere : was_back ? BodyEnd::back : BodyEnd::on_its_way;
    return;
  }
}

}  // namespace

bool BodyTrialResult::holds(const BodyTrial& trial) const {
  const bool folds = trial.treatment != Treatment::compress || trial.amount > kFolds || left > kSwings;
  return finite && failed == 0 && !hidden_cut && growth < kGrowth && end != BodyEnd::none && (folds || end != BodyEnd::elsewhere);
}

LumpedBody trial_body(const BodyTrial& trial) {
  LatticeSettings s;
  s.nodes = {kNodes, kNodes, kNodes};
  s.size_m = Vec3::Constant(kHeightM);
  s.stiffness_n_m = kSoftestNM;
  s.fixed.faces = {"z-"};
  s.law = trial.law;
  LumpedBody body = build_box(s).body;
  Random random(trial.seed);
  for (double& m : body.masses_kg) m = log_uniform(random, trial.mass_min_kg, trial.mass_max_kg);
  for (Element& e : body.elements) {
    e.stiffness_n_m = log_uniform(random, kSoftestNM, kSoftestNM * trial.ratio);
    e.damping_n_s_m = 2 * trial.zeta * std::sqrt(e.stiffness_n_m * 0.5 * (body.masses_kg[e.a] + body.masses_kg[e.b]));
  }
  return body;
}

BodyTrialResult try_body(const BodyTrial& trial) { return Trial(trial).go(); }

}  // namespace palpate
