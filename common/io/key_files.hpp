// Key files on disk: what nobody else may read (mode 0600), and never half of it.
//
// Written to a file beside it, synced, and put in place in one step: after a crash there is the old file or the new one. A file
// that others may read, or a group may write, is refused with what to type against it.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "common/trust/key_file.hpp"

namespace palpate {

/// InputError when it cannot be read, or others could.
std::string read_secret_text(const std::filesystem::path& file);
/// A file that must not be there yet. InputError.
void write_new_secret(const std::filesystem::path& file, const std::string& text);
/// Puts what `change` makes of its text in its place: of the same owner where we may say so, through links, one after the other
/// where several do so at once. InputError.
void change_secret(const std::filesystem::path& file, const std::function<std::string(std::string)>& change);

SiteKeys read_site(const std::filesystem::path& file);
/// `token`: a file, or empty.
ClientKeys read_client_keys(const std::filesystem::path& file, const std::filesystem::path& token);

}  // namespace palpate
