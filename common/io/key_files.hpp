// Key files on disk: readable by their owner alone (mode 0600), and never half written.
//
// A change is written to a temporary file in the same folder, synced, and renamed: after a crash there is the old file or the new
// one. A file that others may read, or a group may write, is refused with the command that fixes it.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "common/trust/key_file.hpp"

namespace palpate {

/// Throws InputError when the file cannot be read, or others could read it.
std::string read_secret_text(const std::filesystem::path& file);
/// Writes a file that must not exist yet. Throws InputError.
void write_new_secret(const std::filesystem::path& file, const std::string& text);
/// Replaces the file's text by the result of `change`. Keeps the owner where permitted, follows links, and serialises concurrent
/// changes. Throws InputError.
void change_secret(const std::filesystem::path& file, const std::function<std::string(std::string)>& change);

SiteKeys read_site(const std::filesystem::path& file);
/// `token`: a file, or empty.
ClientKeys read_client_keys(const std::filesystem::path& file, const std::filesystem::path& token);

}  // namespace palpate
