// An experiment as a command: a sub-command of palpate-lab, or a program of its own.
#pragma once

#include <functional>
#include <string>

#include "common/command_line/flags.hpp"

namespace palpate {

/// Runs an experiment after its flags were parsed; returns the exit status.
using Run = std::function<int()>;

/// Calls run_program(); SIGINT and SIGTERM end it with status 0 and a message: results are written at the end, so nothing has to
/// be shut down in order.
int run_experiments(CLI::App& app, const Run& run);

/// File name of the running program, as an experiment may be in more than one.
std::string program_name();

}  // namespace palpate
