// Provenance of a result file: what identifies the run that made it, so that it can be repeated.
#pragma once

#include <filesystem>
#include <string>

namespace palpate {

/// FNV-1a (64 bits) of the bytes of a file, as 16 hexadecimal digits; empty when it cannot be read. Distinguishes files, no more.
std::string file_hash(const std::filesystem::path& file);

struct MachineName {
  std::string processor;  ///< name given by its maker
  unsigned cores = 0;     ///< cores that this process sees
  std::string system;     ///< kernel and its release
};
MachineName this_machine();

}  // namespace palpate
