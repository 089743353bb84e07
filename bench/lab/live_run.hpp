// One run in real time over a bad link on this machine: server, relay and client, over UDP on the loopback.
//
// Server and relay run on threads of this process, as their programs run them; the hand is palpate-client itself, beside this
// program, with a device that follows the motion as it is, so that the same motion in virtual time has the same truth.
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
  std::filesystem::path folder;  ///< for the client's report and log, and the room's recording
};

struct LiveRun {
  ClientReport report;
  Json client;                      ///< summary.json of its report
  ServerCounts server;              ///< of the whole run, before and after the motion too
  std::vector<Micros> frame_times;  ///< of the frames that stepped the body
};

/// InputError when palpate-client is not beside this program, std::runtime_error when a part of the run fails.
LiveRun run_live(const LiveSetting& setting);

}  // namespace palpate
