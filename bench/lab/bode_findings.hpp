// Compares the paper's statements on frequency responses (sections 4 and 5) with the results of the bode experiment.
#pragma once

#include "bench/lab/bode_files.hpp"
#include "bench/lab/experiments.hpp"

namespace palpate {

/// `run` has well-damped parameters; `light` are the map's points at one light damping.
std::vector<Finding> bode_findings(const BodeRun& run, const std::vector<MapPoint>& light);
/// Findings for the cube of the paper's 6000th order.
std::vector<Finding> solid_findings(const PortStudy& solid);

}  // namespace palpate
