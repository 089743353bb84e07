// palpate-server: one room. See --help.
#include <spdlog/fmt/fmt.h>

#include <CLI/CLI.hpp>
#include <asio/signal_set.hpp>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>

#include "common/base/error.hpp"
#include "common/base/limits.hpp"
#include "server/io/server_shell.hpp"
#include "server/scene/scene.hpp"

namespace {

using namespace palpate;

struct Options {
  std::string scene, listen = "127.0.0.1:47800";
  double rate_hz = 20, duration_s = 0;
  bool print_scene = false, has_duration = false;
};

void describe_flags(CLI::App& app, Options& o) {
  app.set_version_flag("--version", "palpate-server " PALPATE_VERSION);
  app.add_option("--scene", o.scene, "required: the body and the tool")->type_name("FILE");
  app.add_option("--listen", o.listen, "where clients reach the server, port 0 for any")
      ->type_name("HOST:PORT")
      ->capture_default_str();
  app.add_option("--rate-hz", o.rate_hz, "frames a second")->type_name("N")->capture_default_str();
  app.add_option("--duration-s", o.duration_s, "end after so many seconds; default: never")->type_name("N");
  app.add_flag("--print-scene", o.print_scene, "write the scene with all defaults filled in, and end");
}

/// CLI11's own "required" would hide an unknown flag behind a missing one.
void check(const Options& o) {
  constexpr double kMostS = 30 * 86400.0;
  if (o.scene.empty()) throw InputError("--scene", "it is missing", "a scene file");
  if (!(o.rate_hz >= kMinRateHz && o.rate_hz <= kMaxRateHz))
    throw InputError("--rate-hz", fmt::format("is {}", o.rate_hz), fmt::format("{} to {}", kMinRateHz, kMaxRateHz));
  if (o.has_duration && !(o.duration_s > 0 && o.duration_s <= kMostS))
    throw InputError("--duration-s", fmt::format("is {}", o.duration_s), "more than 0 s, up to 30 days");
}

/// A scene that is being built holds nothing that must be ended in order, and may take long.
void end_while_loading() {
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, [](int) { std::_Exit(0); });
}

void say(const std::string& line) {
  fmt::print("palpate-server: {}\n", line);
  std::fflush(stdout);
}

void serve(const Options& o) {
  end_while_loading();
  const auto scene = load_scene(o.scene);
  ServerShell shell(scene, o.listen, o.rate_hz, say);
  asio::signal_set signals(shell.context(), SIGINT, SIGTERM);
  signals.async_wait([&shell](const asio::error_code& fault, int) {
    if (!fault) shell.stop();
  });
  asio::steady_timer end(shell.context());
  if (o.has_duration) {
    end.expires_after(std::chrono::microseconds(from_seconds(o.duration_s)));
    end.async_wait([&shell](const asio::error_code& fault) {
      if (!fault) shell.stop();
    });
  }
  say(fmt::format("scene \"{}\" ({} nodes, {} elements) at {}, {} Hz", scene.name, scene.body.nodes.size(),
                  scene.body.elements.size(), to_string(shell.address()), o.rate_hz));
  shell.run();
  say(shell.summary());
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Simulates a deformable body and lets stations touch it.");
  Options options;
  describe_flags(app, options);
  try {
    app.parse(argc, argv);
    options.has_duration = app.count("--duration-s") > 0;
    check(options);
    if (options.print_scene)
      fmt::print("{}\n", print_scene(options.scene));
    else
      serve(options);
    return 0;
  } catch (const CLI::Success& asked) {
    return app.exit(asked);
  } catch (const CLI::ParseError& wrong) {
    fmt::print(stderr, "palpate-server: {}\n", wrong.what());
    return 2;
  } catch (const InputError& wrong) {
    fmt::print(stderr, "palpate-server: {}\n", wrong.what());
    return 2;
  } catch (const std::exception& failure) {
    fmt::print(stderr, "palpate-server: {}\n", failure.what());
    return 1;
  }
}
