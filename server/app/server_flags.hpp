// What palpate-server may be told on its command line.
#pragma once

#include <string>
#include <vector>

#include "common/command_line/mesh_folders.hpp"
#include "server/io/server_shell.hpp"

namespace palpate {

struct ServerFlags {
  std::vector<std::string> scenes;
  MeshFolders mesh_folders;
  std::string listen = "127.0.0.1:47800", record, keys, metrics, log = "text";
  double rate_hz = 20, duration_s = 0, shapes_hz = RecordOptions{}.shapes_hz, deadband = 0;
  /// Nobody is waited for unless that is asked for: who types `kill` wants an end, and where there is no other server for a hand
  /// to go to, waiting helps nobody. Its force fades either way.
  double drain_s = 0;
  std::size_t threads = 0;
  bool print_scene = false, describe = false, insecure = false, resume = false, has_keys = false, has_duration = false,
       has_record = false, has_shapes = false, has_metrics = false;
};

void describe_flags(CLI::App& app, ServerFlags& flags);
/// InputError for flags that do not go together.
void check(const ServerFlags& flags);

}  // namespace palpate
