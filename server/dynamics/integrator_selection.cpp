#include "server/dynamics/integrator_selection.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/error.hpp"
#include "server/dynamics/explicit_integrator.hpp"

namespace palpate {
namespace {

constexpr double kLeapfrogNs = 0.7, kStageNs = 1.0, kSpringNs = 130, kTetraNs = 210, kHexaNs = 300, kExplicitWorth = 2,
                 kStabilisedWorth = 1.5, kLeapfrogMost = 0.05;

constexpr const char* kExplicitBodies =
    "explicit steps are for linear or stiffening springs, and for hexahedra that do not fade and have no capsule";

/// An integrator for one body.
struct Candidate {
  std::unique_ptr<Stepper> stepper;
  std::string figures;          // its name and how it would go, for people
  double cost = 0, step_s = 0;  // the longest to ask it for
  bool may_resonate = false;
};

Candidate candidate(std::unique_ptr<Stepper> stepper, const char* name, const std::string& steps, double cost, double step_s) {
  const double percent = 100 * cost;
  const std::string share = percent < 99.5 ? fmt::format("{:.2g}", percent) : fmt::format("{:.0f}", percent);
  return {std::move(stepper), fmt::format("{}, {}, about {} % of a core", name, steps, share), cost, step_s};
}

/// In steps as long as the scene allows, or `finely`: in those that take no more than kAffordable of a core.
Candidate implicit_candidate(const Scene& scene, const Dynamics& dynamics, const Skin& skin, bool finely) {
  constexpr double kAffordable = 0.1, kShortestS = 0.0025;
  constexpr double kFading = 4;  // a step of 150 nodes of tetrahedra takes so much longer where their stress fades
  const LumpedBody& body = dynamics.body();
  const double edge_ns = !body.is_solid() ? kSpringNs : body.hexahedra.empty() ? kTetraNs : kHexaNs;
  const double fading = !dynamics.relaxation().empty() && !dynamics.body().tetrahedra.empty() ? kFading : 1;
  const double step_cost_s = 1e-9 * static_cast<double>(edges_of(dynamics.body()).size()) * edge_ns * fading;
  double step_s = scene.solver.step_s;
  if (finely) step_s = std::min(step_s, std::max(kShortestS, step_cost_s / kAffordable));
  // 0.9 um of an organ with cells of 12 mm, whose force is then as true as with 0.1 um (docs/decisions/0003-linear-solver.md).
  constexpr double kContactToleranceEdges = 5e-5;
  constexpr double kPunctureStepS = 0.001;  // a puncture is felt to a tick
  IntegratorOptions options{step_s};
  options.contact_tolerance_m = kContactToleranceEdges * mean_edge_m(body);
  if (scene.tool.needle) options.event_step_s = kPunctureStepS;
  return candidate(std::make_unique<Integrator>(dynamics, skin, options), "tr-bdf2",
                   fmt::format("steps of {:.2g} ms", 1e3 * step_s), step_cost_s / step_s, step_s);
}

/// Without a stepper where the body's damping is too low for it.
Candidate explicit_candidate(const Scene& scene, const Dynamics& dynamics, const Skin& skin, ExplicitIntegrator::Stages of,
                             const ExplicitLimits& limits) {
  auto stepper = std::make_unique<ExplicitIntegrator>(dynamics, skin, of, limits);
  const auto [stages, h] = stepper->plan(scene.solver.step_s, scene.tool.contact);
  if (stages == 0) return {};
  const double spring_ns = of == ExplicitIntegrator::Stages::one ? kLeapfrogNs : kStageNs;
  const double evaluation_s = 1e-9 * static_cast<double>(stepper->springs()) * spring_ns + stepper->hexahedra().evaluation_s();
  const bool may_resonate = stepper->may_resonate();
  const std::string steps = fmt::format("{}steps of {:.2g} ms", stages > 1 ? fmt::format("{} stages in ", stages) : "", 1e3 * h);
  Candidate made = candidate(std::move(stepper), stages > 1 ? "stabilised" : "explicit", steps, evaluation_s * stages / h,
                             scene.solver.step_s);
  made.may_resonate = may_resonate;
  return made;
}

ChosenStepper chosen(Candidate candidate, const std::string& why) {
  return {std::move(candidate.stepper), fmt::format("{} ({})", candidate.figures, why), candidate.cost, candidate.step_s};
}

/// Returns why explicit steps would not do for the scene, whatever its body is; null: they would.
const char* needs_implicit(const Scene& scene) {
  if (scene.tool.needle) return "a needle is for implicit steps";
  if (!scene.body.sutures.empty()) return "a thread is for implicit steps";
  return scene.tearing ? "a tear is for implicit steps" : nullptr;
}

/// That which the scene asks for; an empty one where it leaves it to us.
Candidate asked_for(const Scene& scene, const Dynamics& dynamics, const Skin& skin) {
  const auto with_stages = [&](ExplicitIntegrator::Stages stages) {
    return explicit_candidate(scene, dynamics, skin, stages, ExplicitLimits(dynamics));
  };
  const auto refuse = [&](const char* kind, const char* instead, const char* why) {
    throw InputError("scene \"" + scene.name + "\": solver.integrator", fmt::format("is \"{}\"", kind),
                     fmt::format("{} or \"automatic\": {}", instead, why));
  };
  const bool covered = ExplicitBody::covers(dynamics.body());
  const bool is_explicit =
      scene.solver.integrator == IntegratorKind::leapfrog || scene.solver.integrator == IntegratorKind::stabilised;
  if (const char* const why = needs_implicit(scene); why && is_explicit)
    refuse(scene.solver.integrator == IntegratorKind::leapfrog ? "explicit" : "stabilised", "\"tr-bdf2\"", why);
  switch (scene.solver.integrator) {
    case IntegratorKind::automatic:
      return {};
    case IntegratorKind::tr_bdf2:
      return implicit_candidate(scene, dynamics, skin, false);
    case IntegratorKind::leapfrog:
      if (!covered) refuse("explicit", "\"tr-bdf2\"", kExplicitBodies);
      return with_stages(ExplicitIntegrator::Stages::one);
    case IntegratorKind::stabilised:
      if (!covered) refuse("stabilised", "\"tr-bdf2\"", kExplicitBodies);
      break;
  }
  Candidate stabilised = with_stages(ExplicitIntegrator::Stages::more);
  if (!stabilised.stepper) refuse("stabilised", "\"explicit\"", "the body has too little damping for stabilised steps");
  return stabilised;
}

}  // namespace

ChosenStepper choose_stepper(const Scene& scene, const Dynamics& dynamics, const Skin& skin) {
  if (Candidate asked = asked_for(scene, dynamics, skin); asked.stepper) return chosen(std::move(asked), "as the scene says");
  if (const char* const why = needs_implicit(scene)) return chosen(implicit_candidate(scene, dynamics, skin, true), why);
  if (!ExplicitBody::covers(dynamics.body())) return chosen(implicit_candidate(scene, dynamics, skin, true), kExplicitBodies);
  Candidate implicit = implicit_candidate(scene, dynamics, skin, dynamics.body().is_solid());
  const ExplicitLimits limits(dynamics);
  Candidate leapfrog = explicit_candidate(scene, dynamics, skin, ExplicitIntegrator::Stages::one, limits),
            stabilised = explicit_candidate(scene, dynamics, skin, ExplicitIntegrator::Stages::more, limits);
  if (leapfrog.may_resonate) return chosen(std::move(implicit), "a solid without dampers may gain energy in explicit steps");
  const bool grasped_solid = dynamics.body().is_solid() && scene.tool.contact == ContactKind::attach;
  const bool damped = stabilised.stepper && !grasped_solid && leapfrog.cost > kLeapfrogMost &&
                      kStabilisedWorth * stabilised.cost <= leapfrog.cost;
  Candidate& best = damped ? stabilised : leapfrog;
  Candidate& other = damped ? leapfrog : stabilised;
  const std::string others = other.stepper ? other.figures : "stabilised: too little damping";
  if (kExplicitWorth * best.cost <= implicit.cost)
    return chosen(std::move(best), fmt::format("{}; {}", others, implicit.figures));
  return chosen(std::move(implicit), fmt::format("{}; {}", best.figures, others));
}

ChosenStepper same_stepper(const ChosenStepper& other, const Dynamics& dynamics, const Skin& skin) {
  return {other.stepper->anew(dynamics, skin), other.reason, other.cost, other.step_s};
}

}  // namespace palpate
