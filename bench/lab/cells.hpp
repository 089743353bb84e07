// Tables of cells: one function computed for many combinations of parameters, each independently of the others.
//
// A cell is a struct with parameters and results. A CellTable gives each of them a column of cells.csv, with a name and a unit.
// The key of a cell is its row up to the results, "cube6,port,as_sent,50"; `--only KEY` computes that cell alone. A sweep is a
// list of cells without results and a function that fills in one of them. run_cells() computes them in parallel, appends each row
// to cells.csv as soon as it is known, and at the end writes them in the order of the sweep. Results depend neither on the number
// of threads nor on
//
//     --shard i/n   computes every n-th cell from the i-th on, into cells-i-of-n.csv
//     --merge       computes nothing and collects those files
//     --resume      computes only cells that an interrupted call with the same flags has left
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "bench/lab/parallel.hpp"
#include "bench/output/output.hpp"

namespace palpate {

/// Splits a line of CSV at commas.
std::vector<std::string> fields_of(const std::string& line);
/// Splits the key of a cell; throws InputError that names `where` unless it has as many fields as `header`.
std::vector<std::string> key_fields(const std::string& key, const std::string& header, const std::string& where);
/// Returns the split rows of a CSV file that begins with `header`. `may_be_cut`: a last row without an end of line is omitted.
/// Throws InputError with file and line for another header or a row of another length.
std::vector<std::vector<std::string>> read_rows(const std::filesystem::path& file, const std::string& header, bool may_be_cut);
/// Parses a finite number; throws InputError that names `where`.
double number_from(const std::string& text, const std::string& where);
/// Returns the index of `text` in `names`; throws InputError that lists them.
std::size_t index_from(const std::string& text, std::span<const std::string_view> names, const std::string& where);

/// Part i of n of a sweep, from `--shard i/n`.
struct Shard {
  std::size_t index = 1, of = 1;

  /// Throws InputError for anything but "i/n" with 1 <= i <= n.
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

struct CellFlags {
  std::string shard = "1/1";
  bool merge = false, resume = false;
  unsigned jobs = 0;  ///< 0: one per core

  void add_to(CLI::App& command);
};

/// Files of the shards in `folder`, ordered by number; throws InputError if there are none.
std::vector<std::filesystem::path> shard_files(const std::filesystem::path& folder);

/// File to which the rows of finished cells are appended, from any thread; each reaches the disk at once.
class CellLog {
 public:
  CellLog(const std::filesystem::path& file, const std::string& text) : out_(file, std::ios::binary) { add(text); }
  void add(const std::string& text) {
    const std::lock_guard lock(mutex_);
    out_ << text << std::flush;
  }

 private:
  std::ofstream out_;
  std::mutex mutex_;
};

/// Product with an axis: every cell once with each of the values in `field`, a member or a function that returns one.
template <class Cell, class Field, class Values>
std::vector<Cell> crossed(const std::vector<Cell>& cells, Field field, const Values& values) {
  std::vector<Cell> product;
  for (const Cell& cell : cells)
    for (const auto& value : values) std::invoke(field, product.emplace_back(cell)) = value;
  return product;
}

/// Field of a column that is a member of a member.
template <class Outer, class Inner>
auto within(Outer outer, Inner inner) {
  return [=](auto& cell) -> auto& { return std::invoke(inner, std::invoke(outer, cell)); };
}

template <class Cell>
class CellTable {
 public:
  /// Adds a column; `field` is a member of Cell, or a function that returns one. Numbers are written with `format`.
  template <class Field>
  CellTable& parameter(const std::string& name, Field field, const char* format = "{}") {
    return add(parameters_, name, field, format);
  }
  template <class Field>
  CellTable& result(const std::string& name, Field field, const char* format = "{}") {
    return add(results_, name, field, format);
  }
  /// Adds a column for an enumeration, of which `names` has the names by value.
  template <class Field>
  CellTable& parameter(const std::string& name, Field field, std::span<const std::string_view> names) {
    return add(parameters_, name, field, names);
  }
  template <class Field>
  CellTable& result(const std::string& name, Field field, std::span<const std::string_view> names) {
    return add(results_, name, field, names);
  }

  std::string key(const Cell& cell) const { return text(parameters_, cell); }
  /// Cell of a key; throws InputError that names `where`.
  Cell from_key(const std::string& key, const std::string& where) const {
    const std::vector<std::string> fields = key_fields(key, names(parameters_), where);
    Cell cell;
    for (std::size_t k = 0; k < parameters_.size(); ++k) parameters_[k].read(cell, fields[k], where);
    return cell;
  }
  std::string header() const { return names(parameters_) + "," + names(results_); }
  std::string row(const Cell& cell) const { return key(cell) + "," + text(results_, cell) + "\n"; }
  std::string csv(const std::vector<Cell>& cells) const {
    std::string all = header() + "\n";
    for (const Cell& cell : cells) all += row(cell);
    return all;
  }
  /// Inverse of csv(). Throws InputError with file and line.
  std::vector<Cell> read(const std::filesystem::path& file, bool may_be_cut = false) const {
    std::vector<Cell> cells;
    for (const std::vector<std::string>& fields : read_rows(file, header(), may_be_cut)) {
      const std::string where = fmt::format("{}:{}", file.string(), cells.size() + 2);
      Cell& cell = cells.emplace_back();
      std::size_t k = 0;
      for (const std::vector<Column>* columns : {&parameters_, &results_})
        for (const Column& column : *columns) column.read(cell, fields[k++], where);
    }
    return cells;
  }
  /// Cells of all shards in `folder`, in the order of the whole sweep: the first of each file, then the second.
  std::vector<Cell> merged(const std::filesystem::path& folder) const {
    std::vector<std::vector<Cell>> parts;
    std::size_t longest = 0;
    for (const auto& file : shard_files(folder)) longest = std::max(longest, parts.emplace_back(read(file)).size());
    std::vector<Cell> cells;
    for (std::size_t k = 0; k < longest; ++k)
      for (const std::vector<Cell>& part : parts)
        if (k < part.size()) cells.push_back(part[k]);
    return cells;
  }

