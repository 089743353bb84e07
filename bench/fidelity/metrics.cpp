#include "bench/fidelity/metrics.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

double squared_error(std::span<const Vec3> felt, std::span<const Vec3> reference, int delay) {
  const auto n = static_cast<int>(felt.size());
  double sum = 0;
  int count = 0;
  for (int i = std::max(0, delay); i < std::min(n, n + delay); ++i, ++count)
    sum += (felt[static_cast<std::size_t>(i)] - reference[static_cast<std::size_t>(i - delay)]).squaredNorm();
  return count > 0 ? sum / count : 0;
}

int find_lag(std::span<const Vec3> felt, std::span<const Vec3> reference, int most) {
  constexpr int kLeast = -50;
  const auto n = static_cast<int>(felt.size());
  int best = 0;
  double least = squared_error(felt, reference, 0);
  for (int delay = kLeast; delay <= std::min(most, n / 2); ++delay) {
    const double error = squared_error(felt, reference, delay);
    if (error < least) {
      least = error;
      best = delay;
    }
  }
  return best;
}

/// First ticks of contact after at least `free_ticks` without.
std::vector<int> onsets_of(std::span<const std::uint8_t> contact, int free_ticks) {
  std::vector<int> onsets;
  int free = 0;
  for (std::size_t i = 0; i < contact.size(); ++i) {
    if (contact[i] && free >= free_ticks) onsets.push_back(static_cast<int>(i));
    free = contact[i] ? 0 : free + 1;
  }
  return onsets;
}

}  // namespace

OnsetErrors onset_errors(std::span<const std::uint8_t> contact, std::span<const std::uint8_t> reference) {
  OnsetErrors result;
  const std::vector<int> shown = onsets_of(contact, 1);
  std::vector<int> errors;
  for (const int onset : onsets_of(reference, kFreeTicks)) {
    ++result.onsets;
    const auto nearest =
        std::min_element(shown.begin(), shown.end(), [&](int a, int b) { return std::abs(a - onset) < std::abs(b - onset); });
    if (nearest == shown.end() || std::abs(*nearest - onset) > kOnsetWithinMs)
      ++result.missed;
    else
      errors.push_back(*nearest - onset);
  }
  if (errors.empty()) return result;
  std::sort(errors.begin(), errors.end());
  result.median_ms = errors[errors.size() / 2];
  result.worst_ms = std::abs(errors.front()) > std::abs(errors.back()) ? errors.front() : errors.back();
  return result;
}

HandOverSteps hand_over_steps(std::span<const HandOver> swaps) {
  HandOverSteps result;
  result.swaps = swaps.size();
  if (swaps.empty()) return result;
  std::vector<double> steps;
  std::size_t within = 0;
  for (const HandOver& swap : swaps) {
    steps.push_back(swap.step_n);
    within += swap.step_n <= std::max(kStepLimitN, kStepLimitShare * swap.force_n);
  }
  result.share_within = static_cast<double>(within) / static_cast<double>(swaps.size());
  result.max_n = *std::max_element(steps.begin(), steps.end());
  result.p50_n = percentile(steps, 0.5);
  result.p999_n = percentile(std::move(steps), 0.999);
  return result;
}

double percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto k =
      static_cast<std::ptrdiff_t>(std::min(share * static_cast<double>(values.size()), static_cast<double>(values.size()) - 1));
  std::nth_element(values.begin(), values.begin() + k, values.end());
  return values[static_cast<std::size_t>(k)];
}

std::vector<double> relative_errors(std::span<const Vec3> felt, std::span<const Vec3> reference) {
  constexpr double kLeastShare = 0.1;
  double peak = 0;
  for (const Vec3& r : reference) peak = std::max(peak, r.norm());
  std::vector<double> errors;
  for (std::size_t i = 0; i < felt.size(); ++i)
    if (peak > 0 && reference[i].norm() >= kLeastShare * peak)
      errors.push_back((felt[i] - reference[i]).norm() / reference[i].norm());
  return errors;
}

Fidelity compare(std::span<const Vec3> felt, std::span<const Vec3> reference, std::size_t skip, int lag_max_ms) {
  Fidelity result;
  if (felt.size() <= skip) return result;
  felt = felt.subspan(skip);
  reference = reference.subspan(skip);
  const auto n = static_cast<double>(felt.size());
  Vec3 mean = Vec3::Zero();
  for (const Vec3& r : reference) mean += r / n;
  double error = 0, variance = 0, power = 0;
  for (std::size_t i = 0; i < felt.size(); ++i) {
    error += (felt[i] - reference[i]).squaredNorm();
    variance += (reference[i] - mean).squaredNorm();
    power += reference[i].squaredNorm();
    result.contact_ticks += reference[i].squaredNorm() > 0;
  }
  result.snr_db = error > 0 ? std::clamp(10 * std::log10(variance / error), -kSnrCeilingDb, kSnrCeilingDb) : kSnrCeilingDb;
  result.rel_rms = power > 0 ? std::sqrt(error / power) : 0;
  result.p95_rel_error = percentile(relative_errors(felt, reference), 0.95);
  for (std::size_t i = 1; i < felt.size(); ++i)
    result.force_step_max_n =
        std::max(result.force_step_max_n, (felt[i] - felt[i - 1]).norm() - (reference[i] - reference[i - 1]).norm());
  result.lag_ms = find_lag(felt, reference, lag_max_ms);
  return result;
}

}  // namespace palpate
