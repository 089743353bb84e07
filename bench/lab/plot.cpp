#include "bench/lab/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

namespace palpate {
namespace {

constexpr std::size_t kRowsDrawn = 2500;
constexpr int kWidth = 960, kPanelHeight = 260, kHeaderHeight = 70;
// Okabe and Ito's palette: told apart with any colour vision.
constexpr const char* kColours[] = {"#222222", "#0072b2", "#e69f00", "#009e73", "#cc79a7", "#d55e00"};

std::string quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("''") : std::string(1, c);
  return out + "'";
}

std::string script(const std::filesystem::path& csv, const std::filesystem::path& svg, const std::string& title,
                   const std::string& x_label, const std::vector<Panel>& panels, std::size_t rows) {
  const auto count = static_cast<int>(panels.size());
  const std::size_t every = std::max<std::size_t>(1, rows / kRowsDrawn);
  std::string s = fmt::format("set terminal svg size {},{} font 'DejaVu Sans,13' background '#ffffff'\n", kWidth,
                              kHeaderHeight + count * kPanelHeight);
  s += fmt::format("set output {}\nset datafile separator ','\nset datafile missing 'nan'\n", quoted(svg.string()));
  s += fmt::format("set multiplot layout {},1 title {} font ',15'\n", count, quoted(title));
  s += "set grid lc rgb '#dddddd' lw 0.6\nset border 3 lc rgb '#888888'\nset tics nomirror textcolor rgb '#333333'\n";
  s += "set lmargin 11\nset rmargin 3\nset key outside top right horizontal samplen 2\n";
  for (int p = 0; p < count; ++p) {
    const Panel& panel = panels[static_cast<std::size_t>(p)];
    s += fmt::format("set ylabel {}\nset xlabel {}\nplot ", quoted(panel.y_label), p + 1 == count ? quoted(x_label) : "''");
    bool first = true;
    for (const Curve& c : panel.curves) {
      s += fmt::format("{}{} using {} skip 1 every {} with lines lc rgb '{}' lw {} title {}", first ? "" : ", ",
                       quoted(csv.string()), c.column, every, kColours[static_cast<std::size_t>(c.style) % std::size(kColours)],
                       c.style == 0 ? 3.0 : 1.6, quoted(c.title));
      first = false;
    }
    s += "\n";
  }
  return s + "unset multiplot\n";
}

}  // namespace

bool plot_csv(const std::filesystem::path& csv, const std::filesystem::path& svg, const std::string& title,
              const std::string& x_label, const std::vector<Panel>& panels, std::size_t rows) {
  const std::string text = script(csv, svg, title, x_label, panels, rows);
  FILE* pipe = popen("gnuplot 2>/dev/null", "w");
  bool ok = pipe && std::fwrite(text.data(), 1, text.size(), pipe) == text.size();
  ok = pipe && pclose(pipe) == 0 && ok;
  if (!ok)
    fmt::print(stderr, "no plot {}: gnuplot (package gnuplot-nox) is missing or failed; the figures are in {}\n", svg.string(),
               csv.string());
  return ok;
}

}  // namespace palpate
