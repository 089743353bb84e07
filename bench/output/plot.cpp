#include "bench/output/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>

namespace palpate {
namespace {

constexpr std::size_t kRowsDrawn = 2500;
constexpr int kWidth = 960, kPanelHeight = 260, kHeaderHeight = 70;
constexpr int kReferenceType = 8;

std::string house_style(const std::filesystem::path& svg, int width, int height) {
  constexpr int kPoints[] = {5, 7, 9, 11, 13, 4, 6, 8};  // all different: filled ones, then open ones
  constexpr const char* kColours[] = {"#0072b2", "#e69f00", "#009e73", "#cc79a7", "#d55e00", "#7b3fa0", "#8c6a3f", "#222222"};
  std::string s = fmt::format("set terminal svg size {},{} font 'DejaVu Sans,13' background '#ffffff'\nset output {}\n", width,
                              height, quoted(svg.string()));
  s += "set encoding utf8\nset datafile separator ','\nset datafile missing 'nan'\n";
  for (std::size_t k = 0; k < std::size(kColours); ++k)
    s += fmt::format("set linetype {} lc rgb '{}' lw {} pt {} ps 0.6\n", k + 1, kColours[k], k + 1 == kReferenceType ? 3.0 : 1.6,
                     kPoints[k]);
  s += "set grid lc rgb '#dddddd' lw 0.6\nset border 3 lc rgb '#888888'\nset tics nomirror textcolor rgb '#333333'\n";
  return s;
}

std::string curve(const Curve& c, const std::filesystem::path& csv, std::size_t every) {
  const int type = c.style == 0 ? kReferenceType : c.style;
  return fmt::format("{} using {} skip 1 every {} with {} lt {} title {}", quoted((c.csv.empty() ? csv : c.csv).string()),
                     c.column, every, c.with, type, quoted(c.title));
}

/// Returns true if gnuplot accepted all of the text. If gnuplot is missing or ends early, writing fails, which must not end this
/// program.
bool gnuplot_draws(const std::string& text) {
  auto* const before = std::signal(SIGPIPE, SIG_IGN);
  FILE* const pipe = popen("gnuplot 2>/dev/null", "w");
  const bool written = pipe && std::fwrite(text.data(), 1, text.size(), pipe) == text.size();
  const bool ended_well = pipe && pclose(pipe) == 0;
  std::signal(SIGPIPE, before);
  return written && ended_well;
}

}  // namespace

std::string quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("''") : std::string(1, c);
  return out + "'";
}

std::string map_palette() {
  return "set palette defined (0 '#fcfdbf', 0.25 '#fc8961', 0.5 '#b73779', 0.75 '#51127c', 1 '#000004')\n";
}

bool plot_script(const std::filesystem::path& svg, int width, int height, const std::string& body) {
  const bool ok = gnuplot_draws(house_style(svg, width, height) + body);
  if (!ok)
    fmt::print(stderr,
               "no plot {}: gnuplot (package gnuplot-nox) is missing or failed; the figures are in the CSV files beside it\n",
               svg.string());
  return ok;
}

bool plot_csv(const std::filesystem::path& csv, const std::filesystem::path& svg, const std::string& title,
              const std::string& x_label, const std::vector<Panel>& panels, const PlotOptions& options) {
  const auto count = static_cast<int>(panels.size());
  const std::size_t every = std::max<std::size_t>(1, options.rows / kRowsDrawn);
  std::string s = fmt::format("set multiplot layout {},1 title {} font ',15'\n", count, quoted(title));
  s += "set lmargin 11\nset rmargin 3\nset key outside top right horizontal samplen 2\n";
  if (options.log_x) s += "set logscale x\nset format x '10^{%T}'\n";
  s += options.setup + "\n";
  for (int p = 0; p < count; ++p) {
    const Panel& panel = panels[static_cast<std::size_t>(p)];
    s += panel.log_y ? "set logscale y\nset format y '10^{%T}'\n" : "unset logscale y\nset format y '% h'\n";
    s += fmt::format("{}\nset ylabel {}\nset xlabel {}\nplot ", panel.setup, quoted(panel.y_label),
                     p + 1 == count ? quoted(x_label) : "''");
    for (std::size_t k = 0; k < panel.curves.size(); ++k) s += (k > 0 ? ", " : "") + curve(panel.curves[k], csv, every);
    s += "\n";
  }
  return plot_script(svg, kWidth, kHeaderHeight + count * kPanelHeight, s + "unset multiplot\n");
}

bool plot_grid(const std::filesystem::path& svg, const std::string& title, int columns, const std::vector<GridPanel>& panels) {
  constexpr int kGridPanelHeight = 300, kEntriesALine = 4, kLegendLine = 20, kTitleHeight = 40, kBelow = 60, kBetween = 110;
  std::vector<const Curve*> entries;  // one per title
  for (const GridPanel& panel : panels)
    for (const Curve& c : panel.curves)
      if (std::none_of(entries.begin(), entries.end(), [&](const Curve* known) { return known->title == c.title; }))
        entries.push_back(&c);
  const int lines = (static_cast<int>(entries.size()) + kEntriesALine - 1) / kEntriesALine;
  const int rows = (static_cast<int>(panels.size()) + columns - 1) / columns;
  const int head = kTitleHeight + lines * kLegendLine + 40;
  const int height = head + rows * kGridPanelHeight - (kBetween - kBelow);
  const auto part = [&](int pixels) { return static_cast<double>(pixels) / height; };
  std::string s = fmt::format(
      "set multiplot layout {},{} title {} font ',15' margins screen {},0.97,{:.4f},{:.4f} spacing screen {},{:.4f}\n", rows,
      columns, quoted(title), columns > 2 ? 0.07 : 0.08, part(kBelow), 1 - part(head), columns > 2 ? 0.075 : 0.1, part(kBetween));
  for (std::size_t p = 0; p < panels.size(); ++p) {
    const GridPanel& panel = panels[p];
    s += "unset logscale\nunset label\nunset arrow\nset xrange [*:*]\nset yrange [*:*]\nset format '% h'\n";
    s += fmt::format("set title {} font ',13'\nset xlabel {}\nset ylabel {}\n{}\n", quoted(panel.title), quoted(panel.x_label),
                     quoted(panel.y_label), panel.setup);
    s += p > 0 ? "unset key\nplot "
               : fmt::format(
                     "set key at screen 0.5, screen {:.4f} center top vertical reverse Left maxrows {} samplen 2.5 font ',12' "
                     "noautotitle\n"
                     "plot ",
                     1 - part(kTitleHeight), lines);
    for (std::size_t k = 0; k < panel.curves.size(); ++k) {
      Curve untitled = panel.curves[k];
      untitled.title.clear();
      s += (k > 0 ? ", " : "") + curve(untitled, {}, 1);
    }
    if (p == 0)
      for (const Curve* entry : entries)
        s += fmt::format(", keyentry with {} lt {} title {}", entry->with, entry->style == 0 ? kReferenceType : entry->style,
                         quoted(entry->title));
    s += "\n";
  }
  return plot_script(svg, kWidth, height, s + "unset multiplot\n");
}

}  // namespace palpate
