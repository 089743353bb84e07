// What palpate-client was asked to do, checked.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/device/make_device.hpp"
#include "client/guard/guard.hpp"
#include "client/guard/virtual_coupling.hpp"
#include "client/mapping/workspace_mapping.hpp"
#include "common/motion/motion.hpp"
#include "common/trust/client_channel.hpp"
#include "common/wire/scheme_in_use.hpp"

namespace CLI {
class App;
}

namespace palpate {

/// Of one hand.
struct AppOptions {
  std::string server;              ///< HOST:PORT
  std::optional<ClientKeys> keys;  ///< none: of a server that has none either
  DeviceKind device = DeviceKind::sim;
  std::string device_name = "sim";            ///< as it was typed
  bool held = false;                          ///< by a hand: hardware of that name (open_device.hpp), and no `device`
  std::optional<WorkspaceMapping> workspace;  ///< none: the device's readings are the scene's
  std::string workspace_place;                ///< where that was said, for errors
  std::optional<Motion> motion;               ///< none: hold still at the server's home position
  std::filesystem::path motion_file;          ///< that it was read from
  std::string station = "hand";
  bool station_given = false;  ///< otherwise a name like it will do
  std::string room;            ///< empty: the server's first
  SchemeAsked scheme;          ///< nothing: the server chooses
  std::uint16_t order = 0;     ///< 0 = the server's default
  Hand hand;
  std::uint64_t seed = 1;
  std::optional<double> release_s;  ///< motion time at which the hand lets go
  std::vector<Scheme> compare;
  PassivityMode passivity = PassivityMode::on;
  CouplingParameters coupling;   ///< no stiffness: none
  std::filesystem::path report;  ///< empty: none
  std::filesystem::path record;  ///< empty: none
  std::optional<double> duration_s;
  bool realtime = true;
  bool list_devices = false;                ///< say what is plugged in, feel nothing
  std::optional<std::string> check_device;  ///< of this name: try it without a server
  bool check_link = false;                  ///< measure the link and the machine, feel nothing
  bool reset = false;                       ///< have the body put back to rest, feel nothing
};

/// One for each --device, named apart. Reads the line by `app`, to which it adds the flags. Throws InputError for bad usage and
/// bad files, and what CLI11 throws.
std::vector<AppOptions> parse_options(CLI::App& app, int argc, char** argv);

}  // namespace palpate
