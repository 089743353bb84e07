// Tables of cells: shards, merging and resuming against the whole sweep.
#include "bench/lab/cells.hpp"

#include <array>
#include <atomic>
#include <catch2/catch.hpp>
#include <cmath>

#include "common/base/error.hpp"

using namespace palpate;

namespace {

enum class Law : std::uint8_t { square, root };
constexpr std::array<std::string_view, 2> kLawNames{"square", "root"};

struct Cell {
  std::string name;
  Law law = Law::square;
  double x = 0, y = 0;
};

CellTable<Cell> table() {
  CellTable<Cell> table;
  table.parameter("name", &Cell::name)
      .parameter("law", &Cell::law, kLawNames)
      .parameter(
          "x", [](auto& c) -> auto& { return c.x; });
  return table.result("y_m", &Cell::y, "{:.17g}");
}

CellSweep<Cell> sweep() {
  CellSweep<Cell> sweep{table(), {}};
  sweep.cells =
      crossed(crossed(std::vector<Cell>(1), &Cell::name, std::array{"a", "b"}), &Cell::law, std::array{Law::square, Law::root});
  sweep.cells = crossed(sweep.cells, &Cell::x, std::array{1.0, 2.5, 3.0, 7.0, 0.25, 12.0});
  sweep.measure = [](Cell& c) { c.y = c.law == Law::square ? c.x * c.x : std::sqrt(c.x); };
  return sweep;
}

std::filesystem::path fresh_folder(const std::string& name) {
  std::filesystem::path folder = std::filesystem::temp_directory_path() / ("palpate-cells-" + name);
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  return folder;
}

std::string content(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// cells.csv of the whole sweep, from its definition.
std::string whole() {
  std::vector<Cell> cells = sweep().cells;
  for (Cell& c : cells) sweep().measure(c);
  return table().csv(cells);
}

}  // namespace

TEST_CASE("Crossed axes give every combination once, the last axis fastest") {
  const std::vector<Cell> cells = sweep().cells;
  REQUIRE(cells.size() == 2 * 2 * 6);
  CHECK(table().key(cells[0]) == "a,square,1");
  CHECK(table().key(cells[1]) == "a,square,2.5");
  CHECK(table().key(cells[6]) == "a,root,1");
  CHECK(table().key(cells.back()) == "b,root,12");
}

TEST_CASE("A sweep leaves one row per cell in its order, whatever the number of threads") {
  const unsigned jobs = GENERATE(1U, 3U, 16U);
  const auto folder = fresh_folder("jobs");
  const auto cells = run_cells(sweep(), {.jobs = jobs}, folder);
  REQUIRE(cells);
  CHECK(cells->size() == 24);
  CHECK(content(folder / "cells.csv") == whole());
}

TEST_CASE(
    "Shards that are merged give the cells of the whole sweep in its order, however many there are and whichever is longer") {
  const std::size_t shards = GENERATE(2U, 3U, 11U, 30U);  // with eleven, alphabetical order differs from numerical order
  const auto folder = fresh_folder("shards");
  for (std::size_t index = 1; index <= shards; ++index)
    CHECK(!run_cells(sweep(), {.shard = fmt::format("{}/{}", index, shards)}, folder));
  CHECK(!std::filesystem::exists(folder / "cells.csv"));
  REQUIRE(run_cells(sweep(), {.merge = true}, folder));
  CHECK(content(folder / "cells.csv") == whole());
}

TEST_CASE("A sweep that was interrupted in the middle of a row is completed without computing a finished cell again") {
  const auto folder = fresh_folder("resume");
  const std::string all = whole();
  const std::size_t cut = all.find("b,square,3,");
  std::ofstream(folder / "cells.csv") << all.substr(0, cut + 8);
  const auto done = static_cast<std::size_t>(std::count(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(cut), '\n')) - 1;
  std::atomic<std::size_t> measured{0};
  CellSweep<Cell> counted = sweep();
  counted.measure = [&, measure = counted.measure](Cell& c) {
    ++measured;
    measure(c);
  };
  REQUIRE(run_cells(counted, {.resume = true}, folder));
  CHECK(measured == 24 - done);
  CHECK(content(folder / "cells.csv") == all);
  measured = 0;
  REQUIRE(run_cells(counted, {}, folder));
  CHECK(measured == 24);
}

TEST_CASE("A cell that fails ends the sweep with its error and leaves the finished rows") {
  const auto folder = fresh_folder("failure");
  CellSweep<Cell> failing = sweep();
  failing.measure = [measure = failing.measure](Cell& c) {
    if (c.name == "b") throw std::runtime_error("no " + c.name);
    measure(c);
  };
  CHECK_THROWS_WITH(run_cells(failing, {.jobs = 1}, folder), "no b");
  CHECK(table().read(folder / "cells.csv", true).size() == 12);
}

TEST_CASE("A key is read back as its cell, and one that is wrong is refused with what was expected") {
  const Cell cell = table().from_key("b,root,2.5", "--only");
  CHECK(cell.name == "b");
  CHECK(cell.law == Law::root);
  CHECK(cell.x == 2.5);
  CHECK_THROWS_AS(table().from_key("b,root", "--only"), InputError);
  CHECK_THROWS_AS(table().from_key("b,cube,2.5", "--only"), InputError);
  CHECK_THROWS_AS(table().from_key("b,root,nan", "--only"), InputError);
  for (const char* shard : {"0/3", "4/3", "1", "1/3x", "1/0"}) CHECK_THROWS_AS(Shard::from(shard), InputError);
}
