// What a result file says of the run that made it, so that it can be told apart and made again.
#pragma once

#include <filesystem>
#include <string>

namespace palpate {

/// FNV-1a (64 bits) of the bytes of a file, as 16 hexadecimal digits; empty when it cannot be read. Tells files apart, no more.
std::string file_hash(const std::filesystem::path& file);

struct MachineName {
  std::string processor;  ///< as its maker calls it
  unsigned cores = 0;     ///< that this process sees
  std::string system;     ///< kernel and its release
};
MachineName this_machine();

}  // namespace palpate
