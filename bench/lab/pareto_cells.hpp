// What `palpate-lab pareto` computes. A point is the body alone (a pushed cube: size, damping, integrator, step; its error is
// that of the holding force against finer steps), a patch (scene, scheme, states, round trip; its error is that of the felt force
// in the examination, as in `truth`), or a mesh of a body whose continuum somebody else has computed (a case of
// bench/tissue/tissue_case.hpp, element, cells; its error is that of the case, its cost a second of the same body, pushed by its
// highest node in steps of 10 ms).
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
  PushedCube cube;    ///< of a body; where a scene describes it, only how it is stepped
  std::string scene;  ///< of a patch, or of a body that is no cube
  // of a mesh
  std::string body;  ///< "bar", "punch 3 mm"
  double poisson = 0;
  TissueElement element = TissueElement::hexahedron;
  int cells = 0;  ///< over its height
  // of a patch
  Scheme scheme = Scheme::port;
  int order = 0;
  double rtt_ms = 0;
  // measured
  double error = 0;        ///< share: of a body relative_rms(), of a patch the 95th percentile
  double server_ms_s = 0;  ///< processor time of the body a second, of a patch all of its frames
  double build_ms = 0;     ///< of a patch: server a patch,
  double tick_us = 0;      ///< client a tick (median),
  double bytes = 0;        ///< a frame
};

struct ParetoGrid {
  std::filesystem::path scenes = "scenes";
  bool quick = false;
};

std::vector<ParetoCell> pareto_cells(const ParetoGrid& grid);
/// Fills in the measures, `jobs` at a time; references are computed once.
void measure_cells(const ParetoGrid& grid, std::vector<ParetoCell>& cells, unsigned jobs);

/// "body,10,0.2,explicit,10" (or "solid10", of tetrahedra), "body,organ-solid,own,tr-bdf2,10" or "patch,cube6,port,22,150" or
/// "mesh,bar,0.45,hexahedron,4": what --only takes, and how a row of cells.csv begins.
std::string key_of(const ParetoCell& cell);
/// "explicit", "port"
std::string method_of(const ParetoCell& cell);
/// Points of one picture: the same body, the same scene over the same round trip, or the same case.
std::string group_of(const ParetoCell& cell);
/// From a key; InputError with `where` as the place.
ParetoCell pareto_cell_from(const std::string& key, const std::string& where);

/// Indices of the cells, of one group, that no other beats in both error and cost, in the order of their costs.
std::vector<std::size_t> pareto_front(const std::vector<ParetoCell>& cells, double ParetoCell::*cost);

std::string cells_csv(const std::vector<ParetoCell>& cells);
/// The other way; InputError with file and line.
std::vector<ParetoCell> read_pareto_cells(const std::filesystem::path& file);

}  // namespace palpate
