// Section `scaling` of palpate-lab paper: the paper's section 5.2 and figure 16, stiffness of lattice blocks against their mesh
// density.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "bench/lab/experiments.hpp"
#include "bench/output/output.hpp"
#include "bench/output/plot.hpp"
#include "bench/paper/block_scaling.hpp"
#include "bench/paper/block_stiffness.hpp"

namespace palpate {
namespace {

struct ScalingRun {
  std::vector<BlockCurve> curves;  ///< four loadings x three dimensions

  const BlockCurve& find(BlockLoading loading, int dimension) const {
    return *std::find_if(curves.begin(), curves.end(),
                         [&](const BlockCurve& c) { return c.loading == loading && c.dimension == dimension; });
  }
};

constexpr const char* kSpaces[] = {"row", "plane", "solid"};  // 1-D, 2-D, 3-D in file columns

/// `plane`, `solid`: most elements along an edge of a block of one or two dimensions, and of three.
ScalingRun compute(int plane, int solid) {
  // A matrix of all nodes of a face requires a solve per node and axis, and a half space has eight times the nodes of a block.
  constexpr int kFaceSolid = 5, kContactSolid = 8;
  ScalingRun run;
  for (const BlockLoading loading : kBlockLoadings) {
    run.curves.push_back(block_curve(loading, 1, plane));
    run.curves.push_back(block_curve(loading, 2, plane));
    const int most = loading == BlockLoading::nodes     ? std::min(solid, kFaceSolid)
                     : loading == BlockLoading::contact ? std::min(solid, kContactSolid)
                                                        : solid;
    run.curves.push_back(block_curve(loading, 3, most));
  }
  return run;
}

/// Theoretical shape of a curve, scaled to its last point (1 / ln m: also to its second).
double theory(const BlockCurve& c, int m) {
  const int last = c.elements.back();
  if (c.loading == BlockLoading::contact) {
    const ShellCompliance w(c.dimension);
    return c.stiffness.front() / w(m);
  }
  if (c.dimension == 1) return 1.0 / m;
  if (c.loading == BlockLoading::plate) return c.stiffness.back() * std::pow(static_cast<double>(m) / last, c.dimension - 2);
  if (c.loading == BlockLoading::node && c.dimension == 2) {
    const double second = 1 / c.stiffness[1], slope = (1 / c.stiffness.back() - second) / std::log(0.5 * last);
    return 1 / (second + slope * std::log(0.5 * m));
  }
  return c.stiffness.back();
}

std::string cell(const BlockCurve& c, std::size_t i, bool law) {
  if (i >= c.elements.size()) return ",nan";
  return fmt::format(",{:.9g}", law ? theory(c, c.elements[i]) : c.stiffness[i]);
}

void write_curves(const std::filesystem::path& out, const ScalingRun& run) {
  for (const BlockLoading loading : kBlockLoadings) {
    std::string csv = "elements";
    for (const char* space : kSpaces) csv += fmt::format(",{0}_k,{0}_law_k", space);
    csv += "\n";
    for (std::size_t i = 0; i < run.find(loading, 1).elements.size(); ++i) {
      csv += std::to_string(i + 1);
      for (const int d : {1, 2, 3}) csv += cell(run.find(loading, d), i, false) + cell(run.find(loading, d), i, true);
      csv += "\n";
    }
    write_text(out / fmt::format("{}.csv", name_of(loading)), csv);
  }
}

/// Largest relative difference of the one-dimensional rows from springs in series.
double row_error(const ScalingRun& run) {
  double worst = 0;
  for (const BlockLoading loading : kBlockLoadings)
    for (std::size_t i = 0; i < run.find(loading, 1).elements.size(); ++i)
      worst = std::max(worst, std::abs(run.find(loading, 1).stiffness[i] * static_cast<double>(i + 1) - 1));
  return worst;
}

void write_scaling(const std::filesystem::path& out, const ScalingRun& run) {
  write_curves(out, run);
  const auto curves = [](const std::filesystem::path& csv, bool legend) {
    const auto title = [&](const char* text) { return legend ? std::string(text) : std::string(); };
    return std::vector<Curve>{{"1:6", title("3-D"), 1, csv, "linespoints"},
                              {"1:4", title("2-D"), 2, csv, "linespoints dt 2"},
                              {"1:2", title("1-D"), 3, csv, "linespoints dt 3"},
                              {"1:7", title("law"), 8, csv, "lines lw 1 dt 4"},
                              {"1:5", "", 8, csv, "lines lw 1 dt 4"},
                              {"1:3", "", 8, csv, "lines lw 1 dt 4"}};
  };
  plot_csv(out / "plate.csv", out / "scaling.svg", "Largest singular value of the stiffness of a block of fixed size",
           "elements along an edge of the block",
           {{"plate on the face [k]", curves(out / "plate.csv", true), true},
            {"middle node of the face [k]", curves(out / "node.csv", false), true},
            {"all nodes of the face [k]", curves(out / "nodes.csv", false), true},
            {"box around a contact [k]", curves(out / "contact.csv", false), true}},
           {.setup = "set xrange [0.5:*]"});
}

}  // namespace

PaperSection paper_scaling(const std::filesystem::path& out, bool quick) {
  make_output_folder(out.string());
  const ScalingRun run = quick ? compute(8, 5) : compute(16, 10);
  write_scaling(out, run);
  const auto last = [&](BlockLoading loading, int d) { return run.find(loading, d).stiffness.back(); };
  const auto step = [&](int d) {
    const BlockCurve& c = run.find(BlockLoading::plate, d);
    return c.stiffness.back() - c.stiffness[c.stiffness.size() - 2];
  };
  PaperSection s;
  s.title = "Section 5.2, figure 16: stiffness of a block and its mesh density";
  s.text =
      "Lattices of 1 to 16 elements along an edge, every element with the same k, statics at rest. The paper's figure has a "
      "curve for "
      "two and one for three dimensions without saying what is loaded, so four loadings are shown: the whole face as a rigid "
      "plate, "
      "its middle node alone, all its nodes separately, and a box of cells around a contact in a half space. The last is what "
      "the "
      "two-layer model replaces, so its law scales that model's outer elements.";
  s.findings.push_back({"check in one dimension: springs in series", "k/n (section 5.1)",
                        fmt::format("k/n within {:.0e}", row_error(run)), Verdict::agrees, ""});
  s.findings.push_back(
      {"3-D block under a plate, against the elements n along its edge", "a curve, fig. 16, without loading or figures",
       fmt::format("n^{:.2f}, in the end {:.2f} k more an element", run.find(BlockLoading::plate, 3).exponent, step(3)),
       Verdict::beyond, "a column of modulus E: E n^2 / n; E is 2.7 k per spacing with free sides, 4.3 confined"});
  s.findings.push_back(
      {"2-D block under a plate", "a curve, fig. 16, without loading or figures",
       fmt::format("n^{:.2f}, in the end {:.2f} k", run.find(BlockLoading::plate, 2).exponent, last(BlockLoading::plate, 2)),
       Verdict::beyond, "E n / n, constant; E is 1.5 k with free sides, 2 confined"});
  const auto ratio = [&](int d) {
    const BlockCurve& c = run.find(BlockLoading::contact, d);
    return fmt::format("{:.2f} of that with one element, at {} elements", c.stiffness.back() / c.stiffness.front(),
                       c.elements.back());
  };
  s.findings.push_back({"outer elements' stiffness around a contact, 2-D", "scaled by fig. 16", ratio(2), Verdict::beyond,
                        "falls as 1/ln n: a force spreads in a half plane"});
  s.findings.push_back({"outer elements' stiffness around a contact, 3-D", "scaled by fig. 16", ratio(3), Verdict::beyond,
                        "tends to a constant: a force spreads in a half space"});
  s.pictures = {{out / "scaling.svg",
                 "Figure 16 for four loadings, in units of an element's stiffness k. Thin lines: n^(d-2) under the plate; 1/n, "
                 "1/ln n and a "
                 "constant for the middle node; a constant for all nodes; the law of the two-layer model around a contact."}};
  return s;
}

}  // namespace palpate
