// palpate-lab draw: randomly drawn bodies as scene files for the other experiments.
#include <fmt/format.h>

#include "bench/lab/experiments.hpp"
#include "bench/measure/drawn_scene.hpp"
#include "bench/output/output.hpp"

namespace palpate {
namespace {

struct DrawFlags {
  std::string out;
  std::uint64_t first = 1, count = 16;
  bool solid = false;
};

int run_draw(const DrawFlags& flags) {
  const auto out = make_output_folder(flags.out);
  for (std::uint64_t k = 0; k < flags.count; ++k) {
    const DrawnScene scene = drawn_scene(flags.first + k, flags.solid);
    const auto file = out / (scene.name + ".json");
    write_text(file, scene.json);
    fmt::print("{}\n", file.string());
  }
  return 0;
}

}  // namespace

void add_draw(CLI::App& app, Run& run) {
  auto flags = std::make_shared<DrawFlags>();
  CLI::App* c = app.add_subcommand("draw", "draw random scenes for `accuracy --scenes`; a number always gives the same scene");
  c->add_option("--first", flags->first, "number of the first scene; even ones are grasped, odd ones touched")
      ->capture_default_str();
  c->add_option("--count", flags->count, "number of scenes")->capture_default_str()->check(number_from(1, 10'000));
  c->add_flag("--solid", flags->solid, "use finite elements instead of springs");
  c->add_option("--out", flags->out, "folder for the scene files")->type_name("DIR")->required();
  c->callback([flags, &run] { run = [flags] { return run_draw(*flags); }; });
}

}  // namespace palpate
