#include "server/body/ladder.hpp"

#include <fmt/format.h>

#include "common/base/error.hpp"
#include "server/body/explicit_integrator.hpp"

namespace palpate {
namespace {

constexpr double kExplicitNs = 0.7, kImplicitNs = 32, kNewton = 6.6, kWorth = 2;

std::string figures(double step_s, double cost) {
  return fmt::format("steps of {:.2g} ms, about {:.2g} % of a core", 1e3 * step_s, 100 * cost);
}

}  // namespace

ChosenStepper choose_stepper(const SolverSpec& solver, const Dynamics& dynamics, const Skin& skin) {
  const auto implicit = [&] { return std::make_unique<Integrator>(dynamics, skin, IntegratorOptions{solver.step_s}); };
  const double edges = static_cast<double>(edges_of(dynamics.body()).size());
  const double implicit_cost = 1e-9 * edges * kImplicitNs * kNewton / solver.step_s;
  const std::string implicit_figures = figures(solver.step_s, implicit_cost);
  if (solver.integrator == IntegratorKind::tr_bdf2)
    return {implicit(), "tr-bdf2, as the scene says: " + implicit_figures, implicit_cost};
  const bool asked_for = solver.integrator == IntegratorKind::leapfrog;
  if (!SpringBlocks::covers(dynamics.body())) {
    const char* why = "explicit steps are for bodies of linear or stiffening springs";
    if (asked_for) throw InputError("solver.integrator", "is \"explicit\"", fmt::format("\"tr-bdf2\" or \"automatic\": {}", why));
    return {implicit(), fmt::format("tr-bdf2, {}: {}", implicit_figures, why), implicit_cost};
  }
  auto leapfrog = std::make_unique<ExplicitIntegrator>(dynamics, skin);
  const double step_s = std::min(leapfrog->step_s(), solver.step_s);
  const double cost = 1e-9 * static_cast<double>(leapfrog->springs()) * kExplicitNs / step_s;
  const std::string explicit_figures = figures(step_s, cost);
  if (asked_for) return {std::move(leapfrog), "explicit, as the scene says: " + explicit_figures, cost};
  if (kWorth * cost <= implicit_cost)
    return {std::move(leapfrog), fmt::format("explicit: {} (tr-bdf2: {})", explicit_figures, implicit_figures), cost};
  return {implicit(), fmt::format("tr-bdf2: {} (explicit: {})", implicit_figures, explicit_figures), implicit_cost};
}

}  // namespace palpate
