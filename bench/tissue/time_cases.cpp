// Time dependence of a solid with relaxation (server/body/relaxation.hpp), in steps of the server's integrator. Two branches,
// 0.3 in 0.2 s and 0.25 in 2 s.
//
//   step relaxation   a column stretched by 0.1 % within a step and held: its force after 1 s [N]
//   creep             a column suddenly loaded by its weight: displacement of its end after 1.5 s [mm], at small strains.
//                     J(t) = 1/E - sum a_i exp(-t / l_i) for E(t) of two branches, from the roots of its Laplace transform
//   hysteresis        the end of a column oscillates by 0.1 % at 0.5 Hz: the parts of the force on it in phase and ahead [N],
//                     from the complex modulus
// Dampers of 2 ms let the column come to rest; the complex modulus includes them. The column has nu = 0 and one cell, so that
// only the time integration is in error; `cells` are steps of the integrator in 50 ms.
#include <cmath>
#include <complex>
#include <numbers>

#include "bench/tissue/specimens.hpp"
#include "bench/tissue/tissue_case.hpp"
#include "server/dynamics/integrator.hpp"

namespace palpate {
namespace {

constexpr double kLengthM = 0.04, kWidthM = 0.02, kSlowPa = 20e3, kGravity = 0.2, kFrameS = 0.05, kShare = 1e-3,
                 kDampingS = 0.002, kOmega = std::numbers::pi;  // 0.5 Hz
const std::vector<PronyBranch> kFading{{0.3, 0.2}, {0.25, 2}};

double fast_pa() {
  double left = 1;
  for (const PronyBranch& b : kFading) left -= b.share;
  return kSlowPa / left;
}

double modulus_after(double t) {
  double e = 1;
  for (const PronyBranch& b : kFading) e -= b.share * (1 - std::exp(-t / b.time_s));
  return fast_pa() * e;
}

std::complex<double> complex_modulus(double omega) {
  std::complex<double> e = 1;
  for (const PronyBranch& b : kFading) e -= b.share / std::complex<double>(1, omega * b.time_s);
  return fast_pa() * (e + std::complex<double>(0, omega * kDampingS));
}

/// s E(s) J(s) s = 1: with E~(s) = 1 - sum g / (1 + s tau), J(t) = 1 / E(inf) + sum exp(s_i t) / (s_i E~'(s_i)) over its roots.
double creep_after(double t) {
  const auto e = [](double s) {
    double sum = 1;
    for (const PronyBranch& b : kFading) sum -= b.share / (1 + s * b.time_s);
    return sum;
  };
  double j = 1 / kSlowPa;
  for (std::size_t i = 0; i < kFading.size(); ++i) {  // one root between each pole and the next, the last below 0
    double low = -1 / kFading[i].time_s, high = i + 1 < kFading.size() ? -1 / kFading[i + 1].time_s : 0;
    constexpr double kInside = 1e-9;
    const double width = high - low;
    low += kInside * width, high -= kInside * width;
    const bool rises = e(high) > e(low);
    for (int k = 0; k < 200; ++k) ((e((low + high) / 2) < 0) == rises ? low : high) = (low + high) / 2;
    const double s = (low + high) / 2;
    double slope = 0;
    for (const PronyBranch& b : kFading) slope += b.share * b.time_s / std::pow(1 + s * b.time_s, 2);
    j += std::exp(s * t) / (s * slope * fast_pa());
  }
  return j;
}

/// A bar along z of one cell across, held at z = 0; a tool may hold any node of its end.
struct Column {
  LumpedBody body;
  std::vector<std::uint32_t> end;
  explicit Column(TissueElement element) {
    SolidMaterial material{SolidLaw::neo_hookean, fast_pa(), 0, kDampingS};
    body = box_mesh({1, 1, 4}, {kWidthM, kWidthM, kLengthM}).body(solid_element(element), material);
    body.relaxation = kFading;
    for (std::uint32_t i = 0; i < body.nodes.size(); ++i) {
      if (body.nodes[i].z() < 1e-9) body.fixed[i] = 1;
      if (body.nodes[i].z() > kLengthM - 1e-9) end.push_back(i);
    }
  }
};

/// Force along z on tools that hold the end, at the end of each step of a motion by w(t).
template <class Way, class Heard>
TissueSolution pull(TissueElement element, int steps, double until_s, const Way& way_m, const Heard& heard) {
  const Column column(element);
  const Dynamics dynamics(column.body);
  Integrator integrator(dynamics, Skin(), {kFrameS / steps, 1e-11});
  std::vector<ToolPort> ports(column.end.size());
  for (std::size_t k = 0; k < ports.size(); ++k) ports[k].kind = ContactKind::attach, ports[k].node = column.end[k];
  const ToolMotion tools = [&](std::size_t k, double t) {
    return ToolAt{column.body.nodes[column.end[k]] + Vec3(0, 0, way_m(t)), Vec3::Zero()};
  };
  BodyState state = dynamics.rest_state();
  while (state.time_s < until_s - 1e-9) {
    if (!integrator.advance(state, ports, state.time_s + kFrameS / steps, tools).converged)
      throw std::runtime_error("a column that is pulled cannot be followed");
    double force_n = 0;
    for (const ToolPort& port : ports) force_n += port.lambda.z();
    heard(state.time_s, force_n);
  }
  return {column.body.nodes.size(), 0};
}

TissueSolution relax(TissueElement element, int steps) {
  double last_n = 0;
  TissueSolution found = pull(
      element, steps, 1, [](double t) { return t > 0 ? kShare * kLengthM : 0; },
      [&](double, double force_n) { last_n = force_n; });
  found.value = last_n;
  return found;
}

TissueSolution creep(TissueElement element, int steps) {
  Column column(element);
  column.body.gravity_m_s2 = {0, 0, kGravity};
  const Dynamics dynamics(column.body);
  Integrator integrator(dynamics, Skin(), {kFrameS / steps, 1e-12});
  BodyState state = dynamics.rest_state();
  std::vector<ToolPort> none;
  if (!integrator.advance(state, none, 1.5, {}).converged) throw std::runtime_error("a column that creeps cannot be followed");
  double way_m = 0;
  for (const std::uint32_t i : column.end) way_m += (at_node(state.x, i) - column.body.nodes[i]).z() / 4;
  return {column.body.nodes.size(), 1e3 * way_m};
}

TissueSolution swing(TissueElement element, int steps, bool loss) {
  constexpr double kCycle = 2, kSettled = 16;  // [s]
  double sum = 0;
  int count = 0;
  TissueSolution found = pull(
      element, steps, kSettled + kCycle, [](double t) { return kShare * kLengthM * std::sin(kOmega * t); },
      [&](double t, double force_n) {
        if (t < kSettled + 1e-9) return;
        sum += 2 * force_n * (loss ? std::cos(kOmega * t) : std::sin(kOmega * t));
        ++count;
      });
  found.value = sum / count;
  return found;
}

}  // namespace

std::vector<TissueCase> time_cases() {
  const std::vector<TissueElement> elements{TissueElement::hexahedron};
  const double area_m2 = kWidthM * kWidthM;
  const std::complex<double> modulus = kShare * area_m2 * complex_modulus(kOmega);
  const auto add = [&](const char* name, const char* unit, double reference, const auto& solve) {
    return TissueCase{"time", name, unit, reference, "Prony series", elements, {5, 10, 20}, solve};
  };
  const double end_mm = 1e3 * 1000 * kGravity * kLengthM * kLengthM / 2;
  return {add("creep under its weight after 1.5 s", "mm", end_mm * creep_after(1.5), creep),
          add("step relaxation after 1 s", "N", kShare * area_m2 * modulus_after(1), relax),
          add("hysteresis at 0.5 Hz, storage", "N", modulus.real(), [](TissueElement e, int n) { return swing(e, n, false); }),
          add("hysteresis at 0.5 Hz, loss", "N", modulus.imag(), [](TissueElement e, int n) { return swing(e, n, true); })};
}

}  // namespace palpate
