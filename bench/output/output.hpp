// Files that an experiment leaves in its folder.
#pragma once

#include <chrono>
#include <cstdint>
#include <ctime>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace palpate {

using Json = nlohmann::ordered_json;

/// The folder, made when missing. InputError when it cannot be.
std::filesystem::path make_output_folder(const std::string& folder);
/// InputError when the file cannot be written whole.
void write_text(const std::filesystem::path& file, const std::string& text);
/// With what was run (run_record.hpp) as "run" beside the results, where these are an object.
void write_json(const std::filesystem::path& file, Json json);

/// Processor time of this thread, not of the wall: what else the machine does is no cost of ours.
inline std::int64_t processor_ns() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

inline std::int64_t stopwatch_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace palpate
