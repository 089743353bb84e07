// What palpate-client --report wrote of a run, tick by tick.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/types.hpp"

namespace palpate {

/// What one display showed in every millisecond.
struct ReportedDisplay {
  std::string name;
  std::vector<Vec3> force;  ///< on the tool [N]
  std::vector<std::uint8_t> contact;
};

struct ClientReport {
  std::string scheme;  ///< that was felt, at the end where it changed; empty where summary.json does not say
  bool chosen_by_server = false;
  std::string scene, mesh;                ///< name and surface of the body, as the server said; empty where it did not
  int order = 0;                          ///< states of a patch that were asked for, 0: the server's default
  double rate_hz = 0;                     ///< frames of the server a second; 0 where summary.json does not say
  std::vector<Vec3> positions;            ///< of the tool, one a millisecond from the start of the motion [m]
  std::vector<double> patch_age_ms;       ///< of the felt display; below 0: it had no patch
  std::vector<ReportedDisplay> displays;  ///< the felt one first
};

/// Of forces.csv in `folder`: t_s,x_m,y_m,z_m,fx_n,fy_n,fz_n,patch_age_ms,contact, then
/// NAME_fx_n,NAME_fy_n,NAME_fz_n,NAME_contact of every comparison. A tick that was skipped gets its neighbours' values in
/// between: the reference needs one position a millisecond. InputError when it cannot be read, or is no longer than a second.
ClientReport read_client_report(const std::filesystem::path& folder, const std::string& felt_name);

}  // namespace palpate
