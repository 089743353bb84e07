// palpate-lab: experiments on touch under latency. `palpate-lab list` lists them.
#include <fmt/format.h>

#include <string>
#include <vector>

#include "bench/lab/experiments.hpp"
#include "bench/output/run_record.hpp"
#include "bench/report/fidelity_report.hpp"
#include "common/base/error.hpp"

namespace {

using namespace palpate;

/// An experiment: the function that adds it, and its command name.
struct LabExperiment {
  void (*add)(CLI::App&, Run&);
  std::string example;
};

/// Experiments grouped by the question that they answer.
struct Question {
  const char* asks;
  std::vector<LabExperiment> experiments;
};

void add_fidelity(CLI::App& app, Run& run) { add_fidelity_flags(*app.add_subcommand("fidelity", kFidelityText), run); }

const std::vector<Question>& questions() {
  static const std::vector<Question> all{
      {"How accurate is the force that a hand feels, on a motion or recording of mine?",
       {{add_replay, "replay --scene scenes/touch-cube.json --gesture press --scheme port --rtt-ms 120 --out out/replay"},
        {add_fidelity, fmt::format("fidelity {}", kFidelityExample)},
        {add_gesture, "gesture --scene scenes/organ.json --kind tour --out out/tour.csv"}}},
      {"Which scheme is best, and how far away may the server be?",
       {{add_accuracy, "accuracy --quick --only cube6,touch-cube --out out/accuracy"},
        {add_masking, "masking --quick --out out/masking"},
        {add_pareto, "pareto --quick --out out/pareto"},
        {add_lump, "lump --quick --out out/lump"},
        {add_tools, "tools --only touch-cube --tools shaft --out out/tools"},
        {add_needle, "needle --rtt-ms 150 --speed-mm-s 30 --out out/needle"}}},
      {"How many hands does a server carry, on how large a body, at what cost?",
       {{add_stations, "stations --scene scenes/touch-cube.json --stations 3 --out out/stations"},
        {add_starved, "starved --scene scenes/organ.json --out out/starved"}}},
      {"Is the loop stable, and does it stay safe when everything goes wrong?",
       {{add_stability, "stability --quick --schemes port,hold --out out/stability"}, {add_world, "world --seed 17"}}},
      {"What happened in a session that was recorded?",
       {{add_summary, "summary --recording out/session.rec --out out/summary"},
        {add_export, "export --recording out/session.rec --out out/files"}}},
      {"What does the paper of Cavusoglu and Tendick state, and does it hold?", {{add_paper, "paper --quick --out out/paper"}}},
      {"How far is a body from the material that its scene names?",
       {{add_tissue, "tissue --quick --out out/tissue"},
        {add_surgery, "surgery --quick --out out/surgery"},
        {add_advise,
         "advise --surface liver.stl --scale 0.001 --material liver --rate-hz 20 --error 0.05 --out out/liver/liver.json"},
        {add_surface, "surface --surface liver.stl --out out/liver/repaired.stl"}}},
      {"Where do random bodies come from?", {{add_draw, "draw --out out/scenes"}}}};
  return all;
}

void add_experiments(CLI::App& app, Run& run) {
  app.option_defaults()->always_capture_default();
  for (const Question& question : questions())
    for (const LabExperiment& experiment : question.experiments) {
      experiment.add(app, run);
      CLI::App* added = app.get_subcommands({}).back();
      added->group(question.asks);
      added->footer(fmt::format("Example:\n  palpate-lab {}", experiment.example));
    }
}

int list_experiments(const CLI::App& app) {
  for (const Question& question : questions()) {
    fmt::print("{}\n", question.asks);
    for (const CLI::App* experiment : app.get_subcommands({}))
      if (experiment->get_group() == question.asks)
        fmt::print("  {:<10} {}\n", experiment->get_name(), experiment->get_description());
    fmt::print("\n");
  }
  fmt::print("palpate-lab NAME --help shows its flags with their defaults, and an example.\n");
  return 0;
}

void refuse_unknown(const CLI::App& app, const char* name) {
  std::string known;
  for (const CLI::App* experiment : app.get_subcommands({})) {
    if (experiment->get_name() == name) return;
    known += (known.empty() ? "" : ", ") + experiment->get_name();
  }
  throw InputError(name, "is not an experiment of this build", "one of " + known);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"experiments on touch under latency", "palpate-lab"};
  describe_program(app, PALPATE_VERSION, "palpate-lab replay --help");
  Run run;
  add_experiments(app, run);
  app.add_subcommand("list", "name the experiments, by the question that each answers")->callback([&] {
    run = [&] { return list_experiments(app); };
  });
  return run_experiments(app, [&] {
    if (argc > 1 && *argv[1] != '-') refuse_unknown(app, argv[1]);
    app.parse(argc, argv);
    const auto chosen = app.get_subcommands();
    if (chosen.empty()) throw InputError("EXPERIMENT", "it is missing", "one that palpate-lab list names");
    set_run_record("palpate-lab", chosen.front()->get_name(), *chosen.front());
    return run();
  });
}
