// palpate-relay: a bad link on one machine, for stress tests with real programs.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <asio/signal_set.hpp>
#include <charconv>
#include <cstdio>

#include "common/base/error.hpp"
#include "common/io/udp_relay.hpp"

namespace {

using namespace palpate;

struct Options {
  std::string listen, to;
  double rtt_ms = -1, jitter_ms = 0, loss_pct = 0, burst = 0, duplicate_pct = 0, reorder_pct = 0, kbit_s = 0;
  std::uint64_t seed = 1;
};

CLI::Validator number_from(double low, double high) {
  const auto judge = [low, high](const std::string& text) {
    double value = 0;
    const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (fault == std::errc{} && end == text.data() + text.size() && value >= low && value <= high) return std::string();
    return fmt::format("is \"{}\"; expected a number from {} to {}", text, low, high);
  };
  return {judge, fmt::format("{} to {}", low, high)};
}

CLI::Validator whole_number() {
  const auto judge = [](const std::string& text) {
    std::uint64_t value = 0;
    const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
    const bool whole = fault == std::errc{} && end == text.data() + text.size();
    return whole ? std::string() : fmt::format("is \"{}\"; expected a whole number from 0 to 2^64 - 1", text);
  };
  return {judge, ""};
}

void describe_flags(CLI::App& app, Options& o) {
  app.set_version_flag("--version", "palpate-relay " PALPATE_VERSION);
  app.add_option("--listen", o.listen, "required: HOST:PORT where clients reach the relay, port 0 for any");
  app.add_option("--to", o.to, "required: HOST:PORT of the server");
  app.add_option("--rtt-ms", o.rtt_ms, "required: round trip, half of it each way")->check(number_from(0, 60'000));
  app.add_option("--jitter-ms", o.jitter_ms, "each way's delay is drawn evenly within +- this, in the order sent")
      ->check(number_from(0, 60'000));
  app.add_option("--loss-pct", o.loss_pct, "datagrams lost, each way")->check(number_from(0, 100));
  app.add_option("--burst", o.burst, "mean run of lost datagrams, 0 for independent losses")->check(number_from(0, 1e6));
  app.add_option("--duplicate-pct", o.duplicate_pct, "datagrams that arrive twice, each way")->check(number_from(0, 100));
  app.add_option("--reorder-pct", o.reorder_pct, "datagrams that others may overtake, each way")->check(number_from(0, 100));
  app.add_option("--kbit-s", o.kbit_s, "bandwidth of each client, each way, 0 for unlimited")->check(number_from(0, 1e9));
  app.add_option("--seed", o.seed, "of everything random")->check(whole_number());
}

/// CLI11's own "required" would hide an unknown flag behind a missing one.
void require_flags(const Options& o) {
  if (o.listen.empty()) throw InputError("--listen", "it is missing", "HOST:PORT where clients reach the relay");
  if (o.to.empty()) throw InputError("--to", "it is missing", "HOST:PORT of the server");
  if (o.rtt_ms < 0) throw InputError("--rtt-ms", "it is missing", "a round trip in milliseconds");
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
    fmt::print("palpate-relay: {}: {} datagrams, {} bytes, {} lost, {} over the bandwidth, {} twice, {} out of order\n", way,
               c.sent, c.bytes, c.lost, c.queue_dropped, c.duplicated, c.reordered);
  };
  fmt::print("palpate-relay: {} clients, {} sends failed\n", counts.clients, counts.send_failed);
  line("to the server", counts.up);
  line("to clients", counts.down);
  std::fflush(stdout);
}

void run(const Options& options) {
  asio::io_context io(1);
  const UdpEndpoint listen = resolve_udp("--listen", options.listen);
  const UdpEndpoint server = resolve_udp("--to", options.to);
  if (server.port() == 0) throw InputError("--to", "port 0", "the server's port, 1 to 65535");
  UdpRelay relay(io, bind_udp(io, "--listen", listen), server, link_of(options));
  asio::signal_set signals(io, SIGINT, SIGTERM);
  signals.async_wait([&io](const asio::error_code&, int) { io.stop(); });
  say_start(relay, server, options);
  io.run();
  say_end(relay.counts());
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Passes datagrams between Palpate clients and a server over a bad link.");
  Options options;
  describe_flags(app, options);
  try {
    app.parse(argc, argv);
    require_flags(options);
    run(options);
    return 0;
  } catch (const CLI::Success& asked) {
    return app.exit(asked);
  } catch (const CLI::ParseError& wrong) {
    fmt::print(stderr, "palpate-relay: {}; see palpate-relay --help\n", wrong.what());
    return 2;
  } catch (const palpate::InputError& wrong) {
    fmt::print(stderr, "palpate-relay: {}\n", wrong.what());
    return 2;
  } catch (const std::exception& failure) {
    fmt::print(stderr, "palpate-relay: {}\n", failure.what());
    return 1;
  }
}
