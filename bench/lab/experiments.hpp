// The experiments of palpate-lab. Each adds its own sub-command with its own flags.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

namespace palpate {

/// What the chosen sub-command does; returns the exit status.
using Run = std::function<int()>;

void add_replay(CLI::App& app, Run& run);
void add_felt(CLI::App& app, Run& run);

}  // namespace palpate
