// Loads the scenes that --scene names.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "server/app/server_flags.hpp"

namespace palpate {

/// NAME=FILE, or FILE; a file whose name has a = is the latter when it is there.
std::pair<std::string, std::string> split_name(const std::string& given);
/// InputError for a scene that cannot be read, and for rooms without a name of their own.
std::vector<NamedScene> load_scenes(const ServerFlags& flags);
void describe_scenes(const ServerFlags& flags);

}  // namespace palpate
