// Files that an experiment writes to its folder.
#pragma once

#include <chrono>
#include <cstdint>
#include <ctime>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace palpate {

using Json = nlohmann::ordered_json;

/// Returns the folder, created if missing. Throws InputError if that fails.
std::filesystem::path make_output_folder(const std::string& folder);
/// Throws InputError if the file cannot be written completely.
void write_text(const std::filesystem::path& file, const std::string& text);
/// Writes results; if they are an object, the run record (run_record.hpp) is added as "run".
void write_json(const std::filesystem::path& file, Json json);

/// Processor time of this thread instead of wall time, which other load on the machine affects.
inline std::int64_t processor_ns() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

inline std::int64_t stopwatch_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace palpate
