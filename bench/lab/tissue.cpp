// palpate-lab tissue: error of bodies against the continuum that their scenes describe, over the size of their meshes.
// palpate-lab surgery: that of needles, blades, tears and threads in them.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <iterator>
#include <limits>
#include <set>

#include "bench/lab/experiments.hpp"
#include "bench/output/output.hpp"
#include "bench/output/plot.hpp"
#include "bench/tissue/tissue_case.hpp"
#include "common/base/error.hpp"

namespace palpate {
namespace {

struct TissueFlags {
  std::string out, only;
  bool quick = false;
};

struct TissueMesh {
  int cells = 0;
  TissueSolution found;  // NaN if no equilibrium was found
  double error = 0, cpu_s = 0;
};

struct TissueSeries {
  const TissueCase* of = nullptr;
  TissueElement element = TissueElement::hexahedron;
  std::vector<TissueMesh> meshes;

  const char* element_name() const { return kTissueElementNames[static_cast<int>(element)]; }
  double order() const {
    std::vector<int> cells;
    std::vector<double> errors;
    for (const TissueMesh& mesh : meshes) {
      cells.push_back(mesh.cells);
      errors.push_back(mesh.error);
    }
    return order_of(cells, errors);
  }
};

TissueMesh solve_mesh(const TissueCase& of, TissueElement element, int cells) {
  const std::int64_t begin = processor_ns();
  TissueMesh mesh;
  mesh.cells = cells;
  try {
    mesh.found = of.solve(element, cells);
  } catch (const std::runtime_error& error) {
    fmt::print(stderr, "{}, {}, {} cells: {}\n", of.name, kTissueElementNames[static_cast<int>(element)], cells, error.what());
    mesh.found.value = std::numeric_limits<double>::quiet_NaN();
  }
  mesh.cpu_s = 1e-9 * static_cast<double>(processor_ns() - begin);
  mesh.error = mesh.found.value / of.reference - 1;
  return mesh;
}

std::vector<const TissueCase*> chosen_cases(const std::vector<TissueCase>& all, const std::string& only) {
  std::vector<const TissueCase*> chosen;
  for (const TissueCase& c : all)
    if ((c.family + ": " + c.name).find(only) != std::string::npos) chosen.push_back(&c);
  std::set<std::string> families;
  for (const TissueCase& c : all) families.insert(c.family);
  if (chosen.empty())
    throw InputError("--only", "no case has '" + only + "' in \"FAMILY: NAME\"",
                     fmt::format("a part of one; the families are {}", fmt::join(families, ", ")));
  return chosen;
}

std::string percent_of(double error) { return std::isfinite(error) ? fmt::format("{:+.2g}", 100 * error) : "none found"; }

void print_head() {
  fmt::print("{:<36}{:>16} {:<16}{:<12}  {}\n", "case", "reference", "by", "element",
             "cells: answer, error; order of the error in their size");
}

void print_series(const TissueSeries& s) {
  fmt::print("{:<36}{:>16} {:<16}{:<12}", s.of->name, fmt::format("{:.5g} {}", s.of->reference, s.of->unit), s.of->by,
             s.element_name());
  for (const TissueMesh& m : s.meshes) fmt::print("  {}: {:.4g}, {} %", m.cells, m.found.value, percent_of(m.error));
  if (const double p = s.order(); std::isfinite(p)) fmt::print("  order {:.1f}", p);
  fmt::print("\n");
  std::fflush(stdout);
}

/// Row of docs/results/tissue.md.
std::string row_of(const TissueSeries& s) {
  std::string cells, errors;
  for (const TissueMesh& m : s.meshes) {
    fmt::format_to(std::back_inserter(cells), "{}{}", cells.empty() ? "" : " / ", m.cells);
    fmt::format_to(std::back_inserter(errors), "{}{}", errors.empty() ? "" : " / ", percent_of(m.error));
  }
  const double p = s.order();
  return fmt::format("| {} | {:.4g} {} | {} | {} | {} | {} % | {} |\n", s.of->name, s.of->reference, s.of->unit, s.of->by,
                     s.element_name(), cells, errors, std::isfinite(p) ? fmt::format("{:.1f}", p) : "");
}

std::string file_name(std::string text) {
  for (char& c : text)
    c = std::isalnum(static_cast<unsigned char>(c)) ? static_cast<char>(std::tolower(static_cast<unsigned char>(c))) : '-';
  return text;
}

void plot_families(const std::filesystem::path& out, const std::vector<TissueSeries>& all) {
  std::vector<std::pair<std::string, std::vector<GridPanel>>> families;
  for (const TissueSeries& s : all) {
    if (s.meshes.size() < 2 || s.of->cells.size() < 2) continue;
    if (families.empty() || families.back().first != s.of->family) families.push_back({s.of->family, {}});
    auto& panels = families.back().second;
    if (panels.empty() || panels.back().title != s.of->name)
      panels.push_back({s.of->name, "nodes", "error [%]", {}, "set logscale xy\nset format xy '%g'\nset yrange [0.01:3000]\n"});
    std::string points = "nodes,error_percent\n";
    for (const TissueMesh& m : s.meshes)
      if (std::isfinite(m.error))
        fmt::format_to(std::back_inserter(points), "{},{:.6g}\n", m.found.nodes, 100 * std::abs(m.error));
    const auto file = out / (file_name(s.of->name) + "-" + s.element_name() + ".csv");
    write_text(file, points);
    panels.back().curves.push_back({"1:2", s.element_name(), static_cast<int>(s.element) + 1, file, "linespoints"});
  }
  for (const auto& [family, panels] : families)
    plot_grid(out / (file_name(family) + ".svg"), "Error over the number of nodes: " + family, 3, panels);
}

void write_tissue(const std::filesystem::path& out, const std::vector<TissueSeries>& all) {
  std::string csv = "family,case,element,cells,nodes,value,unit,reference,by,error,cpu_s\n", table;
  Json rows = Json::array();
  for (const TissueSeries& s : all) {
    table += row_of(s);
    for (const TissueMesh& m : s.meshes) {
      fmt::format_to(std::back_inserter(csv), "{},\"{}\",{},{},{},{:.8g},{},{:.6g},{},{:.6g},{:.3g}\n", s.of->family, s.of->name,
                     s.element_name(), m.cells, m.found.nodes, m.found.value, s.of->unit, s.of->reference, s.of->by, m.error,
                     m.cpu_s);
      Json row{{"family", s.of->family}, {"case", s.of->name},     {"element", s.element_name()}, {"cells", m.cells},
               {"nodes", m.found.nodes}, {"value", m.found.value}, {"unit", s.of->unit},          {"reference", s.of->reference},
               {"by", s.of->by},         {"error", m.error}};
      if (const double p = s.order(); std::isfinite(p)) row["order"] = p;
      rows.push_back(std::move(row));
    }
  }
  write_text(out / "cells.csv", csv);
  write_text(out / "table.md",
             "| case | reference | by | element | cells | error | order |\n|---|---|---|---|---|---|---|\n" + table);
  write_json(out / "summary.json", {{"cells", rows}});
  plot_families(out, all);
}

int run_tissue(const TissueFlags& flags, const std::vector<TissueCase>& all_cases) {
  const std::vector<const TissueCase*> cases = chosen_cases(all_cases, flags.only);
  const auto out = make_output_folder(flags.out);
  std::vector<TissueSeries> all;
  print_head();
  for (const TissueCase* c : cases)
    for (const TissueElement element : c->elements) {
      TissueSeries& series = all.emplace_back(TissueSeries{c, element, {}});
      const std::size_t meshes = flags.quick && c->cells.size() > 1 ? c->cells.size() - 1 : c->cells.size();
      for (std::size_t k = 0; k < meshes; ++k) series.meshes.push_back(solve_mesh(*c, element, c->cells[k]));
      print_series(series);
    }
  write_tissue(out, all);
  fmt::print("\n{}\n{}\n", (out / "table.md").string(), (out / "summary.json").string());
  return 0;
}

void add_cases(CLI::App& command, Run& run, std::function<std::vector<TissueCase>()> cases, const std::string& examples) {
  auto flags = std::make_shared<TissueFlags>();
  command.add_flag("--quick", flags->quick, "leave out the finest meshes");
  command.add_option("--only", flags->only, "only cases with this text in \"FAMILY: NAME\", such as " + examples)
      ->type_name("TEXT");
  command.add_option("--out", flags->out, "folder for cells.csv, table.md, summary.json and plots")->type_name("DIR")->required();
  command.callback([flags, cases, &run] { run = [flags, cases] { return run_tissue(*flags, cases()); }; });
}

}  // namespace

void add_tissue(CLI::App& app, Run& run) {
  add_cases(*app.add_subcommand("tissue",
                                "compare bodies with the continuum that they stand for: closed forms, theory, another solver"),
            run, tissue_cases, "'layers' or 'nu = 0.49'");
}

void add_surgery(CLI::App& app, Run& run) {
  add_cases(*app.add_subcommand(
                "surgery", "compare needles, blades, tears and threads in bodies with their laws, over the size of the meshes"),
            run, surgery_cases, "'blade', 'double cantilever' or 'thread'");
}

}  // namespace palpate
