#include "common/assessment/session_metrics.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <unsupported/Eigen/FFT>

namespace palpate {
namespace {

void measure_forces(SessionMetrics& m, const std::vector<SessionForce>& forces, double threshold_n) {
  double impulse_n_s = 0;
  bool contact = false, over = false;
  for (std::size_t i = 0; i < forces.size(); ++i) {
    const SessionForce& now = forces[i];
    const double n = now.force.norm();
    const double next_s = i + 1 < forces.size() ? forces[i + 1].t_s : now.t_s;
    const double held_s = std::min(next_s - now.t_s, kHoldMostS);
    m.contacts += now.contact && !contact;
    m.overs += n > threshold_n && !over;
    contact = now.contact;
    over = n > (over ? kOverEnds : 1) * threshold_n;
    m.force_peak_n = std::max(m.force_peak_n, n);
    m.torque_peak_nm = std::max(m.torque_peak_nm, now.torque.norm());
    if (n > threshold_n) m.over_s += held_s;
    if (!contact) continue;
    m.contact_s += held_s;
    impulse_n_s += n * held_s;
  }
  if (m.contact_s > 0) m.force_mean_n = impulse_n_s / m.contact_s;
}

}  // namespace

std::vector<Vec3> resampled(std::vector<MotionPoint> path) {
  constexpr double kFarthestS = 10;
  double left_out_s = 0, before_s = path.front().t_s;
  for (MotionPoint& point : path) {
    left_out_s += std::max(0.0, point.t_s - before_s - kFarthestS);
    before_s = point.t_s;
    point.t_s -= left_out_s;
  }
  std::vector<Vec3> positions;
  const double begin_s = path.front().t_s;
  const auto count = static_cast<std::size_t>((path.back().t_s - begin_s) * kResampleHz + 1e-9) + 1;
  std::size_t after = 1;
  for (std::size_t i = 0; i < count; ++i) {
    const double t = begin_s + static_cast<double>(i) / kResampleHz;
    while (after < path.size() && path[after].t_s <= t) ++after;
    const MotionPoint &a = path[after - 1], &b = path[std::min(after, path.size() - 1)];
    const double share = b.t_s > a.t_s ? (t - a.t_s) / (b.t_s - a.t_s) : 0;
    positions.push_back(a.position + share * (b.position - a.position));
  }
  return positions;
}

std::vector<double> speeds(const std::vector<Vec3>& positions) {
  std::vector<double> speed;
  for (std::size_t i = 1; i < positions.size(); ++i) speed.push_back((positions[i] - positions[i - 1]).norm() * kResampleHz);
  return speed;
}

double spectral_arc_length(const std::vector<double>& speed, double sample_hz) {
  constexpr std::size_t kPadding = 16;  // finer steps in frequency, as in the original method
  if (speed.empty()) return 0;
  std::vector<double> padded = speed;
  padded.resize(std::bit_ceil(speed.size()) * kPadding);
  std::vector<std::complex<double>> spectrum;
  Eigen::FFT<double> fft;
  fft.fwd(spectrum, padded);
  std::vector<double> share;
  double largest = 0;
  for (const auto& value : spectrum) largest = std::max(largest, std::abs(value));
  if (!(largest > 0)) return 0;
  const double step_hz = sample_hz / static_cast<double>(padded.size());
  for (std::size_t k = 0; k < spectrum.size() && static_cast<double>(k) * step_hz <= kBandHz; ++k)
    share.push_back(std::abs(spectrum[k]) / largest);
  while (share.size() > 1 && share.back() < kLeastShare) share.pop_back();
  std::size_t first = 0;
  while (first + 1 < share.size() && share[first] < kLeastShare) ++first;
  const double steps = static_cast<double>(share.size() - 1 - first);
  double length = 0;
  for (std::size_t k = first + 1; k < share.size(); ++k) length += std::hypot(1 / steps, share[k] - share[k - 1]);
  return -length;
}

SessionMetrics session_metrics(const SessionHand& hand, double threshold_n) {
  SessionMetrics m;
  m.duration_s = hand.path.back().t_s - hand.path.front().t_s;
  measure_forces(m, hand.forces, threshold_n);
  const std::vector<double> speed = speeds(resampled(hand.path));
  for (const double v : speed) m.path_m += v / kResampleHz;
  if (m.duration_s > 0) m.speed_mean_m_s = m.path_m / m.duration_s;
  m.sparc = spectral_arc_length(speed, kResampleHz);
  return m;
}

}  // namespace palpate
