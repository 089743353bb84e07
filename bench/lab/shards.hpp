// Sweeps whose runs are shared by several machines: `--shard i/n` takes every n-th run from the i-th on and leaves
// cells-i-of-n.csv, `--merge` gathers those files. Runs depend on nothing but their own cell, so the split changes no figure.
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

  /// "i/n"; InputError for anything else.
  static Shard from(const std::string& text);
  /// cells.csv, or cells-i-of-n.csv of a part.
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
  unsigned jobs = 0;  ///< 0: one a core

  void add_to(CLI::App& command);
};

/// What the shards left in `folder`, in the order of their numbers; InputError when there is none.
std::vector<std::filesystem::path> shard_files(const std::filesystem::path& folder);
/// The cells in those files, in the order of the whole sweep: the first of each file, then the second; `read` makes cells of one.
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

/// A line of CSV, split at commas.
std::vector<std::string> fields_of(const std::string& line);
/// The rows of a CSV file that begins with `header`, split; InputError with file and line for another header or a row
/// of another length.
std::vector<std::vector<std::string>> read_rows(const std::filesystem::path& file, const std::string& header);
/// A finite number; InputError, with `where` as the place.
double number_from(const std::string& text, const std::string& where);
/// Where `text` stands among `names`; InputError, which lists them.
std::size_t index_from(const std::string& text, std::span<const std::string_view> names, const std::string& where);

}  // namespace palpate
