#include "common/io/provenance.hpp"

#include <sys/utsname.h>

#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <thread>

namespace palpate {
namespace {

std::string processor_name() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);)
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  return "unknown";
}

}  // namespace

std::string file_hash(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) return {};
  std::ifstream in(file, std::ios::binary);
  if (!in) return {};
  std::uint64_t hash = 0xcbf29ce484222325ull;
  for (auto byte = std::istreambuf_iterator<char>(in); byte != std::istreambuf_iterator<char>(); ++byte)
    hash = (hash ^ static_cast<unsigned char>(*byte)) * 0x100000001b3ull;
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash));
  return text;
}

MachineName this_machine() {
  utsname name{};
  uname(&name);
  return {processor_name(), std::thread::hardware_concurrency(), std::string(name.sysname) + " " + name.release};
}

}  // namespace palpate
