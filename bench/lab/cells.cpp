#include "bench/lab/cells.hpp"

#include <cmath>
#include <cstdio>
#include <set>
#include <tuple>

#include "common/base/error.hpp"
#include "common/command_line/flags.hpp"

namespace palpate {

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields;
  for (std::size_t at = 0, end = 0; end != std::string::npos; at = end + 1) {
    end = line.find(',', at);
    fields.push_back(line.substr(at, end == std::string::npos ? end : end - at));
  }
  return fields;
}

std::vector<std::string> key_fields(const std::string& key, const std::string& header, const std::string& where) {
  std::vector<std::string> fields = fields_of(key);
  const std::size_t expected = fields_of(header).size();
  if (fields.size() == expected) return fields;
  throw InputError(where, fmt::format("'{}' has {} fields", key, fields.size()), fmt::format("{}: {}", expected, header));
}

std::vector<std::vector<std::string>> read_rows(const std::filesystem::path& file, const std::string& header, bool may_be_cut) {
  std::ifstream in(file);
  std::string line;
  if (!std::getline(in, line) || line != header) throw InputError(file.string() + ":1", "has another header", header);
  const std::size_t columns = fields_of(header).size();
  std::vector<std::vector<std::string>> rows;
  for (std::size_t number = 2; std::getline(in, line); ++number) {
    if (in.eof() && may_be_cut) break;
    rows.push_back(fields_of(line));
    if (rows.back().size() != columns)
      throw InputError(fmt::format("{}:{}", file.string(), number), fmt::format("has {} fields", rows.back().size()),
                       fmt::format("{}", columns));
  }
  return rows;
}

double number_from(const std::string& text, const std::string& where) {
  double value = 0;
  if (!CLI::detail::lexical_cast(text, value) || !std::isfinite(value)) throw InputError(where, "'" + text + "'", "a number");
  return value;
}

std::size_t index_from(const std::string& text, std::span<const std::string_view> names, const std::string& where) {
  const auto at = std::find(names.begin(), names.end(), text);
  if (at == names.end()) throw InputError(where, "'" + text + "' is none", fmt::format("one of {}", fmt::join(names, ", ")));
  return static_cast<std::size_t>(at - names.begin());
}

Shard Shard::from(const std::string& text) {
  Shard s;
  char slash = 0, rest = 0;
  if (std::sscanf(text.c_str(), "%zu%c%zu%c", &s.index, &slash, &s.of, &rest) != 3 || slash != '/' || s.index < 1 ||
      s.index > s.of || s.of > 100'000)
    throw InputError("--shard", "'" + text + "'", "i/n with 1 <= i <= n");
  return s;
}

std::filesystem::path Shard::file(const std::filesystem::path& folder) const {
  return folder / (of > 1 ? fmt::format("cells-{}-of-{}.csv", index, of) : "cells.csv");
}

void CellFlags::add_to(CLI::App& command) {
  command
      .add_option("--shard", shard, "i/n: compute every n-th cell from the i-th on, into cells-i-of-n.csv; --merge collects them")
      ->type_name("I/N");
  command.add_flag("--merge", merge, "compute nothing; collect what the shards wrote to --out");
  command.add_flag("--resume", resume, "keep the cells that an interrupted call with the same flags has finished in --out");
  command.add_option("--jobs", jobs, "number of cells computed at a time; default: one per core")->check(number_from(1U, 256U));
}

std::vector<std::filesystem::path> shard_files(const std::filesystem::path& folder) {
  std::set<std::tuple<std::size_t, std::size_t, std::filesystem::path>> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    Shard s;
    if (std::sscanf(entry.path().filename().c_str(), "cells-%zu-of-%zu", &s.index, &s.of) == 2)
      files.emplace(s.of, s.index, entry.path());
  }
  if (files.empty()) throw InputError(folder.string(), "holds no cells-*.csv", "the folder that the shards wrote to");
  std::vector<std::filesystem::path> paths;
  for (const auto& [of, index, path] : files) paths.push_back(path);
  return paths;
}

void announce_cells(std::size_t due, std::size_t all) {
  fmt::print("{} of {} cells are computed.\n", due, all);
  std::fflush(stdout);
}

void announce_shard(const std::filesystem::path& file) { fmt::print("{}\n", file.string()); }

}  // namespace palpate
