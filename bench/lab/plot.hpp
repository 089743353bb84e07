// Plots by gnuplot: a script over a CSV file becomes an SVG beside it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace palpate {

struct Curve {
  std::string column;  ///< gnuplot `using` expression over the CSV, for example "1:4"
  std::string title;
  int style = 1;  ///< line type of the palette; 0 = the reference (black, behind the others)
};

struct Panel {
  std::string y_label;
  std::vector<Curve> curves;
};

/// Panels one below the other over a common x axis. Of `rows` rows so many are drawn that the file stays small (0: all). False
/// (with a line on stderr) when gnuplot is missing or fails: plots are an extra, the CSV is the result.
bool plot_csv(const std::filesystem::path& csv, const std::filesystem::path& svg, const std::string& title,
              const std::string& x_label, const std::vector<Panel>& panels, std::size_t rows = 0);

}  // namespace palpate
