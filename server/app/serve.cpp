#include "server/app/serve.hpp"

#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <asio/signal_set.hpp>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <stdexcept>
#include <thread>

#include "common/base/counted.hpp"
#include "common/base/error.hpp"
#include "common/io/key_files.hpp"
#include "common/io/line_writer.hpp"
#include "common/io/monotonic.hpp"
#include "server/app/describe.hpp"
#include "server/app/load_scenes.hpp"
#include "server/app/service_manager.hpp"
#include "server/io/event_log.hpp"
#include "server/metrics/io/metrics_server.hpp"
#include "server/metrics/metrics.hpp"

namespace palpate {
namespace {

constexpr std::chrono::minutes kInsecureEvery{1};
constexpr char kProgram[] = "palpate-server";

Micros unix_now() { return std::chrono::duration_cast<Micros>(std::chrono::system_clock::now().time_since_epoch()); }

ServerEvent lines_left_out(std::uint64_t lines) {
  return {
      "left_out", fmt::format("dropped {} here, because nobody read this log", counted(lines, "line")), {}, EventLevel::warning};
}

/// Exits at once on a signal while scenes load, which may take long: nothing has to be shut down in order yet.
void end_while_loading() {
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, [](int) { std::_Exit(0); });
}

/// Refuses to listen beyond this machine without keys, unless --insecure is given.
void check_reach(const ServerFlags& flags) {
  if (flags.has_keys || flags.insecure || is_loopback(resolve_udp("--listen", flags.listen))) return;
  throw InputError("--listen " + flags.listen, "would admit anyone who reaches the port",
                   "--keys FILE (palpate-key new FILE makes one), or --insecure");
}

ShellOptions shell_options(const ServerFlags& flags, std::size_t rooms, const std::optional<SiteKeys>& keys) {
  const std::size_t processors = std::max(1u, std::thread::hardware_concurrency());
  return {flags.listen,
          flags.rate_hz,
          flags.threads > 0 ? flags.threads : std::min(rooms, processors),
          {flags.record, flags.shapes_hz, flags.resume, "palpate-server " PALPATE_VERSION},
          flags.deadband,
          keys};
}

/// Runs the rooms together with signals, time limit, metrics and service manager.
class Serving {
 public:
  explicit Serving(const ServerFlags& flags) : flags_(flags) {
    if (flags.has_metrics) metrics_.emplace("--metrics", flags.metrics, PALPATE_VERSION);
    if (metrics_) say_metrics();
    check_reach(flags);
    if (flags.has_keys) keys_ = read_site(flags.keys);
    scenes_ = load_scenes(flags);
    shell_.emplace(scenes_, shell_options(flags, scenes_.size(), keys_),
                   [this](const ServerEvent& event) { log_.tell(event, unix_now(), monotonic_now()); });
    hang_up_.emplace(shell_->context());
    signals_.emplace(shell_->context(), SIGINT, SIGTERM);
    insecure_.emplace(shell_->context());
    end_.emplace(shell_->context());
  }

  void run() {
    hang_up_->add(SIGHUP);  // the default action would end the program
    await_hang_up();
    if (keys_) say_keys();
    if (flags_.insecure) warn_insecure();
    await_signal();
    if (flags_.has_duration) end_after(from_seconds(flags_.duration_s));
    if (metrics_ || service_.watches()) shell_->on_pulse([this](ServerState state) { watch(std::move(state)); });
    say_rooms();
    service_.ready(fmt::format("{} at {}", counted(scenes_.size(), "room"), to_string(shell_->address())));
    shell_->run();
    for (const std::string& line : shell_->summary()) say("ended", line);
  }

 private:
  void say(const std::string& kind, const std::string& text, EventLevel level = EventLevel::info) {
    log_.say({kind, text, {}, level}, unix_now());
  }

  void watch(ServerState state) {
    if (service_.watches() && !not_well(state, state.at)) service_.is_well();
    if (metrics_) metrics_->publish(std::move(state));
  }

  void say_metrics() {
    say("metrics", "metrics at http://" + metrics_->address() + "/metrics");
    if (!is_loopback(resolve_udp("--metrics", flags_.metrics)))
      say("metrics", "warning: --metrics: anyone who reaches that address may read the metrics and block other readers",
          EventLevel::warning);
  }

