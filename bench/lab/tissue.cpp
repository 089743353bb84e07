// palpate-lab tissue: how far bodies are from the continuum that their scenes name, over the size of their meshes.
#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <map>

#include "bench/lab/experiments.hpp"
#include "bench/lab/tissue_cases.hpp"
#include "bench/output/output.hpp"
#include "bench/output/plot.hpp"

namespace palpate {
namespace {

struct TissueFlags {
  std::string out;
  bool quick = false;
};

struct Series {
  const TissueCase* of = nullptr;
  TissueElement element = TissueElement::hexahedron;
  std::vector<TissueAnswer> answers;

  double error(const TissueAnswer& a) const { return a.value / of->reference - 1; }
  /// p of |error| ~ size^p, by least squares over its meshes; NaN for one.
  double order() const {
    const auto n = static_cast<double>(answers.size());
    double x = 0, y = 0, xx = 0, xy = 0;
    for (const TissueAnswer& a : answers) {
      const double log_h = -std::log(a.cells_high), log_e = std::log(std::abs(error(a)));
      x += log_h;
      y += log_e;
      xx += log_h * log_h;
      xy += log_h * log_e;
    }
    return (n * xy - x * y) / (n * xx - x * x);
  }
};

std::vector<int> sizes(const TissueCase& of, bool quick) {
  if (of.punch_m > 0) return quick ? std::vector<int>{3, 6} : std::vector<int>{3, 6, 9};
  return quick ? std::vector<int>{2, 4} : std::vector<int>{2, 4, 8};
}

std::vector<Series> run_all(bool quick) {
  std::vector<Series> all;
  for (const TissueCase& c : tissue_cases())
    for (const TissueElement element : {TissueElement::hexahedron, TissueElement::tetrahedron, TissueElement::spring}) {
      Series series{&c, element, {}};
      for (const int cells : sizes(c, quick))
        if (auto found = answer(c, element, cells)) series.answers.push_back(*found);
      if (!series.answers.empty()) all.push_back(std::move(series));
    }
  return all;
}

void print(const std::vector<Series>& all) {
  fmt::print("{:<24}{:>12}  {:<12}  {}\n", "body", "CalculiX", "element",
             "cells high: answer, error; order of the error in their size");
  const TissueCase* last = nullptr;
  for (const Series& s : all) {
    const std::string reference = fmt::format("{:.4g} {}", s.of->reference, s.of->unit);
    fmt::print("{:<24}{:>12}  {:<12}", s.of == last ? "" : s.of->name, s.of == last ? "" : reference,
               kTissueElementNames[static_cast<int>(s.element)]);
    for (const TissueAnswer& a : s.answers) fmt::print("  {}: {:.4g}, {:+.1f} %", a.cells_high, a.value, 100 * s.error(a));
    fmt::print("  order {:.1f}\n", s.order());
    last = s.of;
  }
}

void write(const std::filesystem::path& out, const std::vector<Series>& all) {
  std::string csv = "case,element,poisson,cells_high,nodes,value,unit,reference,error,cpu_s\n";
  Json cells = Json::array();
  std::map<const TissueCase*, GridPanel> panels;
  for (const Series& s : all) {
    const std::string element = kTissueElementNames[static_cast<int>(s.element)];
    std::string points = "nodes,error_percent\n";
    for (const TissueAnswer& a : s.answers) {
      fmt::format_to(std::back_inserter(csv), "\"{}\",{},{},{},{},{:.6g},{},{},{:.6g},{:.3g}\n", s.of->name, element,
                     s.of->poisson, a.cells_high, a.nodes, a.value, s.of->unit, s.of->reference, s.error(a), a.cpu_s);
      fmt::format_to(std::back_inserter(points), "{},{:.6g}\n", a.nodes, 100 * std::abs(s.error(a)));
      cells.push_back({{"case", s.of->name},
                       {"element", element},
                       {"cells_high", a.cells_high},
                       {"nodes", a.nodes},
                       {"value", a.value},
                       {"unit", s.of->unit},
                       {"reference", s.of->reference},
                       {"error", s.error(a)},
                       {"order", s.order()}});
    }
    const auto file = out / fmt::format("{}-{}.csv", s.of - tissue_cases().data(), element);
    write_text(file, points);
    GridPanel& panel = panels[s.of];
    panel.title = s.of->name;
    panel.x_label = "nodes";
    panel.y_label = "error [%]";
    panel.setup = "set logscale xy\nset format xy '%g'\nset yrange [0.05:3000]\n";
    panel.curves.push_back({"1:2", element, static_cast<int>(s.element) + 1, file, "linespoints"});
  }
  write_text(out / "cells.csv", csv);
  write_json(out / "summary.json", {{"cells", cells}});
  std::vector<GridPanel> ordered;
  for (const TissueCase& c : tissue_cases())
    if (panels.contains(&c)) ordered.push_back(panels[&c]);
  plot_grid_with_one_legend(out / "tissue.svg", "Error against CalculiX over the number of nodes", 3, ordered);
}

int run_tissue(const TissueFlags& flags) {
  const auto out = make_output_folder(flags.out);
  const std::vector<Series> all = run_all(flags.quick);
  print(all);
  write(out, all);
  fmt::print("\n{}\n{}\n", (out / "tissue.svg").string(), (out / "summary.json").string());
  return 0;
}

}  // namespace

void add_tissue(CLI::App& app, Run& run) {
  auto flags = std::make_shared<TissueFlags>();
  CLI::App* c = app.add_subcommand("tissue", "how far bodies are from the continuum that they stand for, beside another solver");
  c->add_flag("--quick", flags->quick, "without the finest meshes");
  c->add_option("--out", flags->out, "folder for cells.csv, summary.json and tissue.svg")->type_name("DIR")->required();
  c->callback([flags, &run] { run = [flags] { return run_tissue(*flags); }; });
}

}  // namespace palpate
