// Limits of local models: bodies with a soft base, with lumps or tears, and large excursions. Section 7 of the paper.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "bench/paper/cube.hpp"

namespace palpate {

/// One curve: fidelity of a scheme over the varied quantity (a ratio of stiffness, or a depth in mm).
struct LimitCurve {
  std::string body;
  Scheme scheme = Scheme::port;
  double rtt_ms = 0;
  std::vector<double> at, snr_db;
};

struct Limits {
  std::vector<LimitCurve> flaws;   ///< over the ratio of stiff to soft springs
  std::vector<LimitCurve> depths;  ///< over the mean depth of the excursion [mm], scheme port: linear and stiffening springs
};

struct LimitsPlan {
  std::vector<double> ratios, depths_mm, rtt_ms;
  double motion_s = 2;
};
LimitsPlan limits_plan(bool quick);

/// Writes flaws.csv, depths.csv, summary.json, flaws.svg and depths.svg to `out`.
Limits find_limits(const LimitsPlan& plan, double rate_hz, const std::filesystem::path& out);

}  // namespace palpate
