// What the paper says about its frequency responses (sections 4 and 5) beside what the bode experiment finds.
#pragma once

#include "bench/lab/bode_files.hpp"
#include "bench/lab/experiments.hpp"

namespace palpate {

/// `run` at well-damped parameters, `light` the map's points at one light damping.
std::vector<Finding> bode_findings(const BodeRun& run, const std::vector<MapPoint>& light);
/// Of the cube of the paper's 6000th order.
std::vector<Finding> solid_findings(const PortStudy& solid);

}  // namespace palpate
