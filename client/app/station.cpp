#include "client/app/station.hpp"

#include <utility>

#include "common/io/monotonic.hpp"

namespace palpate {

namespace {

ClientOptions client_options(const AppOptions& options, SchemeAsked scheme, const std::string& shadow_of) {
  ClientOptions client;
  client.hello.station = shadow_of.empty() ? options.station : shadow_of + "/" + std::string(name_of(scheme));
  client.hello.alike = shadow_of.empty() && !options.station_given;
  client.hello.scheme = scheme;
  client.hello.order = options.order;
  client.hello.shadow_of = shadow_of;
  client.hello.room = options.room;
  client.coupling = options.coupling;
  if (shadow_of.empty()) client.hello.guides = options.guides;
  if (shadow_of.empty()) client.hello.tool = options.tool;
  client.refuses_guidance = options.refuses_guidance;
  return client;
}

}  // namespace

ClientStation::ClientStation(const AppOptions& options, SchemeAsked scheme, const std::string& shadow_of, UdpClient::Watch watch)
    : name_(client_options(options, scheme, shadow_of).hello.station),
      scheme_(scheme),
      core_(client_options(options, scheme, shadow_of), monotonic_now()),
      udp_(options.server, core_, {}, std::move(watch), options.keys) {}

}  // namespace palpate
