// Sharded sweeps against the whole one.
#include "bench/lab/shards.hpp"

#include <catch2/catch.hpp>
#include <fstream>

using namespace palpate;

namespace {

std::vector<int> numbers_in(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::vector<int> numbers;
  for (int number = 0; in >> number;) numbers.push_back(number);
  return numbers;
}

}  // namespace

TEST_CASE(
    "Shards that are merged give the runs of the whole sweep in its order, however many there are and whichever is longer") {
  const std::size_t shards = GENERATE(1U, 2U, 3U, 11U, 30U);  // with eleven, alphabetical order differs from numerical order
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / ("palpate-shards-" + std::to_string(shards));
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  std::vector<int> all;
  for (int k = 0; k < 25; ++k) all.push_back(100 - 3 * k);
  for (std::size_t index = 1; index <= shards; ++index) {
    const Shard shard = Shard::from(std::to_string(index) + "/" + std::to_string(shards));
    std::ofstream out(folder / ("cells-" + std::to_string(index) + "-of-" + std::to_string(shards) + ".csv"));
    for (const int number : shard.part_of(all)) out << number << '\n';
    if (shards > 1) CHECK(std::filesystem::exists(shard.file(folder)));
  }
  CHECK(merged_cells(folder, numbers_in) == all);
  std::filesystem::remove_all(folder);
}
