// palpate-lab: experiments on touch under latency. `palpate-lab list` names them.
#include <fmt/format.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <exception>
#include <string_view>

#include "bench/lab/experiments.hpp"
#include "common/base/error.hpp"

namespace {

/// Results are written when everything is done: before that there is nothing to end in order.
void end_on_signals() {
  for (const int signal : {SIGINT, SIGTERM})
    std::signal(signal, [](int) {
      constexpr std::string_view kLine = "palpate-lab: ended by a signal before it was done\n";
      [[maybe_unused]] const auto written = ::write(STDERR_FILENO, kLine.data(), kLine.size());
      std::_Exit(0);
    });
}

void refuse_unknown(const CLI::App& app, const char* name) {
  std::string known;
  for (const CLI::App* experiment : app.get_subcommands({})) {
    if (experiment->get_name() == name) return;
    known += (known.empty() ? "" : ", ") + experiment->get_name();
  }
  throw palpate::InputError(name, "is not an experiment of this build", "one of " + known);
}

}  // namespace

int main(int argc, char** argv) {
  end_on_signals();
  CLI::App app{"Experiments on touch under latency", "palpate-lab"};
  app.set_version_flag("--version", "palpate-lab " PALPATE_VERSION);
  app.require_subcommand(1);
  palpate::Run run;
  palpate::add_replay(app, run);
  palpate::add_felt(app, run);
  palpate::add_masking(app, run);
  palpate::add_truth(app, run);
  palpate::add_draw(app, run);
  palpate::add_pareto(app, run);
  palpate::add_bench(app, run);
  palpate::add_stations(app, run);
  palpate::add_load(app, run);
  palpate::add_skip(app, run);
  palpate::add_beside(app, run);
  palpate::add_world(app, run);
  palpate::add_spring1d(app, run);
  palpate::add_chain(app, run);
  palpate::add_bode(app, run);
  palpate::add_modes(app, run);
  palpate::add_scaling(app, run);
  palpate::add_haptic(app, run);
  palpate::add_release(app, run);
  palpate::add_stability(app, run);
  palpate::add_limits(app, run);
  palpate::add_dominance(app, run);
  palpate::add_couplings(app, run);
  palpate::add_paper(app, run);
  palpate::add_export(app, run);
  palpate::add_summary(app, run);
  app.add_subcommand("list", "name the experiments, a line each")->callback([&] {
    run = [&] {
      for (const CLI::App* experiment : app.get_subcommands({}))
        if (experiment->get_name() != "list") fmt::print("{:<10} {}\n", experiment->get_name(), experiment->get_description());
      return 0;
    };
  });
  try {
    if (argc > 1 && *argv[1] != '-') refuse_unknown(app, argv[1]);
    app.parse(argc, argv);
    return run();
  } catch (const CLI::CallForHelp& e) {
    return app.exit(e);
  } catch (const CLI::CallForAllHelp& e) {
    return app.exit(e);
  } catch (const CLI::CallForVersion& e) {
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    fmt::print(stderr, "palpate-lab: {}; see palpate-lab --help\n", e.what());
    return 2;
  } catch (const palpate::InputError& e) {
    fmt::print(stderr, "palpate-lab: {}\n", e.what());
    return 2;
  } catch (const std::exception& e) {
    fmt::print(stderr, "palpate-lab: {}\n", e.what());
    return 1;
  }
}
