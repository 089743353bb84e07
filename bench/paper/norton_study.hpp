// Norton-coupled meshes at work: the paper's sheet under a hand's motion, its remainder at a low rate, beside the force held and
// the port patch at the same frame rate (norton.hpp).
#pragma once

#include <vector>

#include "common/base/types.hpp"

namespace palpate {

struct NortonStudyOptions {
  double stiffness_n_m = 100, damping_n_s_m = 0.5, node_mass_kg = 0.001;  ///< of every element, every node
  int fine_layers = 2;                                                    ///< around the port, at 1 kHz
  double duration_s = 3;
};

/// One frame rate; forces on the holder at every tick [N], and their SNR against the whole mesh at 1 kHz, first 0.25 s left out.
struct NortonRate {
  int rate_hz = 0;
  std::vector<Vec3> hold, norton, port;
  double hold_db = 0, norton_db = 0, port_db = 0;
  bool stable = true;  ///< the split mesh did not grow without bound
};

struct NortonStudy {
  int fine_states = 0, whole_states = 0;
  std::vector<Vec3> whole;
  std::vector<NortonRate> rates;
  double equal_rates_rel_rms = 0;  ///< split at equal rates against unsplit
};

/// `frame_ticks`: the frame periods, in milliseconds.
NortonStudy study_norton(const NortonStudyOptions& options, const std::vector<int>& frame_ticks);

}  // namespace palpate
