// Metrics of a hand in a session, as used in training assessments.
//
//   contact_s       time in contact; a force holds until the next one, for at most kHoldMostS
//   force_peak_n    largest |f|;  force_mean_n: mean |f| over the time in contact
//   torque_peak_nm  largest |t| about the tool point; 0 for a tool that is a point
//   over_s          time with |f| above the threshold; overs: number of times it was exceeded, counted anew after it fell below
//                   kOverEnds of it
//   path_m          length of the path, resampled to kResampleHz
//   sparc           spectral arc length of the speed v, also at kResampleHz:
//                     - integral over [0, w_c] of sqrt( (1/w_c)^2 + (dV/dw)^2 ) dw,     V(w) = |F v|(w) / max |F v|
//                   with w_c the highest frequency up to kBandHz at which V is at least kLeastShare (Balasubramanian, Melendez-
//                   Calderon, Roby-Brami, Burdet: On the analysis of movement smoothness, J NeuroEng Rehabil 12:112, 2015). 0 is
//                   the ceiling, one smooth stroke has about -1.4. It does not depend on amplitude or duration, but on the number
//                   of movements, so compare sessions of one task.
#pragma once

#include "common/assessment/session.hpp"

namespace palpate {

inline constexpr double kResampleHz = 100, kBandHz = 10, kLeastShare = 0.05, kHoldMostS = 0.25, kOverEnds = 0.9;
inline constexpr double kOverN = 2;  ///< usual threshold

struct SessionMetrics {
  double duration_s = 0, contact_s = 0, force_peak_n = 0, force_mean_n = 0, torque_peak_nm = 0, over_s = 0, path_m = 0,
         speed_mean_m_s = 0;
  int contacts = 0, overs = 0;
  double sparc = 0;
};

/// Calls add(name, value) for each figure, with the names of summary.json.
template <class Add>
void each_figure(const SessionMetrics& m, const Add& add) {
  add("duration_s", m.duration_s);
  add("contact_s", m.contact_s);
  add("contacts", m.contacts);
  add("force_peak_n", m.force_peak_n);
  add("force_mean_n", m.force_mean_n);
  if (m.torque_peak_nm > 0) add("torque_peak_nm", m.torque_peak_nm);
  add("over_s", m.over_s);
  add("overs", m.overs);
  add("path_m", m.path_m);
  add("speed_mean_m_s", m.speed_mean_m_s);
  add("smoothness_sparc", m.sparc);
}

/// Requires a hand whose path has at least one point.
SessionMetrics session_metrics(const SessionHand& hand, double threshold_n);

/// Positions every 1 / kResampleHz from the first point to the last. A gap between samples is shortened to 10 s, as the motion in
/// it is unknown.
std::vector<Vec3> resampled(std::vector<MotionPoint> path);
/// Speeds between those positions [m/s].
std::vector<double> speeds(const std::vector<Vec3>& positions);
/// Returns 0 for a hand that never moved.
double spectral_arc_length(const std::vector<double>& speed, double sample_hz);

}  // namespace palpate
