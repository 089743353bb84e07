// What a run leaves behind: DIR/forces.csv, DIR/summary.json and a few lines for a person.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "client/app/options.hpp"
#include "client/app/tick_log.hpp"
#include "client/core/client_core.hpp"
#include "client/io/haptic_loop.hpp"

namespace palpate {

/// One display of the run: the felt one, or a comparison.
struct DisplayReport {
  SchemeAsked asked;
  std::string scheme;                ///< that was asked for, or of those that the server chose the one that was felt most
  const ClientCore* core = nullptr;  ///< no thread uses it any more
  HapticCounts haptic;
  GuardCounts guard;
};

struct RunReport {
  const AppOptions& options;
  std::vector<DisplayReport> displays;  ///< the felt one first
  HapticLoop* loop = nullptr;           ///< ended; none when the run ended before it began
  const TickLog* ticks = nullptr;       ///< none when no report was asked for, or no motion began
  RealtimeStatus realtime;
};

/// Columns t_s,x_m,y_m,z_m,fx_n,fy_n,fz_n,patch_age_ms,contact, then SCHEME_fx_n,SCHEME_fy_n,SCHEME_fz_n,SCHEME_contact of every
/// comparison. t_s is 0 at the start of the motion; patch_age_ms is -1 while there is no patch. Throws InputError when it cannot
/// be written.
void write_forces(const std::filesystem::path& file, const RunReport& run);
/// With what was run as "run": program, version, scheme (asked for, felt, why, changes and shares of patches where the server
/// chose), order, scene, motion {file, hash}, device, server, station, seed, machine.
void write_summary(const std::filesystem::path& file, const RunReport& run);
std::string describe(const RunReport& run);

}  // namespace palpate
