// Files that an experiment leaves in its folder.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace palpate {

using Json = nlohmann::ordered_json;

/// The folder, made when missing. InputError when it cannot be.
std::filesystem::path make_output_folder(const std::string& folder);
/// InputError when the file cannot be written whole.
void write_text(const std::filesystem::path& file, const std::string& text);
inline void write_json(const std::filesystem::path& file, const Json& json) { write_text(file, json.dump(2) + "\n"); }

inline std::int64_t stopwatch_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace palpate