 private:
  struct Column {
    std::string name;
    std::function<std::string(const Cell&)> text;
    std::function<void(Cell&, const std::string& text, const std::string& where)> read;
  };

  template <class Field>
  using ValueOf = std::remove_cvref_t<std::invoke_result_t<Field, Cell&>>;

  template <class Field>
  CellTable& add(std::vector<Column>& columns, const std::string& name, Field field, const char* format) {
    columns.push_back({name, [=](const Cell& cell) { return fmt::format(fmt::runtime(format), std::invoke(field, cell)); },
                       [=](Cell& cell, const std::string& text, const std::string& where) {
                         if constexpr (std::is_same_v<ValueOf<Field>, std::string>)
                           std::invoke(field, cell) = text;
                         else
                           std::invoke(field, cell) = static_cast<ValueOf<Field>>(number_from(text, where));
                       }});
    return *this;
  }
  template <class Field>
  CellTable& add(std::vector<Column>& columns, const std::string& name, Field field, std::span<const std::string_view> names) {
    columns.push_back({name,
                       [=](const Cell& cell) { return std::string(names[static_cast<std::size_t>(std::invoke(field, cell))]); },
                       [=](Cell& cell, const std::string& text, const std::string& where) {
                         std::invoke(field, cell) = static_cast<ValueOf<Field>>(index_from(text, names, where));
                       }});
    return *this;
  }
  static std::string names(const std::vector<Column>& columns) {
    std::string all;
    for (const Column& column : columns) all += (all.empty() ? "" : ",") + column.name;
    return all;
  }
  static std::string text(const std::vector<Column>& columns, const Cell& cell) {
    std::string all;
    for (const Column& column : columns) all += (&column == &columns.front() ? "" : ",") + column.text(cell);
    return all;
  }

  std::vector<Column> parameters_, results_;
};

template <class Cell>
struct CellSweep {
  CellTable<Cell> table;
  std::vector<Cell> cells;  ///< without results, in an order that does not depend on flags of the runner
  /// Computes what several of these cells share, `jobs` at a time; may remove cells to which it finds that no result belongs.
  std::function<void(std::vector<Cell>& cells, unsigned jobs)> prepare = {};
  std::function<void(Cell& cell)> measure = {};
};

void announce_cells(std::size_t due, std::size_t all);
void announce_shard(const std::filesystem::path& file);

/// Computes a sweep and leaves cells.csv, or the file of the shard, in `out`. Returns the cells, to be reported, unless it
/// computed a shard alone. Throws what the functions of the sweep throw.
template <class Cell>
std::optional<std::vector<Cell>> run_cells(const CellSweep<Cell>& sweep, const CellFlags& flags,
                                           const std::filesystem::path& out) {
  const CellTable<Cell>& table = sweep.table;
  if (flags.merge) {
    std::vector<Cell> cells = table.merged(out);
    write_text(out / "cells.csv", table.csv(cells));
    return cells;
  }
  const Shard shard = Shard::from(flags.shard);
  const std::filesystem::path file = shard.file(out);
  const std::vector<Cell> part = shard.part_of(sweep.cells);
  std::map<std::string, Cell> done;
  if (flags.resume && std::filesystem::exists(file))
    for (Cell& cell : table.read(file, true)) done.emplace(table.key(cell), cell);
  std::vector<Cell> due, kept;
  for (const Cell& cell : part) {
    const auto known = done.find(table.key(cell));
    known == done.end() ? due.push_back(cell) : kept.push_back(known->second);
  }
  announce_cells(due.size(), sweep.cells.size());
  if (sweep.prepare) sweep.prepare(due, flags.jobs);
  CellLog log(file, table.csv(kept));
  const auto measure = [&](std::size_t i) {
    sweep.measure(due[i]);
    log.add(table.row(due[i]));
  };
  run_all(due.size(), measure, flags.jobs, "the cells");
  for (const Cell& cell : due) done.insert_or_assign(table.key(cell), cell);
  std::vector<Cell> cells;
  for (const Cell& cell : part)
    if (const auto known = done.find(table.key(cell)); known != done.end()) cells.push_back(known->second);
  write_text(file, table.csv(cells));
  if (shard.of == 1) return cells;
  announce_shard(file);
  return std::nullopt;
}

}  // namespace palpate
