#include "bench/output/experiment.hpp"

#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>

namespace palpate {
namespace {

std::string& line_of_signal() {
  static std::string line;
  return line;
}

void end_on_signals() {
  line_of_signal() = program_name() + ": ended by a signal before it was done\n";
  for (const int signal : {SIGINT, SIGTERM})
    std::signal(signal, [](int) {
      [[maybe_unused]] const auto written = ::write(STDERR_FILENO, line_of_signal().data(), line_of_signal().size());
      std::_Exit(0);
    });
}

}  // namespace

int run_experiments(CLI::App& app, const Run& run) {
  end_on_signals();
  return run_program(app, run);
}

std::string program_name() { return program_invocation_short_name; }

}  // namespace palpate
