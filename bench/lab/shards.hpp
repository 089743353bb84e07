// Splits sweeps among several machines: `--shard i/n` computes every n-th run from the i-th on and writes cells-i-of-n.csv;
// `--merge` collects those files. A run depends only on its own cell, so the split changes no result.
#pragma once

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

struct Shard {
  std::size_t index = 1, of = 1;

  /// Parses "i/n"; throws InputError for anything else.
  static Shard from(const std::string& text);
  /// Returns cells.csv, or cells-i-of-n.csv for a part.
  std::filesystem::path file(const std::filesystem::path& folder) const;
  template <class Cell>
  std::vector<Cell> part_of(const std::vector<Cell>& all) const {
    std::vector<Cell> part;
    for (std::size_t i = index - 1; i < all.size(); i += of) part.push_back(all[i]);
    return part;
  }
};

struct ShardFlags {
  std::string shard = "1/1";
  bool merge = false;
  unsigned jobs = 0;  ///< 0: one per core

  void add_to(CLI::App& command);
};

/// Files of the shards in `folder`, ordered by number; throws InputError if there are none.
std::vector<std::filesystem::path> shard_files(const std::filesystem::path& folder);
/// Cells of those files in the order of the whole sweep: the first of each file, then the second; `read` parses one file.
template <class Read>
auto merged_cells(const std::filesystem::path& folder, const Read& read) {
  using Cells = decltype(read(folder));
  std::vector<Cells> parts;
  for (const auto& file : shard_files(folder)) parts.push_back(read(file));
  std::size_t longest = 0;
  for (const Cells& part : parts) longest = std::max(longest, part.size());
  Cells cells;
  for (std::size_t k = 0; k < longest; ++k)
    for (const Cells& part : parts)
      if (k < part.size()) cells.push_back(part[k]);
  return cells;
}

/// Splits a line of CSV at commas.
std::vector<std::string> fields_of(const std::string& line);
/// Returns the split rows of a CSV file that begins with `header`. Throws InputError with file and line for another header or a
/// row of another length.
std::vector<std::vector<std::string>> read_rows(const std::filesystem::path& file, const std::string& header);
/// Parses a finite number; throws InputError that names `where`.
double number_from(const std::string& text, const std::string& where);
/// Returns the index of `text` in `names`; throws InputError that lists them.
std::size_t index_from(const std::string& text, std::span<const std::string_view> names, const std::string& where);

}  // namespace palpate
