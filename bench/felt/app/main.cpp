// palpate-fidelity: the experiment `felt` of palpate-lab by itself, so that the others need not be compiled.
#include <fmt/format.h>

#include "bench/felt/felt.hpp"
#include "bench/output/run_record.hpp"

int main(int argc, char** argv) {
  using namespace palpate;
  CLI::App app{kFeltText, "palpate-fidelity"};
  describe_program(app, PALPATE_VERSION, fmt::format("palpate-fidelity {}", kFeltExample));
  app.option_defaults()->always_capture_default();
  Run run;
  add_felt_flags(app, run);
  return run_experiments(app, [&] {
    app.parse(argc, argv);
    set_run_record("palpate-fidelity", "felt", app);
    return run();
  });
}
