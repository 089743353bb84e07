#include "server/core/station.hpp"

#include "common/wire/codec.hpp"

namespace palpate {

const Station* Stations::named(const std::string& name) const {
  for (const auto& [id, station] : *this)
    if (station.hello.station == name) return &station;
  return nullptr;
}

const Station* Stations::tool_of(const Station& station) const {
  return station.hello.shadow_of.empty() ? &station : named(station.hello.shadow_of);
}

Micros Stations::station_time(const Station& station, Micros server_time) const {
  const Station* const owner = tool_of(station);
  if (owner && !owner->tool.timeline().empty()) return owner->tool.timeline().to_station(server_time);
  return station.clock.locked() ? station.clock.to_peer(server_time) : Micros{};
}

std::size_t encode_for(Station& station, Payload body, std::span<std::byte> out, Micros now) {
  const Message message{station.secret, station.id, station.seq_out, station.clock.stamp(now), std::move(body)};
  const auto size = encode(message, out);
  if (size > 0) ++station.seq_out;
  return size;
}

}  // namespace palpate
