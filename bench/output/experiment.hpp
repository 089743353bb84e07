// An experiment as a command: a sub-command of palpate-lab, or a program of its own.
#pragma once

#include <functional>
#include <string>

#include "common/command_line/flags.hpp"

namespace palpate {

/// What an experiment does once its flags are read; returns the exit status.
using Run = std::function<int()>;

/// run_program(), which SIGINT and SIGTERM end with 0 and a line that says so: results are written when everything is done,
/// before that there is nothing to end in order.
int run_experiments(CLI::App& app, const Run& run);

/// The program that runs, as its file is called: an experiment may be in more than one.
std::string program_name();

}  // namespace palpate
