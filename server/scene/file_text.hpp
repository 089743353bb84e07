// A file as a whole, no longer than it may be.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace palpate {

/// The bytes of a file. Throws InputError, "WHERE: cannot be read; expected EXPECTED" or that it is longer than `most` bytes; no
/// more than those are read. A scene may come from a pipe.
std::string read_file(const std::filesystem::path& file, const std::string& where, const std::string& expected, std::size_t most);

/// The same of a file that a scene names: nothing that waits or never ends, such as a pipe or a device.
std::string read_plain_file(const std::filesystem::path& file, const std::string& where, const std::string& expected,
                            std::size_t most);

}  // namespace palpate
