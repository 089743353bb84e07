// One run in real time over a bad link on this machine: server, relay and client, over UDP on the loopback.
//
// Server and relay run on threads of this process, as in their programs. The hand is palpate-client itself, from the folder of
// this program, with a device that follows the motion exactly, so the same motion in virtual time has the same reference.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "bench/felt/client_report.hpp"
#include "bench/output/output.hpp"
#include "common/link/link_model.hpp"
#include "server/core/server_core.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

struct LiveSetting {
  Scene scene;
  std::filesystem::path motion;  ///< file
  std::string scheme;
  LinkSpec each_way;
  double rate_hz = 20;
  std::filesystem::path folder;  ///< folder for the client's report and log, and for the room's recording
};

struct LiveRun {
  ClientReport report;
  Json client;                      ///< summary.json of its report
  ServerCounts server;              ///< over the whole run, including before and after the motion
  std::vector<Micros> frame_times;  ///< for frames that stepped the body
};

/// Throws InputError if palpate-client is not in the folder of this program, std::runtime_error if a part of the run fails.
LiveRun run_live(const LiveSetting& setting);

}  // namespace palpate
