// What `palpate-lab truth` computes: one cell is the examination (examination.hpp) of one scene through one scheme at one round
// trip, by the real cores in virtual time.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "common/port/scheme.hpp"

namespace palpate {

/// Where the error is sought: as_sent, the program as it is; exact_states, the server's body stepped as finely as the reference,
/// so that nothing but the patch is wrong; with these states full_forces, the body's own forces on the patch's modes, and
/// whole_linear, the whole body linearised, in place of the patch (local_model.hpp; of no body whose stress fades). tremor_floor,
/// at no round trip, is the reference against itself, the hand kTremorFloorM off its path: what a scheme has beyond that is finer
/// than any hand is held.
enum class TruthRow : std::uint8_t { as_sent, exact_states, full_forces, whole_linear, tremor_floor };
inline constexpr std::array<std::string_view, 5> kTruthRowNames{"as_sent", "exact_states", "full_forces", "whole_linear",
                                                                "tremor_floor"};
inline std::string_view name_of(TruthRow r) { return kTruthRowNames[static_cast<std::size_t>(r)]; }
inline bool has_round_trip(TruthRow r) { return r != TruthRow::tremor_floor; }
inline constexpr double kTremorFloorM = 1e-5;  ///< along (1, 1, 1); a hand trembles by 50 to 200 um rms (client/device/hand.hpp)

struct TruthCell {
  std::string scene;  ///< at_place(), tasks.hpp
  Scheme scheme = Scheme::port;
  TruthRow row = TruthRow::as_sent;
  double rtt_ms = 0;
  // measured
  Scheme served = Scheme::port;            ///< what the server made of it
  double snr_db = 0;                       ///< as in metrics.hpp
  double median_error = 0, p95_error = 0;  ///< of the force, where it is at least a tenth of its peak
  double frame_bytes = 0;                  ///< of the patch and its upgrades
  double build_ms = 0, tick_us = 0;        ///< processor time: server a patch, client a tick (median)
};

struct TruthGrid {
  std::filesystem::path scenes = "scenes";
  std::vector<std::string> only = {};  ///< scenes, by the names of their files; none: all of the folder
  std::vector<Scheme> schemes = {};    ///< none: all that this build has
  std::vector<double> rtt_ms;
  bool as_sent = false;  ///< that row alone
  int places = 0;        ///< so many places drawn on each scene in place of its top; 0: the top
};

/// Cells without their measures, in an order that depends on the grid alone. InputError where there is no such scene.
std::vector<TruthCell> truth_cells(const TruthGrid& grid);
/// Fills in the measures of all cells, `jobs` at a time; references are computed once a scene. Cells of scenes whose tool never
/// meets the body in the examination are taken out: there is nothing to score. Returns those scenes. Rows that a body has not are
/// taken out too. Throws what replay() throws.
std::vector<std::string> measure_cells(const TruthGrid& grid, std::vector<TruthCell>& cells, unsigned jobs);

std::string cells_csv(const std::vector<TruthCell>& cells);
/// The other way; InputError with file and line.
std::vector<TruthCell> read_truth_cells(const std::filesystem::path& file);

}  // namespace palpate
