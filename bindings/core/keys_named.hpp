// Keys of a station or viewer as a caller names them: files.
#pragma once

#include <optional>
#include <string>

#include "common/io/key_files.hpp"

namespace palpate {

/// Returns the keys in these files, none where `key_file` is empty. Throws InputError when one cannot be read.
inline std::optional<ClientKeys> keys_named(const std::string& key_file, const std::string& token_file) {
  if (key_file.empty()) return std::nullopt;
  return read_client_keys(key_file, token_file);
}

}  // namespace palpate
