// Flags of palpate-bridge igtl.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "client/igtl/igtl_scene.hpp"
#include "common/command_line/flags.hpp"

namespace palpate {

struct IgtlOptions {
  std::string server, receive, station = "slicer", room, key, token, material, up = "superior";
  std::string listen = "127.0.0.1:18944";
  bool insecure = false;
  double rate_hz = 25, spacing_mm = 8;
  std::optional<double> hold_mm, radius_mm, duration_s;
  std::uint16_t kbit_s = 0;
};

void add_igtl_flags(CLI::App& app, IgtlOptions& options);
/// Throws InputError for flags that do not go together, an unknown material, and a place for a scene that cannot be written;
/// makes the folder of the scene.
void check_igtl(const CLI::App& app, const IgtlOptions& options);

}  // namespace palpate
