// palpate-lab: experiments on touch under latency. `palpate-lab list` names them.
#include <fmt/format.h>

#include <exception>

#include "bench/lab/experiments.hpp"
#include "common/base/error.hpp"

int main(int argc, char** argv) {
  CLI::App app{"Experiments on touch under latency", "palpate-lab"};
  app.set_version_flag("--version", "palpate-lab " PALPATE_VERSION);
  app.require_subcommand(1);
  palpate::Run run;
  palpate::add_replay(app, run);
  palpate::add_felt(app, run);
  app.add_subcommand("list", "name the experiments, a line each")->callback([&] {
    run = [&] {
      for (const CLI::App* experiment : app.get_subcommands({}))
        if (experiment->get_name() != "list") fmt::print("{:<10} {}\n", experiment->get_name(), experiment->get_description());
      return 0;
    };
  });
  try {
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
