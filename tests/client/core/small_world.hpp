// Server and client cores in virtual time over a queue of datagrams with delay, loss, duplication and reordering.
#pragma once

#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <memory>
#include <random>
#include <vector>

#include "client/core/client_core.hpp"
#include "tests/server/core/fake_room.hpp"

namespace palpate {

struct SmallLink {
  Micros delay{};
  Micros jitter{};
  double loss = 0, duplicate = 0;
};

class SmallWorld {
 public:
  using Bytes = std::vector<std::byte>;
  struct Place {
    std::unique_ptr<ClientCore> core;
    Micros clock_offset{};  ///< its clock minus the server's
    bool moves = true;      ///< false: the haptic thread is stopped
    Orientation turn = {};  ///< of its tool
    double opening = 0;
    Micros sent{};  ///< time of its newest datagram, by its clock
    std::vector<TickOutput> ticks;
  };

  Micros now{100'000'000};
  SmallLink link;
  std::unique_ptr<ServerCore> server;
  FakeRoom room;
  std::map<PeerId, Place> places;
  std::mt19937 random{1};

  explicit SmallWorld(ContactKind contact = ContactKind::touch, double deadband = 0) : contact_(contact), deadband_(deadband) {
    start_server(1);
  }

  ToolShape tool;               ///< of the next server
  std::vector<PartMesh> parts;  ///< of the next server

  void start_server(std::uint64_t instance) {
    RoomInfo facts = test_facts(contact_);
    facts.tool = tool;
    facts.parts = parts;
    facts.coupling_n_m = 1000;
    server =
        std::make_unique<ServerCore>(facts, ServerOptions{.draw = repeatable(instance), .rate_hz = 20, .deadband = deadband_});
  }

  ClientCore& add(PeerId peer, const std::string& name, Micros clock_offset = {}, const std::string& shadow_of = "") {
    ClientOptions options;
    options.hello.station = name;
    options.hello.shadow_of = shadow_of;
    return add(peer, options, clock_offset);
  }
  ClientCore& add(PeerId peer, const ClientOptions& options, Micros clock_offset = {}) {
    auto& place = places[peer];
    place.clock_offset = clock_offset;
    place.core = std::make_unique<ClientCore>(options, now + clock_offset);
    return *place.core;
  }

  void run(Micros time) {
    for (const auto end = now + time; now < end;) {
      now += Micros{1'000};
      deliver();
      if (server) step_server();
      for (auto& [peer, place] : places) step_client(peer, place);
    }
  }
  /// Newest message of the server to a station; a default message if there is none.
  Message newest(PeerId peer) const {
    Message message;
    if (newest_.contains(peer)) REQUIRE(decode(newest_.at(peer), message) == WireFault::none);
    return message;
  }
  Micros clock(PeerId peer) const { return now + places.at(peer).clock_offset; }

 private:
  static constexpr PeerId kServer = 0;
  struct Flight {
    PeerId from, to;
    Bytes bytes;
  };

  void send(PeerId from, PeerId to, std::span<const std::byte> bytes) {
    std::uniform_real_distribution<double> unit(0, 1);
    for (int copies = unit(random) < link.duplicate ? 2 : 1; copies > 0; --copies) {
      if (unit(random) < link.loss) continue;
      const auto extra = from_seconds(unit(random) * seconds(link.jitter));
      flights_.emplace(now + link.delay + extra, Flight{from, to, Bytes(bytes.begin(), bytes.end())});
    }
  }
  void deliver() {
    while (!flights_.empty() && flights_.begin()->first <= now) {
      const auto flight = flights_.begin()->second;
      flights_.erase(flights_.begin());
      if (flight.to == kServer && server) server->take(flight.bytes, flight.from, now);
      const auto place = places.find(flight.to);
      if (place != places.end()) place->second.core->take(flight.bytes, clock(flight.to));
    }
  }
  void step_server() {
    server->tick(now);
    if (const auto job = server->next_job(now)) server->finish(room.run(*job), now);
    std::array<std::byte, kMaxDatagramBytes> bytes;
    PeerId to = 0;
    while (const auto size = server->emit(bytes, to, now)) {
      newest_[to] = Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
      send(kServer, to, newest_[to]);
    }
  }
  void step_client(PeerId peer, Place& place) {
    const auto t = clock(peer);
    if (place.moves)
      place.ticks.push_back(place.core->haptic().tick({t, Vec3(0, 0, 0.01 * std::sin(seconds(t))), place.turn, place.opening}));
    place.core->tick(t);
    std::array<std::byte, kMaxDatagramBytes> bytes;
    while (const auto size = place.core->emit(bytes, t)) {
      place.sent = t;
      send(peer, kServer, std::span(bytes).first(size));
    }
  }

  ContactKind contact_;
  double deadband_;
  std::multimap<Micros, Flight> flights_;
  std::map<PeerId, Bytes> newest_;
};

}  // namespace palpate
