#include "bench/paper/sampled_wall.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/player/propagator.hpp"

namespace palpate {
namespace {

/// State of the loop: x, x', then x_n-1, or the virtual tool's x_v, v, x_d.
using LoopState = Eigen::VectorXd;

class Loop {
 public:
  explicit Loop(const WallLoop& loop) : loop_(loop), step_(loop.device, loop.period_s) {}
  Eigen::Index states() const { return loop_.coupling ? 5 : 3; }

  void advance(LoopState& z) const {
    const double force = loop_.coupling ? coupled(z) : direct(z);
    step_.advance(force, z[0], z[1]);
  }

 private:
  double direct(LoopState& z) const {
    const double force = -loop_.stiffness_n_m * z[0] - loop_.damping_n_s_m * (z[0] - z[2]) / loop_.period_s;
    z[2] = z[0];
    return force;
  }
  double coupled(LoopState& z) const {
    VirtualTool tool{{z[2], 0, 0}, {z[3], 0, 0}, {z[4], 0, 0}};
    const EnvironmentForce wall{{-loop_.stiffness_n_m * z[2], 0, 0}, loop_.stiffness_n_m};
    const double force = couple(*loop_.coupling, tool, {z[0], 0, 0}, wall, loop_.period_s).x();
    z[2] = tool.position.x();
    z[3] = tool.velocity.x();
    z[4] = tool.device.x();
    return force;
  }

  WallLoop loop_;
  DeviceStep step_;
};

double sum_of_squares(const std::vector<double>& x, std::size_t from, std::size_t to) {
  double sum = 0;
  for (std::size_t n = from; n < to; ++n) sum += x[n] * x[n];
  return sum;
}

}  // namespace

DeviceStep::DeviceStep(const Device1d& device, double period_s) {
  const Propagator p = make_propagator(ModeVector::Constant(1, device.operator_n_m / device.mass_kg),
                                       ModeMatrix::Constant(1, 1, device.damping_n_s_m / device.mass_kg), {}, period_s);
  phi_ = p.phi;
  psi_ = p.psi0.col(0) / device.mass_kg;
}

Matrix loop_matrix(const WallLoop& loop) {
  const Loop map(loop);
  Matrix a(map.states(), map.states());
  for (Eigen::Index k = 0; k < map.states(); ++k) {
    LoopState z = LoopState::Unit(map.states(), k);
    map.advance(z);
    a.col(k) = z;
  }
  return a;
}

double spectral_radius(const WallLoop& loop) {
  return Eigen::EigenSolver<Matrix>(loop_matrix(loop), false).eigenvalues().cwiseAbs().maxCoeff();
}

std::vector<double> release_from_1mm(const WallLoop& loop, std::size_t periods) {
  constexpr double kStartM = 1e-3, kGrown = 1e6;
  const Loop map(loop);
  LoopState z = LoopState::Constant(map.states(), kStartM);
  z[1] = 0;
  if (loop.coupling) z[3] = 0;
  std::vector<double> x;
  while (x.size() < periods && std::abs(z[0]) < kGrown * kStartM) {
    map.advance(z);
    x.push_back(z[0]);
  }
  return x;
}

bool settles(const WallLoop& loop, std::size_t periods) {
  const std::vector<double> x = release_from_1mm(loop, periods);
  return x.size() == periods && sum_of_squares(x, periods / 2, periods) < sum_of_squares(x, 0, periods / 2);
}

double stiffest_for_any_spring(const WallLoop& loop, double most, int operators) {
  // The resonance is narrow, so the search zooms in on the best value found.
  constexpr int kZooms = 5;
  double least = most, low = 0, high = 2 * std::numbers::pi / loop.period_s, best = 0;
  WallLoop held = loop;
  for (int zoom = 0; zoom <= kZooms; ++zoom) {
    const double spacing = (high - low) / operators;
    for (int k = 0; k <= operators; ++k) {
      const double omega = low + k * spacing;
      held.device.operator_n_m = held.device.mass_kg * omega * omega;
      const double stiffness = stiffest(held, least, [](const WallLoop& l) { return spectral_radius(l) < 1; });
      if (stiffness < least) best = omega;
      least = std::min(least, stiffness);
    }
    low = std::max(0.0, best - 2 * spacing);
    high = best + 2 * spacing;
  }
  return least;
}

}  // namespace palpate
