// Command-line flags of palpate-server.
#pragma once

#include <string>
#include <vector>

#include "common/command_line/mesh_folders.hpp"
#include "server/io/udp_server.hpp"

namespace palpate {

struct ServerFlags {
  std::vector<std::string> scenes;
  MeshFolders mesh_folders;
  std::string listen = "127.0.0.1:47800", record, keys, metrics, log = "text";
  double rate_hz = 20, duration_s = 0, shapes_hz = RecordOptions{}.shapes_hz, deadband = 0;
  /// Time to wait for hands to leave [s]. Zero by default: `kill` should end the server, and where there is no other server for a
  /// hand to move to, waiting gains nothing. The force fades in either case.
  double drain_s = 0;
  std::size_t threads = 0;
  bool print_scene = false, describe = false, insecure = false, resume = false, has_keys = false, has_duration = false,
       has_record = false, has_shapes = false, has_metrics = false;
};

void describe_flags(CLI::App& app, ServerFlags& flags);
/// Throws InputError for flags that exclude each other.
void check(const ServerFlags& flags);

}  // namespace palpate
