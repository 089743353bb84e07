#include "client/app/station.hpp"

#include <utility>

#include "client/device/sim_phantom.hpp"
#include "common/base/error.hpp"
#include "common/io/monotonic.hpp"

namespace palpate {

namespace {

GuardLimits limits_of(const AppOptions& options, const DeviceCaps* hardware) {
  GuardLimits limits;
  limits.passivity = options.passivity;
  if (hardware) {
    if (hardware->force_max_n <= 0 || hardware->slew_max_n_s <= 0)
      throw InputError("--device " + options.device_name, hardware->model + " does not say what force it can render",
                       "a device that does");
    limits.force_max_n = hardware->force_max_n;
    limits.slew_max_n_s = hardware->slew_max_n_s;
  } else if (options.device == DeviceKind::sim) {
    limits.force_max_n = SimPhantomOptions{}.force_max_n;
    limits.slew_max_n_s = SimPhantom::kSlewMaxNS;
  }
  return limits;
}

ClientOptions client_options(const AppOptions& options, SchemeAsked scheme, const std::string& shadow_of,
                             const DeviceCaps* hardware) {
  ClientOptions client;
  client.hello.station = shadow_of.empty() ? options.station : shadow_of + "/" + std::string(name_of(scheme));
  client.hello.alike = shadow_of.empty() && !options.station_given;
  client.hello.scheme = scheme;
  client.hello.order = options.order;
  client.hello.shadow_of = shadow_of;
  client.hello.room = options.room;
  client.guard = limits_of(options, hardware);
  client.coupling = options.coupling;
  return client;
}

}  // namespace

ClientStation::ClientStation(const AppOptions& options, SchemeAsked scheme, const std::string& shadow_of, UdpClient::Watch watch,
                             const DeviceCaps* hardware)
    : name_(client_options(options, scheme, shadow_of, hardware).hello.station),
      scheme_(scheme),
      core_(client_options(options, scheme, shadow_of, hardware), monotonic_now()),
      udp_(options.server, core_, {}, std::move(watch)) {}

}  // namespace palpate
