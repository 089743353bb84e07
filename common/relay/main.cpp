// palpate-relay: simulates a bad link on one machine, for stress tests with real programs.
#include <fmt/format.h>

#include <asio/signal_set.hpp>
#include <cstdio>

#include "common/base/counted.hpp"
#include "common/base/error.hpp"
#include "common/command_line/flags.hpp"
#include "common/io/udp_relay.hpp"

namespace {

using namespace palpate;

struct Options {
  std::string listen, to;
  double rtt_ms = 0, jitter_ms = 0, loss_pct = 0, burst = 0, duplicate_pct = 0, reorder_pct = 0, kbit_s = 0;
  std::uint64_t seed = 1;
};

void describe_flags(CLI::App& app, Options& o) {
  app.option_defaults()->always_capture_default();
  const auto add = [&](const char* flag, auto& value, const char* type, const char* text) {
    return app.add_option(flag, value, text)->type_name(type);
  };
  add("--listen", o.listen, "HOST:PORT", "address at which clients reach the relay; port 0 chooses a free port")->required();
  add("--to", o.to, "HOST:PORT", "address at which the server listens")->required();
  add("--rtt-ms", o.rtt_ms, "N", "round trip that the relay adds, half of it each way")
      ->required()
      ->check(number_from<double>(0, 60'000));
  add("--jitter-ms", o.jitter_ms, "N", "each way's delay is drawn evenly within +- this, in the order sent")
      ->check(number_from<double>(0, 60'000));
  add("--loss-pct", o.loss_pct, "N", "datagrams lost, each way")->check(number_from<double>(0, 100));
  add("--burst", o.burst, "N", "mean run of lost datagrams, 0: independent losses")->check(number_from<double>(0, 1e6));
  add("--duplicate-pct", o.duplicate_pct, "N", "datagrams that arrive twice, each way")->check(number_from<double>(0, 100));
  add("--reorder-pct", o.reorder_pct, "N", "datagrams that others may overtake, each way")->check(number_from<double>(0, 100));
  add("--kbit-s", o.kbit_s, "N", "bandwidth of each client, each way, 0: unlimited")->check(number_from<double>(0, 1e9));
  add("--seed", o.seed, "N", "seed of all random numbers")->check(whole_number());
}

LinkSpec link_of(const Options& o) {
  LinkSpec spec;
  spec.latency = from_seconds(o.rtt_ms / 2e3);
  spec.jitter = from_seconds(o.jitter_ms / 1e3);
  spec.loss = o.loss_pct / 100;
  spec.burst_mean = o.burst;
  spec.duplicate = o.duplicate_pct / 100;
  spec.reorder = o.reorder_pct / 100;
  spec.kbit_s = o.kbit_s;
  spec.seed = o.seed;
  return spec;
}

void say_start(const UdpRelay& relay, const UdpEndpoint& server, const Options& o) {
  fmt::print(
      "palpate-relay: {} to {}: {} ms +- {} ms each way, loss {} % in runs of {:.3g}, duplicates {} %, reordered {} %, {}, seed "
      "{}\n",
      to_string(relay.address()), to_string(server), o.rtt_ms / 2, o.jitter_ms, o.loss_pct,
      std::max(o.burst, 1 / (1 - o.loss_pct / 100)), o.duplicate_pct, o.reorder_pct,
      o.kbit_s > 0 ? fmt::format("{} kbit/s", o.kbit_s) : "any bandwidth", o.seed);
  std::fflush(stdout);
}

void say_end(const RelayCounts& counts) {
  const auto line = [](const char* way, const LinkCounts& c) {
    fmt::print("palpate-relay: {}: {}, {} bytes, {} lost, {} over the bandwidth, {} twice, {} out of order\n", way,
               counted(c.sent, "datagram"), c.bytes, c.lost, c.queue_dropped, c.duplicated, c.reordered);
  };
  fmt::print("palpate-relay: {}, {} failed\n", counted(counts.clients, "client"), counted(counts.send_failed, "send"));
  line("to the server", counts.up);
  line("to clients", counts.down);
  std::fflush(stdout);
}

void run(const Options& options) {
  asio::io_context io(1);
  const UdpEndpoint listen = resolve_udp("--listen", options.listen);
  const UdpEndpoint server = resolve_udp("--to", options.to);
  if (server.port() == 0) throw InputError("--to", "port 0", "the server's port, 1 to 65535");
  const bool from_anywhere = listen.address().is_unspecified() && server.address().is_loopback();
  if (listen.port() == server.port() && (listen.address() == server.address() || from_anywhere))
    throw InputError("--to", "is the relay's own address", "the server's");
  UdpRelay relay(io, bind_udp(io, "--listen", listen), server, link_of(options));
  asio::signal_set signals(io, SIGINT, SIGTERM);
  signals.async_wait([&io](const asio::error_code&, int) { io.stop(); });
  say_start(relay, server, options);
  io.run();
  say_end(relay.counts());
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("passes datagrams between Palpate clients and a server over a bad link", "palpate-relay");
  palpate::describe_program(
      app, PALPATE_VERSION,
      "palpate-relay --listen 127.0.0.1:47801 --to 127.0.0.1:47800 --rtt-ms 120 --jitter-ms 10 --loss-pct 3\n"
      "  palpate-client --server 127.0.0.1:47801 --motion scenes/motions/organ-tour.csv");
  Options options;
  describe_flags(app, options);
  return palpate::run_program(app, [&] {
    app.parse(argc, argv);
    run(options);
    return 0;
  });
}
