// The experiments of palpate-lab. Each adds its own sub-command with its own flags; those of the paper can also be run by
// `palpate-lab paper`, which sets what they find beside what is printed there.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "bench/output/experiment.hpp"

namespace palpate {

void add_draw(CLI::App& app, Run& run);
void add_replay(CLI::App& app, Run& run);
void add_live(CLI::App& app, Run& run);
void add_masking(CLI::App& app, Run& run);
void add_truth(CLI::App& app, Run& run);
void add_pareto(CLI::App& app, Run& run);
void add_stations(CLI::App& app, Run& run);
void add_load(CLI::App& app, Run& run);
void add_skip(CLI::App& app, Run& run);
void add_bench(CLI::App& app, Run& run);
void add_beside(CLI::App& app, Run& run);
void add_world(CLI::App& app, Run& run);
void add_spring1d(CLI::App& app, Run& run);
void add_chain(CLI::App& app, Run& run);
void add_bode(CLI::App& app, Run& run);
void add_modes(CLI::App& app, Run& run);
void add_scaling(CLI::App& app, Run& run);
void add_gesture(CLI::App& app, Run& run);
void add_settle(CLI::App& app, Run& run);
void add_advise(CLI::App& app, Run& run);
void add_tissue(CLI::App& app, Run& run);
void add_haptic(CLI::App& app, Run& run);
void add_release(CLI::App& app, Run& run);
void add_stability(CLI::App& app, Run& run);
void add_limits(CLI::App& app, Run& run);
void add_dominance(CLI::App& app, Run& run);
void add_couplings(CLI::App& app, Run& run);
void add_paper(CLI::App& app, Run& run);
void add_export(CLI::App& app, Run& run);
void add_summary(CLI::App& app, Run& run);

/// agrees: the paper's statement or number holds here. differs: it does not, and `reason` says why. beyond: the paper has no
/// number; ours is stated.
enum class Verdict { agrees, differs, beyond };

/// One line of the report: what the paper says, what we get.
struct Finding {
  std::string what;   ///< "SNR of the held force", with the unit
  std::string paper;  ///< as printed there, or what it shows; empty when it is silent
  std::string ours;
  Verdict verdict = Verdict::agrees;
  std::string reason;  ///< needed for `differs`; elsewhere a remark, may be empty
};

/// A plot with its caption; CSV files beside it hold the figures.
struct Figure {
  std::filesystem::path svg;
  std::string caption;
};

/// A section of the report.
struct PaperSection {
  std::string title;    ///< "Section 2, figure 2: a nonlinear spring"
  std::string command;  ///< that makes this section alone: "palpate-lab spring1d --out DIR"
  std::string text;     ///< one to four sentences: what was computed and how, what to see
  std::vector<Finding> findings;
  std::vector<Figure> pictures;
};

// Each writes what its command writes into `out` (made when missing) and returns the section. `quick`: coarser grids and shorter
// runs, the same code.
PaperSection paper_spring1d(const std::filesystem::path& out, bool quick);
PaperSection paper_chain(const std::filesystem::path& out, bool quick);
PaperSection paper_bode(const std::filesystem::path& out, bool quick);
PaperSection paper_modes(const std::filesystem::path& out, bool quick);
PaperSection paper_scaling(const std::filesystem::path& out, bool quick);
PaperSection paper_haptic(const std::filesystem::path& out, bool quick);
PaperSection paper_release(const std::filesystem::path& out, bool quick);
PaperSection paper_limits(const std::filesystem::path& out, bool quick);
PaperSection paper_couplings(const std::filesystem::path& out, bool quick);

}  // namespace palpate
