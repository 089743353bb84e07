// Creates folders for a program's output.
#pragma once

#include <filesystem>
#include <string>

namespace palpate {

/// Creates the folder and its parents where they are missing; an empty name is the current folder. Throws InputError with `where`
/// (the flag and its value) on failure.
void make_folder(const std::string& where, const std::filesystem::path& folder);

}  // namespace palpate
