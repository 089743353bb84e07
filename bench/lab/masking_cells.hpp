// Cells of `palpate-lab masking`: one motion on one body through one scheme over one link (replay.hpp).
//
// Bodies are touched scenes, so that contacts begin and end; motions are those of scenes/motions, raised so that they begin 1 mm
// above the middle of the top.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "bench/paper/compared_scheme.hpp"

namespace palpate {

struct MaskingLink {
  double rtt_ms = 0, jitter_ms = 0, loss_pct = 0, burst = 0;
  std::uint64_t seed = 1;
  bool operator==(const MaskingLink&) const = default;
};

struct MaskingCell {
  std::string body, motion;
  ComparedScheme scheme = ComparedScheme::port;
  MaskingLink link;
  // Results:
  double snr_db = 0, p95_over_jnd = 0;
  OnsetErrors onset;
  HandOverSteps hand_over, felt_step;
  double age_p95_ms = 0, uplink_bytes_s = 0;
};

struct MaskingGrid {
  double rtt_ms = 150;                                              ///< round trip at which jitter and loss are varied
  std::vector<std::string> axes{"rtt", "jitter", "loss", "burst"};  ///< axes, with the promised link always added
  bool quick = false;                                               ///< one body, two motions, the ends of the axes
  std::vector<ComparedScheme> schemes = {};                         ///< empty: all
  std::filesystem::path scenes = "scenes";
};

/// Link for which the design's promise holds: 20 ms jitter, 5 % loss; also tried without loss, and without either.
inline constexpr double kPromisedJitterMs = 20, kPromisedLossPct = 5, kPromisedDropDb = 1.5;
/// Mean run of lost datagrams on the burst axis: four patches, 0.2 s at 20 Hz.
inline constexpr double kBurstMean = 4;

/// Cells without results, in an order that depends on the grid alone.
std::vector<MaskingCell> masking_cells(const MaskingGrid& grid);
/// Fills in the results of all cells, `jobs` at a time; references are computed once per body and motion. Throws what replay()
/// throws.
void measure_cells(const MaskingGrid& grid, std::vector<MaskingCell>& cells, unsigned jobs);

std::string cells_csv(const std::vector<MaskingCell>& cells);
/// Parses cells_csv(); throws InputError with file and line.
std::vector<MaskingCell> read_cells(const std::filesystem::path& file);

}  // namespace palpate
