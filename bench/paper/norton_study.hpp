// Study of Norton-coupled meshes: the paper's sheet under a hand's motion, its remainder at a low rate, compared with the held
// force and the port patch at the same frame rate (norton.hpp).
#pragma once

#include <vector>

#include "common/base/types.hpp"

namespace palpate {

struct NortonStudyOptions {
  double stiffness_n_m = 100, damping_n_s_m = 0.5, node_mass_kg = 0.001;  ///< for every element and every node
  int fine_layers = 2;                                                    ///< layers around the port that run at 1 kHz
  double duration_s = 3;
};

/// One frame rate: forces on the holder at every tick [N], and their SNR against the whole mesh at 1 kHz, without the first 0.25
/// s.
struct NortonRate {
  int rate_hz = 0;
  std::vector<Vec3> hold, norton, port;
  double hold_db = 0, norton_db = 0, port_db = 0;
  bool stable = true;  ///< false: the split mesh diverged
};

struct NortonStudy {
  int fine_states = 0, whole_states = 0;
  std::vector<Vec3> whole;
  std::vector<NortonRate> rates;
  double equal_rates_rel_rms = 0;  ///< error of the split mesh at equal rates against the unsplit one
};

/// `frame_ticks` are the frame periods [ms].
NortonStudy study_norton(const NortonStudyOptions& options, const std::vector<int>& frame_ticks);

}  // namespace palpate
