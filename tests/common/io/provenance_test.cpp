// Provenance of result files.
#include "common/io/provenance.hpp"

#include <catch2/catch.hpp>
#include <fstream>

using namespace palpate;

TEST_CASE("The hash of a file is FNV-1a of its bytes, and a file that cannot be read has none") {
  const auto file = std::filesystem::temp_directory_path() / "palpate-provenance-test";
  const auto hash_of = [&](const std::string& text) {
    std::ofstream(file, std::ios::binary) << text;
    return file_hash(file);
  };
  // The published test vectors of FNV-1a, 64 bits.
  CHECK(hash_of("") == "cbf29ce484222325");
  CHECK(hash_of("a") == "af63dc4c8601ec8c");
  CHECK(hash_of("foobar") == "85944171f73967e8");
  std::filesystem::remove(file);
  CHECK(file_hash(file).empty());
  CHECK(file_hash(std::filesystem::temp_directory_path()).empty());
}

TEST_CASE("The machine has a processor, cores and a system by name") {
  const MachineName machine = this_machine();
  CHECK(!machine.processor.empty());
  CHECK(machine.cores > 0);
  CHECK(machine.system.starts_with("Linux "));
}
