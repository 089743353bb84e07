// The checked command line of palpate-client.
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

/// The options of one hand.
struct AppOptions {
  std::string server;              ///< HOST:PORT
  std::optional<ClientKeys> keys;  ///< none: the server has no keys either
  DeviceKind device = DeviceKind::sim;
  std::string device_name = "sim";  ///< device name as typed
  bool held = false;  ///< true: a hand holds it, i.e. hardware of that name (open_device.hpp), and `device` does not apply
  std::optional<WorkspaceMapping> workspace;  ///< none: the device's readings are scene coordinates
  std::string workspace_place;                ///< origin of that setting, for error messages
  std::optional<Motion> motion;               ///< none: hold still at the server's home position
  std::filesystem::path motion_file;          ///< file that `motion` was read from
  std::string station = "hand";
  bool station_given = false;  ///< false: the server may assign a similar name
  std::string room;            ///< empty: the server's first
  SchemeAsked scheme;          ///< empty: the server chooses
  std::string guides;          ///< station to guide; empty: none
  std::string tool;            ///< name of the scene's tool that it holds; empty: the first
  bool refuses_guidance = false;
  std::uint16_t order = 0;  ///< 0 = the server's default
  Hand hand;
  std::uint64_t seed = 1;
  std::optional<double> release_s;  ///< motion time at which the hand releases the device
  std::vector<Scheme> compare;
  PassivityMode passivity = PassivityMode::on;
  CouplingParameters coupling;   ///< no stiffness: no coupling
  std::filesystem::path report;  ///< empty: none
  std::filesystem::path record;  ///< empty: none
  std::optional<double> duration_s;
  bool realtime = true;
  bool list_devices = false;                ///< only list what is plugged in
  std::optional<std::string> check_device;  ///< name of a device to test without a server
  bool check_link = false;                  ///< only measure the link and the machine
  bool reset = false;                       ///< only reset the body to rest
};

/// Returns the options of each --device, with distinct names. Parses the command line by `app`, to which it adds the flags.
/// Throws InputError for bad usage and bad files, and whatever CLI11 throws.
std::vector<AppOptions> parse_options(CLI::App& app, int argc, char** argv);

}  // namespace palpate
