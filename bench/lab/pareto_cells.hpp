// Points of `palpate-lab pareto`, of three kinds:
//
// - the body alone (a pushed cube: size, damping, integrator, step); its error is that of the holding force against finer steps;
// - a patch (scene, scheme, states, round trip); its error is that of the felt force in the examination, as in `accuracy`;
// - a mesh of a body whose continuum solution is known from elsewhere (a case of bench/tissue/tissue_case.hpp, element, cells);
// its error is that of the case, its cost that of a second of the same body, pushed at its highest node in steps of 10 ms.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "bench/measure/pushed_cube.hpp"
#include "bench/tissue/tissue_case.hpp"
#include "common/port/scheme.hpp"

namespace palpate {

struct ParetoCell {
  bool is_patch = false, is_mesh = false;
  PushedCube cube;    ///< for a body; if a scene describes it, only the step settings
  std::string scene;  ///< for a patch, or for a body that is no cube
  // For a mesh:
  std::string body;  ///< "bar", "punch 3 mm"
  double poisson = 0;
  TissueElement element = TissueElement::hexahedron;
  int cells = 0;  ///< cells over the height
  // For a patch:
  Scheme scheme = Scheme::port;
  int order = 0;
  double rtt_ms = 0;
  // Results:
  double error = 0;        ///< relative: relative_rms() for a body, the 95th percentile for a patch
  double server_ms_s = 0;  ///< processor time per second: of the body, or of all frames for a patch
  double build_ms = 0;     ///< patch: server time per patch
  double tick_us = 0;      ///< client time per tick (median)
  double bytes = 0;        ///< bytes per frame
};

struct ParetoGrid {
  std::filesystem::path scenes = "scenes";
  bool quick = false;
};

std::vector<ParetoCell> pareto_cells(const ParetoGrid& grid);
/// Fills in the results, `jobs` at a time; references are computed once.
void measure_cells(const ParetoGrid& grid, std::vector<ParetoCell>& cells, unsigned jobs);

/// Key of a point, as --only accepts it and as a row of cells.csv begins: "body,10,0.2,explicit,10" (or "solid10", of
/// tetrahedra), "body,organ-solid,own,tr-bdf2,10", "patch,cube6,port,22,150" or "mesh,bar,0.45,hexahedron,4".
std::string key_of(const ParetoCell& cell);
/// Method of a point: "explicit", "port".
std::string method_of(const ParetoCell& cell);
/// Picture to which a point belongs: the same body, the same scene over the same round trip, or the same case.
std::string group_of(const ParetoCell& cell);
/// Parses a key; throws InputError that names `where`.
ParetoCell pareto_cell_from(const std::string& key, const std::string& where);

/// Indices of the cells of one group that no other cell beats in both error and cost, in the order of their costs.
std::vector<std::size_t> pareto_front(const std::vector<ParetoCell>& cells, double ParetoCell::*cost);

std::string cells_csv(const std::vector<ParetoCell>& cells);
/// Parses cells_csv(); throws InputError with file and line.
std::vector<ParetoCell> read_pareto_cells(const std::filesystem::path& file);

}  // namespace palpate
