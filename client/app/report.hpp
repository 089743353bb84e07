// The output of a run: DIR/forces.csv, DIR/summary.json and a few lines for a person.
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
  std::string scheme;                ///< the requested scheme; where the server chose, the one felt most
  const ClientCore* core = nullptr;  ///< not used by any thread any more
  HapticCounts haptic;
  GuardCounts guard;
};

struct RunReport {
  const AppOptions& options;
  std::vector<DisplayReport> displays;  ///< the felt one first
  HapticLoop* loop = nullptr;           ///< stopped; null when the run ended before it began
  const TickLog* ticks = nullptr;       ///< null when no report was requested or no motion began
  RealtimeStatus realtime;
  std::string guidance_partner;  ///< last partner of a guidance; empty: there was none
};

/// Writes the columns t_s,x_m,y_m,z_m,fx_n,fy_n,fz_n,patch_age_ms,contact, then
/// SCHEME_fx_n,SCHEME_fy_n,SCHEME_fz_n,SCHEME_contact for every comparison. Where a patch asked for a torque,
/// qx,qy,qz,qw (how the tool was held) and tx_nm,ty_nm,tz_nm follow, and SCHEME_tx_nm,... for every comparison. t_s is 0 at the
/// start of the motion; patch_age_ms is -1 while there is no patch. Throws InputError when the file cannot be written.
void write_forces(const std::filesystem::path& file, const RunReport& run);
/// Writes the summary. Its key "run" says what was run: program, version, scheme (requested, felt, reason, changes and shares of
/// patches where the server chose), order, scene, motion {file, hash}, device, server, station, seed, machine.
void write_summary(const std::filesystem::path& file, const RunReport& run);
/// Writes the summary of several hands of one program, beside the folders of their reports: its key "hands" has the summary of
/// each by the name of its station. Throws InputError when it cannot be written.
void write_joint_summary(const std::vector<AppOptions>& hands);
std::string describe(const RunReport& run);

}  // namespace palpate
