// Comparison of small models of a specimen at its port: the paper's figures 5, 9 and 11 as numbers.
//
// Each model has its response over frequency, the relative error at DC and over the bands 10-100 Hz and 100-1000 Hz
// (response.hpp), and its H-infinity error, relative to the norm of the whole body's G - s D1 (hinf.hpp). The order of the
// models: full, balanced, ring, two-layer, condensed, port.
#pragma once

#include <string>
#include <vector>

#include "bench/paper/hinf.hpp"
#include "bench/paper/response.hpp"
#include "bench/paper/specimen.hpp"

namespace palpate {

struct PortStudyOptions {
  std::vector<int> orders{10, 12, 20};  ///< orders of balanced truncation
  int rings = 4;                        ///< layers of the largest ring
  bool imaginary_shifts = true;         ///< include the port basis at imaginary shifts
  double from_hz = 0.1, to_hz = 2000;
  int per_decade = 100;
};

struct PortModel {
  std::string name, title;  ///< key of the summary; text for a legend
  Eigen::Index states = 0;
  Response response;
  std::vector<double> error;    ///< relative, by frequency
  ReductionError hinf;          ///< infinite if the model's own damper at the port differs from the body's
  double hinf_sampled_n_m = 0;  ///< largest error on the frequencies of `response` and at 0: a lower bound of hinf.peak
  double dc_rel_error = 0, band_10_100_rel_error = 0, band_100_1000_rel_error = 0;
};

struct PortStudy {
  PeakGain proper_norm;           ///< norm of the whole body's G - s D1 [N/m]
  std::vector<PortModel> models;  ///< the whole body first
  Vector hankel;                  ///< [N/m]

  const PortModel& full() const { return models.front(); }
  const PortModel* find(const std::string& name) const;
};

/// `balanced` is the reduction of specimen.system().
PortStudy study_port(const Specimen& specimen, const BalancedReduction& balanced, const PortStudyOptions& options);

}  // namespace palpate
