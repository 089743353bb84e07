// Files of workspace mappings (JSON; docs/reference/workspace.md):
//
//     { "devices": [ { "device": "openhaptics", "scale": 1.5, "offset_m": [0, 0, 0.02], "clutch_button": 0 } ] }
//
// Every field but `device` has a default. What does not fit is refused with file, line and what was expected; an unknown field
// too.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "client/mapping/workspace_mapping.hpp"

namespace palpate {

/// Throws InputError when the file cannot be read or something in it does not hold.
std::vector<NamedMapping> read_workspace(const std::filesystem::path& file);
/// The same from memory; `name` stands for the file in errors.
std::vector<NamedMapping> read_workspace(const std::string& text, const std::string& name);

/// The text of the file that reads back to the same bits, every field said.
std::string workspace_text(const std::vector<NamedMapping>& all);
/// Throws InputError when it cannot be written.
void write_workspace(const std::filesystem::path& file, const std::vector<NamedMapping>& all);

}  // namespace palpate
