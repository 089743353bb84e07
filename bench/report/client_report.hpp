// Reads a run written by palpate-client --report, tick by tick.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/types.hpp"

namespace palpate {

/// Output of one display in every millisecond.
struct ReportedDisplay {
  std::string name;
  std::vector<Vec3> force;  ///< on the tool [N]
  std::vector<std::uint8_t> contact;
  std::vector<Vec3> torque;  ///< about the tool point [N m]; empty where the report has none
};

struct ClientReport {
  std::string scheme;  ///< scheme in use, the last one if it changed; empty if summary.json does not contain it
  bool chosen_by_server = false;
  std::string scene, mesh;                ///< name and surface of the body as reported by the server; empty if unknown
  std::string scene_hash;                 ///< RoomInfo::scene_hash as reported by the server; empty if unknown
  std::string tool;                       ///< name of the tool that the hand held; empty: the scene's first
  int order = 0;                          ///< requested states of a patch, 0: the server's default
  double rate_hz = 0;                     ///< the server's frames per second; 0 if summary.json does not contain it
  std::vector<Vec3> positions;            ///< positions of the tool, one per millisecond from the start of the motion [m]
  std::vector<Rotation> turns;            ///< how it was held there; empty where no torque was asked for
  std::vector<double> openings;           ///< of its jaws there; empty where they were closed
  std::vector<double> patch_age_ms;       ///< patch age of the felt display; below 0: it had no patch
  std::vector<ReportedDisplay> displays;  ///< the felt one first
};

/// Reads forces.csv in `folder`: t_s,x_m,y_m,z_m,fx_n,fy_n,fz_n,patch_age_ms,contact, then
/// NAME_fx_n,NAME_fy_n,NAME_fz_n,NAME_contact of every comparison; with torque qx,qy,qz,qw and each display's torque, and
/// with jaws opening,grip_nm. A skipped
/// tick is interpolated from its neighbours, as the reference needs one position per millisecond. Throws InputError if the file
/// cannot be read or is not longer than a second.
ClientReport read_client_report(const std::filesystem::path& folder, const std::string& felt_name);

}  // namespace palpate
