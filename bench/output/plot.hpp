// Plots by gnuplot: scripts over CSV files become SVG pictures in the house style.
//
// House style: white ground, DejaVu Sans, light grid, and line types after the palette of Okabe and Ito: 1 blue, 2 orange, 3
// green, 4 pink, 5 red, 6 purple, 7 brown; 8 is near-black, for references. Each has its own mark, so that they can be
// distinguished with any colour vision. If gnuplot is missing or fails, all functions report it on stderr and return false: plots
// are optional, the CSV is the result.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace palpate {

struct Curve {
  std::string column;  ///< gnuplot `using` expression over the CSV, for example "1:4"
  std::string title;
  int style = 1;                   ///< line type of the palette; 0 = the reference (black, thick, drawn in the order of the list)
  std::filesystem::path csv = {};  ///< file if it differs from that of the plot
  std::string with = "lines";      ///< gnuplot style: lines, points, linespoints, "lines dt 2" (dashed), ...
};

struct Panel {
  std::string y_label;
  std::vector<Curve> curves;
  bool log_y = false;
  std::string setup = {};  ///< gnuplot commands before this panel, for example "set yrange [0:5]"
};

struct PlotOptions {
  std::size_t rows = 0;  ///< rows of the CSV: above 2500 some are skipped to keep the file small (0: all are drawn)
  bool log_x = false;
  std::string setup = {};  ///< gnuplot commands for all panels, for example "set xrange [10:1000]"
};

/// Draws panels one below the other over a common x axis.
bool plot_csv(const std::filesystem::path& csv, const std::filesystem::path& svg, const std::string& title,
              const std::string& x_label, const std::vector<Panel>& panels, const PlotOptions& options = {});

/// A panel with its own x axis; every curve names its CSV.
struct GridPanel {
  std::string title, x_label, y_label;
  std::vector<Curve> curves;
  std::string setup = {};  ///< gnuplot commands for this panel only, for example "set logscale x"
};

/// Draws panels in rows of `columns` with one legend above all of them: curves with one title have one style in all panels.
bool plot_grid(const std::filesystem::path& svg, const std::string& title, int columns, const std::vector<GridPanel>& panels);

/// Draws a special picture: `body` is gnuplot code, run after the house style is set. Paths and texts must pass through quoted().
bool plot_script(const std::filesystem::path& svg, int width, int height, const std::string& body);

/// Quotes a text as a gnuplot string.
std::string quoted(const std::string& text);
/// gnuplot command for a single-hue, perceptually even palette for maps.
std::string map_palette();

}  // namespace palpate
