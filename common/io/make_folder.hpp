// Folders for what a program writes.
#pragma once

#include <filesystem>
#include <string>

namespace palpate {

/// The folder is there when it returns, with those above it; an empty name is the current one. InputError with `where` (the flag
/// and what was typed) when it cannot be made.
void make_folder(const std::string& where, const std::filesystem::path& folder);

}  // namespace palpate
