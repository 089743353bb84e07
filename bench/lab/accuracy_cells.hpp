// Cells of `palpate-lab accuracy`: the examination (examination.hpp) of one scene through one scheme at one round trip, with the
// real cores in virtual time.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "bench/paper/compared_scheme.hpp"

namespace palpate {

/// Source of error that a row isolates. as_sent: the program as it is. exact_states: the server's body is stepped as finely as
/// the reference, so that only the patch is in error. full_forces and whole_linear, with these states: the body's own forces on
/// the patch's modes, and the whole body linearised, replace the patch (local_model.hpp; not for bodies with relaxation).
/// tremor_floor, without a round trip: the reference against itself with the hand kTremorFloorM off its path; accuracy beyond
/// that is finer than any hand can be held.
enum class AccuracyRow : std::uint8_t { as_sent, exact_states, full_forces, whole_linear, tremor_floor };
inline constexpr std::array<std::string_view, 5> kAccuracyRowNames{"as_sent", "exact_states", "full_forces", "whole_linear",
                                                                   "tremor_floor"};
inline std::string_view name_of(AccuracyRow r) { return kAccuracyRowNames[static_cast<std::size_t>(r)]; }
inline bool has_round_trip(AccuracyRow r) { return r != AccuracyRow::tremor_floor; }
inline constexpr double kTremorFloorM = 1e-5;  ///< along (1, 1, 1); a hand trembles by 50 to 200 um rms (client/device/hand.hpp)

struct AccuracyCell {
  std::string scene;  ///< at_place(), tasks.hpp
  ComparedScheme scheme = ComparedScheme::port;
  AccuracyRow row = AccuracyRow::as_sent;
  double rtt_ms = 0;
  // Results:
  ComparedScheme served = ComparedScheme::port;  ///< scheme of the last patch
  double snr_db = 0;                             ///< as in metrics.hpp
  double median_error = 0, p95_error = 0;        ///< relative error of the force, where it is at least a tenth of its peak
  double frame_bytes = 0;                        ///< bytes of the patch and its terms
  double build_ms = 0, tick_us = 0;              ///< processor time: server per patch, client per tick (median)
};

struct AccuracyGrid {
  std::filesystem::path scenes = "scenes";
  std::vector<std::string> only = {};        ///< scenes by the names of their files; empty: all of the folder
  std::vector<ComparedScheme> schemes = {};  ///< empty: all
  std::vector<double> rtt_ms;
  bool as_sent = false;  ///< only the row as_sent
  int places = 0;        ///< number of places drawn on each scene, instead of its top; 0: the top
};

/// Cells without results, in an order that depends on the grid alone. Throws InputError if there is no such scene.
std::vector<AccuracyCell> accuracy_cells(const AccuracyGrid& grid);
/// Fills in the results of all cells, `jobs` at a time; references are computed once per scene. Removes rows and
/// schemes that do not suit a body, and the cells of scenes whose tool never meets the body in the examination, as there is
/// nothing to score; returns those scenes. Throws what replay() throws.
std::vector<std::string> measure_cells(const AccuracyGrid& grid, std::vector<AccuracyCell>& cells, unsigned jobs);

std::string cells_csv(const std::vector<AccuracyCell>& cells);
/// Parses cells_csv(); throws InputError with file and line.
std::vector<AccuracyCell> read_accuracy_cells(const std::filesystem::path& file);

}  // namespace palpate
