#include "client/app/options.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "client/device/hardware/open_device.hpp"
#include "client/io/end_signals.hpp"
#include "client/mapping/workspace_file.hpp"
#include "common/base/error.hpp"
#include "common/base/in_quotes.hpp"
#include "common/base/limits.hpp"
#include "common/command_line/flags.hpp"
#include "common/io/key_files.hpp"
#include "common/io/make_folder.hpp"
#include "common/io/record_file.hpp"

namespace palpate {

namespace {

constexpr double kLeastS = 1e-3, kMostS = 30 * 86400.0, kMostCouplingNM = 1e6, kMostCouplingNSM = 1e3;

/// Flags of each hand: given once for all hands, or once for each --device, in order.
struct TypedOfHands {
  std::vector<std::string> devices{"sim"}, motions, stations{"hand"}, hands{"reference"}, tools;
  std::vector<double> scales;
};

/// Flags of one hand, as typed.
struct Typed {
  std::string server, device = "sim", motion, station = "hand", tool, room, scheme = std::string(kAutoName), hand = "reference",
                      compare, passivity = "auto", guide, report, record, realtime = "auto", key, token;
  int order = 0;
  std::uint64_t seed = 1;
  double contact_stiffness_n_m = 0, coupling_n_s_m = 0;
  bool check_link = false, reset = false, list_devices = false, no_guidance = false;
  std::optional<std::string> check_device;
  std::optional<double> duration_s, release_s;
  std::string workspace, save_workspace;
  std::optional<double> scale;
};

void declare_hands(CLI::App& app, TypedOfHands& typed) {
  app.add_option("--device", typed.devices,
                 "sim: a simulated Phantom 1.5 in a simulated hand; sim6: the same, which turns and renders a torque; replay: "
                 "the recorded motion, whatever the force; "
                 "openhaptics[:NAME]: 3D "
                 "Systems Touch and Phantom; forcedimension[:NUMBER]: omega, delta, sigma, lambda, Falcon; inverse3[:ID]: "
                 "Haply Inverse3; hid[:WHICH]: force devices of the open HID profile, six-axis mice, PID joysticks "
                 "(docs/reference/devices.md); "
                 "repeated for further hands of this person")
      ->type_name(fmt::format("sim|sim6|replay|{}", kHardwareKinds))
      ->allow_extra_args(false)
      ->capture_default_str();
  app.add_option(
         "--motion", typed.motions,
         "motion that the hand intends, or that is replayed (palpate-lab gesture makes one for any scene); without it the hand "
         "holds still")
      ->type_name("FILE.csv")
      ->allow_extra_args(false);
  app.add_option(
         "--station", typed.stations,
         "name of this station, unique in the room; the server appends a number to the default name if it is taken; one name "
         "for several devices gets the suffixes -1, -2 ...")
      ->type_name("NAME")
      ->allow_extra_args(false)
      ->capture_default_str();
  app.add_option("--tool", typed.tools, "name of the tool that it holds, of a scene with several; default: the scene's first")
      ->type_name("NAME")
      ->allow_extra_args(false);
  app.add_option("--hand", typed.hands, "stiffness of the hand of --device sim")
      ->type_name("free|light|reference|firm")
      ->allow_extra_args(false)
      ->capture_default_str();
  app.add_option("--scale", typed.scales,
                 "metres that the tool moves in the scene per metre of the device; default: that of --workspace, else 1")
      ->allow_extra_args(false)
      ->check(number_from(kScaleLeast, kScaleMost));
}

void declare(CLI::App& app, Typed& typed, TypedOfHands& each) {
  describe_program(app, PALPATE_VERSION,
                   "palpate-client --server 127.0.0.1:47800 --motion scenes/motions/organ-tour.csv --report out/station");
  CLI::Option* const server =
      app.add_option("--server", typed.server, "address at which palpate-server (or palpate-relay) listens")
          ->required()
          ->type_name("HOST:PORT");
  app.add_option(
         "--key", typed.key,
         "key file of this station (palpate-key new), for a server with --keys; it contains the key of the trusted server")
      ->type_name("FILE");
  app.add_option("--token", typed.token, "token from palpate-key issue, for a server whose key file does not contain this key")
      ->type_name("FILE");
  declare_hands(app, each);
  app.add_option("--room", typed.room, "name of the room on the server; default: its first")->type_name("NAME");
  app.add_option("--scheme", typed.scheme,
                 "scheme of the patches; auto: lets the server choose hyper (nonlinear) or port (linear), frame by frame")
      ->type_name("NAME")
      ->capture_default_str();
  app.add_option("--order", typed.order,
                 fmt::format("states of a patch (twice its modes), even, up to {}; 0: the server's default", 2 * kMaxModes))
      ->capture_default_str();
  app.add_option("--seed", typed.seed, "seed of the simulated tremor")->capture_default_str()->check(whole_number());
  app.add_option("--release-s", typed.release_s, "motion time at which the hand of --device sim releases the device")
      ->check(number_from(0.0, kMostS));
  app.add_option("--compare", typed.compare, "schemes to compare on the same hand without rendering them, separated by commas")
      ->type_name("NAME,...");
  app.add_option(
         "--passivity", typed.passivity,
         "observe: account for the energy that the display gives to the hand; on: also damp a display that becomes active; "
         "off: neither; auto: observe for --device replay, which renders no force, otherwise on")
      ->type_name("auto|off|observe|on")
      ->capture_default_str();
  app.add_option("--coupling-n-m", typed.contact_stiffness_n_m,
                 "stiffness of a virtual coupling between device and model; 0: none")
      ->check(number_from(0.0, kMostCouplingNM))
      ->capture_default_str();
  app.add_option("--coupling-n-s-m", typed.coupling_n_s_m, "damping of the virtual coupling")
      ->check(number_from(0.0, kMostCouplingNSM))
      ->capture_default_str();
  app.add_option("--guide", typed.guide,
                 "station of this room whose tool this one guides: a spring over the network holds the two together, and both "
                 "feel it; with keys, needs the role guide")
      ->type_name("NAME");
  app.add_flag("--no-guidance", typed.no_guidance, "let no other station guide this one");
  app.add_option("--report", typed.report, "folder for forces.csv and summary.json of the run")->type_name("DIR");
  app.add_option("--record", typed.record, "record every tick, patch and event to a new file (docs/reference/recording.md)")
      ->type_name("FILE");
  app.add_option(
         "--workspace", typed.workspace,
         "place of each device's workspace in the scene, its scale, clutch and dead-man buttons and the weight of its tool "
         "(docs/reference/workspace.md); default: the middle of a real device's workspace is at the scene's home, at scale 1; "
         "sim "
         "and replay use the scene's own coordinates")
      ->type_name("FILE.json");
  app.add_option("--save-workspace", typed.save_workspace, "write the mapping in use, to be edited and read by --workspace")
      ->type_name("FILE.json");
  app.add_option("--duration-s", typed.duration_s,
                 "end after this many seconds; the hand holds still once its motion has ended; default: end with the motion")
      ->check(number_from(kLeastS, kMostS));
  // for modes that work without a server
  const auto alone = [server](const std::string&) { server->required(false); };
  app.add_flag("--list-devices", typed.list_devices,
               "list the devices that are plugged in, with their nodes, whether they can be used, and what is missing; exit 0: "
               "one can be "
               "used, 1: none")
      ->each(alone);
  app.add_option(
         "--check-device", typed.check_device,
         "try a device without a server for --duration-s (default 10): the loop's rate and jitter, steps and noise of the "
         "position, workspace, buttons and, if confirmed, its forces; exit 0: it serves, 1: it does not")
      ->type_name("NAME")
      ->each(alone);
  app.add_flag(
      "--check-link", typed.check_link,
      "measure the link and this machine for --duration-s (default 10) and say whether they serve and what to set; exit 0: "
      "they do, 1: they do not");
  app.add_flag("--reset", typed.reset,
               "reset the body to rest and end, without a hand; exit 1: no answer within --duration-s (default 5)");
  app.add_option("--realtime", typed.realtime,
                 "auto: request real-time priority and locked memory, and report what was denied; off: request neither")
      ->type_name("auto|off")
      ->capture_default_str();
}

template <class Value>
Value choose(const char* flag, const std::string& typed, std::initializer_list<std::pair<const char*, Value>> choices) {
  std::string expected;
  for (const auto& [name, value] : choices) {
    if (typed == name) return value;
    expected += (expected.empty() ? "" : ", ") + std::string(name);
  }
  throw InputError(flag, "'" + typed + "'", "one of " + expected);
}

DeviceKind device_of(const std::string& typed) {
  if (typed == "sim") return DeviceKind::sim;
  if (typed == "sim6") return DeviceKind::sim6;
  if (typed == "replay") return DeviceKind::replay;
  if (is_hardware(typed)) return DeviceKind::sim;  // not used
  throw InputError("--device", "'" + typed + "' is not a device", fmt::format("sim|sim6|replay|{}", kHardwareKinds));
}

PassivityMode passivity_of(const std::string& typed, DeviceKind device) {
  const PassivityMode usual = device == DeviceKind::replay ? PassivityMode::observe : PassivityMode::on;
  return choose<PassivityMode>(
      "--passivity", typed,
      {{"auto", usual}, {"off", PassivityMode::off}, {"observe", PassivityMode::observe}, {"on", PassivityMode::on}});
}

/// `expected`: values other than scheme names that the flag accepts.
Scheme scheme_of(const char* flag, const std::string& typed, std::string expected = "") {
  if (const auto scheme = scheme_from_name(typed)) return *scheme;
  for (const auto name : kSchemeNames) expected += (expected.empty() ? "" : ", ") + std::string(name);
  throw InputError(flag, "'" + typed + "' is not a scheme", "one of " + expected);
}

SchemeAsked asked_scheme_of(const char* flag, const std::string& typed) {
  if (typed == kAutoName) return std::nullopt;
  return scheme_of(flag, typed, std::string(kAutoName));
}

std::vector<Scheme> schemes_of(const char* flag, const std::string& typed) {
  std::vector<Scheme> schemes;
  for (std::size_t begin = 0; begin < typed.size();) {
    const std::size_t comma = std::min(typed.find(',', begin), typed.size());
    const Scheme scheme = scheme_of(flag, typed.substr(begin, comma - begin));
    if (std::find(schemes.begin(), schemes.end(), scheme) != schemes.end())
      throw InputError(flag, "'" + std::string(name_of(scheme)) + "' twice", "every scheme once");
    schemes.push_back(scheme);
    begin = comma + 1;
  }
  return schemes;
}

void check_seen(const std::string& flag, const std::string& name) {
  if (!is_plain_name(name)) throw InputError(flag, in_quotes(name, '\'') + " is no name", kNameCharacters);
}

std::string name_of_other(const std::string& flag, const std::string& typed) {
  if (typed.size() > static_cast<std::size_t>(kMaxNameBytes))
    throw InputError(flag, "'" + typed + "' is too long", "at most " + std::to_string(kMaxNameBytes) + " bytes");
  check_seen(flag, typed);
  return typed;
}

std::string station_of(const std::string& typed, const std::vector<Scheme>& compare) {
  std::size_t longest = typed.size();
  for (const Scheme scheme : compare) longest = std::max(longest, typed.size() + 1 + name_of(scheme).size());
  if (typed.empty() || longest > static_cast<std::size_t>(kMaxNameBytes))
    throw InputError("--station", "'" + typed + "' with " + std::to_string(longest) + " bytes (with /SCHEME for --compare)",
                     "1 to " + std::to_string(kMaxNameBytes) + " bytes");
  check_seen("--station", typed);
  return typed;
}

std::uint16_t order_of(int typed) {
  if (typed < 0 || typed > 2 * kMaxModes || typed % 2 != 0)
    throw InputError("--order", std::to_string(typed) + " states", "an even number from 0 to " + std::to_string(2 * kMaxModes));
  return static_cast<std::uint16_t>(typed);
}

CouplingParameters coupling_of(const Typed& typed) {
  if (typed.coupling_n_s_m > 0 && typed.contact_stiffness_n_m <= 0)
    throw InputError("--coupling-n-s-m", "without a stiffness", "--coupling-n-m above 0");
  return {typed.contact_stiffness_n_m, typed.coupling_n_s_m, 0};
}

/// Refuses empty values, the result of an unset shell variable.
void refuse_empty(const CLI::App& app, std::initializer_list<std::pair<const char*, const std::string*>> flags) {
  for (const auto& [flag, typed] : flags)
    if (app.count(flag) > 0 && typed->empty()) throw InputError(flag, "is empty", "a value, or no such flag");
}

void add_workspace(const Typed& typed, AppOptions& options) {
  if (options.held || typed.scale) options.workspace.emplace();  // all others read in the scene's own frame
  options.workspace_place = "--device " + typed.device;
  if (!typed.workspace.empty()) {
    options.workspace_place = typed.workspace;
    options.workspace = mapping_for(read_workspace(std::filesystem::path(typed.workspace)), typed.device);
    if (!options.workspace) throw InputError(typed.workspace, "says nothing of " + typed.device, "an entry with this \"device\"");
  }
  if (typed.scale) options.workspace->scale = *typed.scale;
}

AppOptions checked(const Typed& typed, const CLI::App& app) {
  refuse_empty(app, {{"--motion", &typed.motion},
                     {"--compare", &typed.compare},
                     {"--guide", &typed.guide},
                     {"--tool", &typed.tool},
                     {"--key", &typed.key},
                     {"--token", &typed.token},
                     {"--report", &typed.report},
                     {"--record", &typed.record},
                     {"--workspace", &typed.workspace},
                     {"--save-workspace", &typed.save_workspace}});
  AppOptions options;
  options.server = typed.server;
  if (!typed.token.empty() && typed.key.empty()) throw InputError("--token", "without --key", "the key that it was issued for");
  if (!typed.key.empty()) options.keys = read_client_keys(typed.key, typed.token);
  options.device = device_of(typed.device);
  options.held = is_hardware(typed.device);
  options.device_name = typed.device;
  options.list_devices = typed.list_devices;
  options.check_device = typed.check_device;
  add_workspace(typed, options);
  options.scheme = asked_scheme_of("--scheme", typed.scheme);
  options.compare = schemes_of("--compare", typed.compare);
  options.station = station_of(typed.station, options.compare);
  options.station_given = app.count("--station") > 0;
  options.room = name_of_other("--room", typed.room);
  options.guides = name_of_other("--guide", typed.guide);
  options.tool = name_of_other("--tool", typed.tool);
  if (options.guides == options.station) throw InputError("--guide", "'" + typed.guide + "' is this station", "another station");
  options.refuses_guidance = typed.no_guidance;
  options.order = order_of(typed.order);
  options.hand = choose<Hand>("--hand", typed.hand,
                              {{"free", *hand_from_name("free")},
                               {"light", *hand_from_name("light")},
                               {"reference", *hand_from_name("reference")},
                               {"firm", *hand_from_name("firm")}});
  options.seed = typed.seed;
  options.passivity = passivity_of(typed.passivity, options.device);
  options.coupling = coupling_of(typed);
  options.check_link = typed.check_link;
  options.reset = typed.reset;
  if (typed.reset && typed.check_link) throw InputError("--reset", "with --check-link", "one of the two");
  if (typed.check_link && !typed.record.empty())
    throw InputError("--record", "with --check-link", "a run with a hand: --check-link feels nothing");
  options.record = typed.record;
  options.realtime = choose<bool>("--realtime", typed.realtime, {{"auto", true}, {"off", false}});
  options.duration_s = typed.duration_s;
  options.release_s = typed.release_s;
  if (options.held && !typed.motion.empty())
    throw InputError("--motion", "with --device " + typed.device,
                     "--device sim or replay: a hand that holds a device moves by itself");
  if (options.release_s && (options.device == DeviceKind::replay || options.held))
    throw InputError("--release-s", "with --device " + typed.device, "--device sim or sim6: a recording has no hand to let go");
  options.motion_file = typed.motion;
  if (!typed.motion.empty()) options.motion = read_motion(options.motion_file);
  if (!options.motion && options.device == DeviceKind::replay)
    throw InputError("--device replay", "nothing to replay", "--motion FILE.csv");
  options.report = typed.report;
  make_folder("--report " + typed.report, options.report);
  return options;
}

/// Returns the value for hand k of n of a flag that counts for all hands or for each one.
template <class Value>
std::optional<Value> typed_for(const char* flag, const std::vector<Value>& values, std::size_t k, std::size_t n) {
  if (values.empty()) return std::nullopt;
  if (values.size() != 1 && values.size() != n)
    throw InputError(flag, fmt::format("is there {} times for {} devices", values.size(), n),
                     n == 1 ? "once" : fmt::format("once for all, or {} times", n));
  return values[values.size() == 1 ? 0 : k];
}

/// Returns the flags of hand k of n, with distinct names, reports and recordings.
Typed hand_of(const Typed& all, const TypedOfHands& each, std::size_t k) {
  const std::size_t n = each.devices.size();
  Typed typed = all;
  typed.device = each.devices[k];
  typed.motion = typed_for("--motion", each.motions, k, n).value_or("");
  typed.station = *typed_for("--station", each.stations, k, n);
  typed.tool = typed_for("--tool", each.tools, k, n).value_or("");
  typed.hand = *typed_for("--hand", each.hands, k, n);
  typed.scale = typed_for("--scale", each.scales, k, n);
  if (n == 1) return typed;
  if (each.stations.size() == 1) typed.station += fmt::format("-{}", k + 1);
  typed.seed += k;
  if (!all.report.empty()) typed.report = (std::filesystem::path(all.report) / plain_name(typed.station)).string();
  if (!all.record.empty()) typed.record = named_after(all.record, typed.station).string();
  return typed;
}

void check_together(const std::vector<AppOptions>& hands) {
  if (hands.size() > CrashStop::kMost)
    throw InputError("--device", fmt::format("is given {} times", hands.size()),
                     fmt::format("{} devices of one program at most", CrashStop::kMost));
  for (std::size_t k = 1; k < hands.size(); ++k) {
    for (std::size_t i = 0; i < k; ++i)
      if (plain_name(hands[i].station) == plain_name(hands[k].station))
        throw InputError("--station", fmt::format("'{}' twice", hands[k].station), "a name of its own for each device");
    if (hands[k].check_link || hands[k].reset)
      throw InputError(hands[k].reset ? "--reset" : "--check-link", "with several devices", "none: no device takes part");
  }
}

void save_workspace(const std::string& file, const std::vector<AppOptions>& hands) {
  std::vector<NamedMapping> all;
  for (const AppOptions& hand : hands) {
    const auto same = [&](const NamedMapping& named) { return named.device == hand.device_name; };
    if (std::none_of(all.begin(), all.end(), same))
      all.push_back({hand.device_name, hand.workspace.value_or(WorkspaceMapping{})});
  }
  write_workspace(file, all);
}

}  // namespace

std::vector<AppOptions> parse_options(CLI::App& app, int argc, char** argv) {
  Typed typed;
  TypedOfHands each;
  declare(app, typed, each);
  app.parse(argc, argv);
  std::vector<AppOptions> hands;
  for (std::size_t k = 0; k < each.devices.size(); ++k) hands.push_back(checked(hand_of(typed, each, k), app));
  check_together(hands);
  if (!typed.save_workspace.empty()) save_workspace(typed.save_workspace, hands);
  return hands;
}

}  // namespace palpate
