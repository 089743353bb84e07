// The experiments of palpate-lab, each a subcommand with its own flags, and the sections of `palpate-lab paper`.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "bench/output/experiment.hpp"

namespace palpate {

void add_draw(CLI::App& app, Run& run);
void add_replay(CLI::App& app, Run& run);
void add_masking(CLI::App& app, Run& run);
void add_accuracy(CLI::App& app, Run& run);
void add_pareto(CLI::App& app, Run& run);
void add_stations(CLI::App& app, Run& run);
void add_starved(CLI::App& app, Run& run);
void add_world(CLI::App& app, Run& run);
void add_gesture(CLI::App& app, Run& run);
void add_advise(CLI::App& app, Run& run);
void add_surface(CLI::App& app, Run& run);
void add_tissue(CLI::App& app, Run& run);
void add_surgery(CLI::App& app, Run& run);
void add_lump(CLI::App& app, Run& run);
void add_tools(CLI::App& app, Run& run);
void add_needle(CLI::App& app, Run& run);
void add_stability(CLI::App& app, Run& run);
void add_paper(CLI::App& app, Run& run);
void add_export(CLI::App& app, Run& run);
void add_summary(CLI::App& app, Run& run);

/// agrees: the paper's statement or number holds here. differs: it does not, and `reason` says why. beyond: the paper has no
/// number; ours is stated.
enum class Verdict { agrees, differs, beyond };

/// One line of the report: the paper's statement and our result.
struct Finding {
  std::string what;   ///< "SNR of the held force", with the unit
  std::string paper;  ///< printed there, or read from its figure; empty if it says nothing
  std::string ours;
  Verdict verdict = Verdict::agrees;
  std::string reason;  ///< required for `differs`; else an optional remark
};

/// A plot with its caption; CSV files next to it hold the figures.
struct Figure {
  std::filesystem::path svg;
  std::string caption;
};

/// A section of the report.
struct PaperSection {
  std::string title;  ///< "Section 2, figure 2: a nonlinear spring"
  std::string text;   ///< one to four sentences: what was computed, how, and what to look at
  std::vector<Finding> findings;
  std::vector<Figure> pictures;
};

// Each writes its files into `out` (created if missing) and returns the section. `quick`: coarser grids and shorter runs of the
// same code.
PaperSection paper_spring1d(const std::filesystem::path& out, bool quick);
PaperSection paper_chain(const std::filesystem::path& out, bool quick);
PaperSection paper_bode(const std::filesystem::path& out, bool quick);
PaperSection paper_modes(const std::filesystem::path& out, bool quick);
PaperSection paper_scaling(const std::filesystem::path& out, bool quick);
PaperSection paper_haptic(const std::filesystem::path& out, bool quick);
PaperSection paper_release(const std::filesystem::path& out, bool quick);
PaperSection paper_limits(const std::filesystem::path& out, bool quick);

}  // namespace palpate
