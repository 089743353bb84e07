#include "bench/paper/chain.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bench/paper/state_space.hpp"
#include "bench/paper/two_layer.hpp"
#include "common/base/error.hpp"

namespace palpate {
namespace {

constexpr int kMaxMasses = 200;
constexpr double kSpacingM = 0.01;  // has no effect: the chain is straight

/// Roots of a s^2 + b s + c without cancellation.
std::pair<Complex, Complex> roots(double a, double b, double c) {
  const double disc = b * b - 4 * a * c;
  if (disc < 0) return {Complex(-b, std::sqrt(-disc)) / (2 * a), Complex(-b, -std::sqrt(-disc)) / (2 * a)};
  const double larger = -b - std::sqrt(disc);
  return {larger / (2 * a), larger == 0 ? 0 : 2 * c / larger};
}

/// Eq. 6.
Complex four_layers(const ChainParameters& p, Complex s) {
  const Complex z = p.element(s), w = p.mass_kg * s * s + 2.0 * z;
  return z * (1.0 - z * (w * w - z * z) / (w * (w * w - 2.0 * z * z)));
}

Complex continued_fraction(const ChainParameters& p, Complex s) {
  const Complex z = p.element(s);
  Complex y = z;
  for (int i = 0; i < p.masses; ++i) {
    const Complex behind = p.mass_kg * s * s + y;
    y = z * behind / (z + behind);
  }
  return y;
}

/// Mass and equivalent number of springs of the mass nearest to x in the reduced models: m' s^2 + lambda (b s + k).
struct OneMass {
  double mass_kg = 0, lambda = 0;
};
OneMass one_mass(const ChainParameters& p, ChainModel model) {
  const double n = p.elements();
  if (model == ChainModel::first_mass) return {p.mass_kg, 2};
  return {p.mass_kg * (1 + 0.5 * (p.masses - 1)), n / (n - 1)};
}

/// Removes the pole nearest to `wanted` from `poles` and returns it.
Complex take_nearest(std::vector<Complex>& poles, Complex wanted) {
  const auto at = std::min_element(poles.begin(), poles.end(),
                                   [&](Complex a, Complex b) { return std::abs(a - wanted) < std::abs(b - wanted); });
  const Complex found = *at;
  poles.erase(at);
  return found;
}

double pole_error(std::vector<Complex> found, const std::vector<Complex>& exact) {
  constexpr double kCoincident = 1e-4;
  double error = 0;
  for (std::size_t i = 0; i + 1 < exact.size(); i += 2) {
    const Complex a = exact[i], b = exact[i + 1], fa = take_nearest(found, a), fb = take_nearest(found, b);
    if (std::abs(a - b) < kCoincident * std::abs(a))
      error = std::max({error, std::abs((fa + fb) / (a + b) - 1.0), std::abs(fa * fb / (a * b) - 1.0)});
    else
      error = std::max({error, std::abs(fa / a - 1.0), std::abs(fb / b - 1.0)});
  }
  return error;
}

}  // namespace

void validate(const ChainParameters& p, const std::string& where) {
  if (p.masses < 1 || p.masses > kMaxMasses)
    throw InputError(where, "masses is " + std::to_string(p.masses), "1 to " + std::to_string(kMaxMasses));
  const auto positive = [&](const char* name, double value) {
    if (!(value > 0) || !std::isfinite(value))
      throw InputError(where, std::string(name) + " is " + std::to_string(value), "a number above 0");
  };
  positive("stiffness", p.stiffness_n_m);
  positive("damping", p.damping_n_s_m);
  positive("mass", p.mass_kg);
}

LumpedBody chain_body(const ChainParameters& p) {
  LumpedBody body;
  for (int i = 0; i <= p.elements(); ++i) {
    body.nodes.emplace_back(kSpacingM * i, 0, 0);
    body.masses_kg.push_back(p.mass_kg);
    body.fixed.push_back(i == p.elements());
  }
  for (std::uint32_t i = 0; i + 1 < body.nodes.size(); ++i)
    body.elements.push_back({i, i + 1, (body.nodes[i + 1] - body.nodes[i]).norm(), p.stiffness_n_m, p.damping_n_s_m});
  return body;
}

const char* name_of(ChainModel model) {
  return model == ChainModel::full ? "full" : model == ChainModel::first_mass ? "first mass" : "two-level";
}

SecondOrderSystem chain_system(const ChainParameters& p, ChainModel model) {
  const LumpedBody body = chain_body(p);
  const Dynamics dynamics(body);
  const BodyState rest = dynamics.rest_state();
  if (model == ChainModel::two_level) return two_layer_system(dynamics, rest, 0);
  std::vector<std::uint8_t> held = body.fixed;
  if (model == ChainModel::first_mass) std::fill(held.begin() + 2, held.end(), std::uint8_t{1});
  return second_order_system(dynamics, rest, 0, held);
}

Complex chain_transfer(const ChainParameters& p, ChainModel model, Complex s) {
  if (model == ChainModel::full) return p.masses == 3 ? four_layers(p, s) : continued_fraction(p, s);
  const Complex z = p.element(s);
  const OneMass one = one_mass(p, model);
  return z * (1.0 - z / (one.mass_kg * s * s + one.lambda * z));
}

double chain_static_gain(const ChainParameters& p, ChainModel model) {
  return p.stiffness_n_m / (model == ChainModel::first_mass ? 2 : p.elements());
}

std::vector<Complex> chain_poles(const ChainParameters& p, ChainModel model) {
  std::vector<Complex> poles;
  const auto add = [&](double mass_kg, double lambda) {
    const auto [a, b] = roots(mass_kg, lambda * p.damping_n_s_m, lambda * p.stiffness_n_m);
    poles.push_back(a);
    poles.push_back(b);
  };
  if (model == ChainModel::full) {
    // 2 - 2 cos(a) = 4 sin^2(a / 2), without the cancellation.
    for (int j = 1; j <= p.masses; ++j) add(p.mass_kg, 4 * std::pow(std::sin(0.5 * j * std::numbers::pi / p.elements()), 2));
  } else {
    const OneMass one = one_mass(p, model);
    add(one.mass_kg, one.lambda);
  }
  return poles;
}

ChainErrors chain_errors(const ChainParameters& p, ChainModel model, const std::vector<double>& frequencies_hz) {
  const SecondOrderSystem system = chain_system(p, model);
  const TransferFunction transfer(system);
  ChainErrors errors;
  for (const double f : frequencies_hz) {
    const Complex s(0, 2 * std::numbers::pi * f), exact = chain_transfer(p, model, s);
    errors.transfer = std::max(errors.transfer, std::abs(transfer(s)(0, 0) - exact) / std::abs(exact));
  }
  const Eigen::VectorXcd found = state_space(system).poles();
  errors.poles = pole_error({found.begin(), found.end()}, chain_poles(p, model));
  return errors;
}

}  // namespace palpate