  void say_keys() {
    say("keys", fmt::format("public key {}; it admits {} and {}", to_text(public_of(keys_->self)),
                            counted(keys_->stations.size(), "station"), counted(keys_->issuers.size(), "issuer")));
  }

  /// Rereads the keys on SIGHUP; a faulty file leaves the keys as they are.
  void await_hang_up() {
    hang_up_->async_wait([this](const asio::error_code& fault, int) {
      if (fault) return;
      try {
        if (keys_) shell_->change_keys(read_site(flags_.keys));
        say("keys", keys_ ? "the keys were read again from " + flags_.keys : "SIGHUP has no effect: this server has no --keys");
      } catch (const InputError& wrong) {
        say("keys_wrong", std::string("the keys are unchanged: ") + wrong.what(), EventLevel::error);
      }
      await_hang_up();
    });
  }

  void warn_insecure() {
    say("insecure",
        "warning: --insecure: anyone who reaches this port may touch the body, read the data and take over stations; --keys FILE "
        "prevents that",
        EventLevel::warning);
    insecure_->expires_after(kInsecureEvery);
    insecure_->async_wait([this](const asio::error_code& fault) {
      if (!fault) warn_insecure();
    });
  }

  void await_signal() {
    signals_->async_wait([this](const asio::error_code& fault, int signal) {
      if (fault) return;
      await_signal();
      if (signal == SIGTERM && flags_.drain_s > 0 && !shell_->draining()) return drain();
      say("stopping", "the server is stopping");
      service_.stopping("ending", {});
      shell_->stop();
    });
  }

  void drain() {
    say("draining",
        fmt::format("new sessions are refused; the server exits when the last hand leaves, after {:g} s at the latest",
                    flags_.drain_s));
    service_.stopping("draining", from_seconds(flags_.drain_s));
    shell_->drain(from_seconds(flags_.drain_s));
  }

  void end_after(Micros time) {
    end_->expires_after(time);
    end_->async_wait([this](const asio::error_code& fault) {
      if (!fault) shell_->stop();
    });
  }

  void say_rooms() {
    for (std::size_t k = 0; k < scenes_.size(); ++k) {
      const NamedScene& room = scenes_[k];
      const std::string as = scenes_.size() > 1 ? fmt::format("room \"{}\": ", room.name) : "";
      say("room",
          fmt::format("{}scene \"{}\" ({} nodes, {} elements) at {}, {} Hz", as, room.scene.name, room.scene.body.nodes.size(),
                      room.scene.body.elements.size() + room.scene.body.tetrahedra.size() + room.scene.body.hexahedra.size(),
                      to_string(shell_->address()), flags_.rate_hz));
      say("room", fmt::format("{}integrator {}", as, shell_->integrator(k)));
      const Description description = describe(room.scene, flags_.rate_hz);
      for (const std::string& line : description.lines) say("room", as + line);
      if (description.least_cost) shell_->expect_costs(k, *description.least_cost);
    }
  }

  ServerFlags flags_;
  const LogFormat format_ = flags_.log == "json" ? LogFormat::json : LogFormat::text;
  LineWriter lines_{
      STDOUT_FILENO, [format = format_](std::uint64_t lines) {
        const ServerEvent event = lines_left_out(lines);
        return (format == LogFormat::json ? json_line(event, unix_now(), 0) : text_line(event, kProgram, unix_now(), 0)) + '\n';
      }};
  EventLog log_{format_, kProgram, [this](const std::string& line) { lines_.write(line); }};
  ServiceManager service_;
  std::optional<MetricsServer> metrics_;  // outlives the shell, which fills it
  std::optional<SiteKeys> keys_;
  std::vector<NamedScene> scenes_;
  std::optional<UdpServer> shell_;
  std::optional<asio::signal_set> hang_up_, signals_;
  std::optional<asio::steady_timer> insecure_, end_;
};

}  // namespace

void serve(const ServerFlags& flags) {
  end_while_loading();
  std::signal(SIGPIPE, SIG_IGN);  // a closed log must not end the server under a hand
  try {
    Serving(flags).run();
  } catch (const AddressNotReady& fault) {
    if (!ServiceManager().is_there()) throw;
    throw std::runtime_error(fault.what());  // not an input error: those tell the service manager not to restart
  }
}

}  // namespace palpate
