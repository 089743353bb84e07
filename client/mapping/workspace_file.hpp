// Files of workspace mappings (JSON; docs/reference/workspace.md):
//
//     { "devices": [ { "device": "openhaptics", "scale": 1.5, "offset_m": [0, 0, 0.02], "clutch_button": 0 } ] }
//
// Every field but `device` has a default. Invalid values and unknown fields are refused with file, line and what was expected.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "client/mapping/workspace_mapping.hpp"

namespace palpate {

/// Throws InputError when the file cannot be read or is invalid.
std::vector<NamedMapping> read_workspace(const std::filesystem::path& file);
/// Reads from memory; `name` stands for the file in errors.
std::vector<NamedMapping> read_workspace(const std::string& text, const std::string& name);

/// Returns a text that reads back to the same bits, with every field.
std::string workspace_text(const std::vector<NamedMapping>& all);
/// Throws InputError when the file cannot be written.
void write_workspace(const std::filesystem::path& file, const std::vector<NamedMapping>& all);

}  // namespace palpate
