// Loads the scenes that --scene names.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "server/app/server_flags.hpp"

namespace palpate {

/// Splits NAME=FILE, or FILE alone; a file that exists and has a = in its name counts as FILE.
std::pair<std::string, std::string> split_name(const std::string& given);
/// Throws InputError for a scene that cannot be read, and for rooms whose names are not distinct.
std::vector<NamedScene> load_scenes(const ServerFlags& flags);
void describe_scenes(const ServerFlags& flags);

}  // namespace palpate
