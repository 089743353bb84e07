#include "server/reduction/fit_nonlinear_terms.hpp"

#include <Eigen/Eigenvalues>
#include <cassert>
#include <vector>

#include "common/patch/terms_pieces.hpp"
#include "common/player/player.hpp"
#include "server/reduction/sample_elements.hpp"
#include "server/reduction/tool_prediction.hpp"

namespace palpate {
namespace {

constexpr double kStiffnessShareLeast = 1e-8;  // of the largest, for a mode without its own stiffness: bounds its unit
constexpr double kPsdChangeRounding = 1e-9;    // of the largest stiffness: a smaller change is rounding
constexpr double kDampingPerStepMax = 3;       // largest eigenvalue of D times a step; measured (docs/notebook.md, 20)

bool is_projected(const Patch& patch, const HyperModel& model) {
  return model.psd_change.cwiseAbs().maxCoeff() > kPsdChangeRounding * patch.stiffness.maxCoeff();
}

/// Returns the coefficients of u^T psd_change u / 2.
Eigen::VectorXf repair(const Matrix& psd_change) {
  Eigen::VectorXf e2(pairs_of(static_cast<int>(psd_change.cols())));
  for (int j = 0; j < psd_change.cols(); ++j)
    for (int i = 0; i <= j; ++i) e2[pair_at(i, j)] = static_cast<float>((i == j ? 0.5 : 1.0) * psd_change(i, j));
  return e2;
}

/// Returns the stiffness of each single variable, > 0.
Vector stiffness_of(const Patch& patch, Eigen::Index first) {
  Vector stiffness = joint_stiffness(patch, patch.stiffness).diagonal();
  stiffness.tail(patch.stiffness.size()) =
      stiffness.tail(patch.stiffness.size()).cwiseMax(kStiffnessShareLeast * patch.stiffness.maxCoeff());
  if (first > 0) stiffness.head(first) = stiffness.head(first).cwiseMax(kStiffnessShareLeast * stiffness.head(first).maxCoeff());
  return stiffness;
}

/// Maps forces on the variables of a grasp to the force that holds the tool once the modes have followed: F = f_p + B_k^T K^-1
/// f_q.
Matrix held_tool(const Patch& patch, const Vector& stiffness) {
  assert(stiffness.size() == patch.modes() + 3 && stiffness.minCoeff() > 0);
  Matrix at_port(stiffness.size(), 3);
  at_port << Mat3::Identity(), stiffness.tail(patch.modes()).cwiseInverse().asDiagonal() * patch.b_k;
  return at_port;
}

/// Returns true if a mode decays within a third of a step of the player.
bool braked_fast(const Patch& patch, int steps) {
  const double fastest = Eigen::SelfAdjointEigenSolver<Matrix>(patch.damping, Eigen::EigenvaluesOnly).eigenvalues().tail<1>()[0];
  return fastest > kDampingPerStepMax * kHapticRateHz * steps;
}

/// Returns the motion of the body with the variables of the patch, 3 N x n.
Matrix moved_by_variables(const HyperModel& model) {
  Matrix moved(model.modes.rows(), model.port.cols() + model.modes.cols());
  moved << model.port, model.modes;
  return moved;
}

}  // namespace

std::optional<NonlinearTerms> nonlinear_terms(const WholeBody& body, const Patch& patch, const HyperModel& model, int vertices) {
  const auto r = patch.stiffness.size(), first = model.port.cols();
  if (r == 0 || !(patch.stiffness.maxCoeff() > 0)) return std::nullopt;
  assert(model.snapshots.rows() == first + r && model.modes.cols() == r);
  assert(model.psd_change.rows() == first + r && model.psd_change.cols() == first + r);
  const bool repaired = is_projected(patch, model), solid = body.dynamics().body().is_solid();
  const int variables = static_cast<int>(first + r);
  Sampling sampling;
  sampling.budget = {variables, first > 0, repaired, vertices, body.dynamics().body().law == SpringLaw::stiffening, solid};
  if (first > 0) {
    Eigen::Index row = 0;
    model.port.cwiseAbs().rowwise().maxCoeff().maxCoeff(&row);
    sampling.tool = static_cast<int>(row / 3);
  }
  sampling.likely = model.snapshots;
  sampling.likeliest = model.likeliest;
  sampling.stiffness = stiffness_of(patch, first);
  if (solid && first > 0) sampling.at_port = held_tool(patch, sampling.stiffness);
  const Matrix moved = moved_by_variables(model);
  NonlinearTerms terms;
  terms.variables = variables;
  terms.grasp = first > 0;
  auto elements = sample_elements(body, moved, sampling);
  if (!elements) return std::nullopt;
  terms.elements = std::move(*elements);
  if (repaired) terms.e2 = repair(model.psd_change);
  terms.rate = stamp_rate(patch);
  const NonlinearForce force(terms, patch);
  if (force.empty()) return std::nullopt;
  if (first == 0 && !solid && braked_fast(patch, force.steps())) terms.elements.damping.setZero();
  return terms;
}

bool terms_depart(const Patch& patch, const NonlinearTerms& terms, Micros horizon) {
  constexpr Micros kCompareEvery{5'000};
  constexpr double kTimes = 2, kBesidesN = 1;  // measured: elements of `spleen` that buckled had 6 N for 0.8
  const ToolAt now{patch.tool, patch.tool_velocity};
  PatchPlayer whole(patch, terms), linear(extended(patch, terms), {});
  for (Micros after = kCompareEvery; after <= horizon; after += kCompareEvery) {
    const ToolSample tool{patch.stamp + after, dead_reckoned(now, seconds(after)).position, patch.turn, patch.opening};
    const Vec3 expected = linear.advance(tool).force;
    if (!((whole.advance(tool).force - expected).norm() <= kTimes * expected.norm() + kBesidesN)) return true;
  }
  return false;
}

}  // namespace palpate
