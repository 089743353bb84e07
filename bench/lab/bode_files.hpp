// Files of section `bode` of palpate-lab paper: NAME.csv for every model (magnitude and phase of the three entries over
// frequency, relative error), hankel.csv, map.csv and map-one-per-cent.csv, and their plots.
#pragma once

#include <filesystem>

#include "bench/paper/port_study.hpp"
#include "bench/paper/truncation_map.hpp"

namespace palpate {

inline constexpr double kOnePerCent = 0.01;  ///< error threshold of the paper
inline constexpr int kPaperOrder = 10;       ///< order of the paper's reduced model

struct BodeRun {
  Material material;
  PortStudy study;
  std::vector<MapPoint> map;  ///< may be empty
};

/// Entries of the p x p response: the last axis is the normal of the surface, the first lies in the surface.
struct PortEntries {
  Complex normal, tangential, cross;
};
PortEntries port_entries(const ComplexMatrix& g);

double decibels(double ratio);
/// Largest normal-tangential entry [N/m].
double largest_cross(const PortModel& model);

/// Writes everything but the plots.
void write_bode(const std::filesystem::path& out, const BodeRun& run);

/// Writes bode.svg (fig. 5: whole body and the first balanced model), ring.svg (fig. 9: ring-1 and a balanced model with as many
/// states), layers.svg (rings), local.svg (figs 10 and 11: local models with the right stiffness at rest), error.svg (all over
/// frequency), map.svg (error over order and damping with the line of 1 %).
void plot_bode(const std::filesystem::path& out, const BodeRun& run);

}  // namespace palpate
