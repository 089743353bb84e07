// Reads a complete file, up to a maximum size.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace palpate {

/// Returns the bytes of a file. Throws InputError, "WHERE: cannot be read (WHY); expected EXPECTED" or that it is longer than
/// `most` bytes; it reads no more than those. Waits for a pipe; refuses a device.
std::string read_file(const std::filesystem::path& file, const std::string& where, const std::string& expected, std::size_t most);

/// The same for a file named by another file: refuses everything that waits or never ends, such as a pipe or a device.
std::string read_plain_file(const std::filesystem::path& file, const std::string& where, const std::string& expected,
                            std::size_t most);

/// Returns the text without the mark (U+FEFF) that some editors put before UTF-8.
std::string without_mark(std::string text);

}  // namespace palpate
