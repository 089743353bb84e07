// A file as a whole, no longer than it may be.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace palpate {

/// The bytes of a file. Throws InputError, "WHERE: cannot be read (WHY); expected EXPECTED" or that it is longer than `most`
/// bytes; no more than those are read. A pipe is waited for; a device is refused.
std::string read_file(const std::filesystem::path& file, const std::string& where, const std::string& expected, std::size_t most);

/// The same of a file that another file names: nothing that waits or never ends, such as a pipe or a device.
std::string read_plain_file(const std::filesystem::path& file, const std::string& where, const std::string& expected,
                            std::size_t most);

/// Without the mark (U+FEFF) that some editors begin UTF-8 with.
std::string without_mark(std::string text);

}  // namespace palpate
