// palpate-fidelity: the experiment `fidelity` of palpate-lab as a program of its own, for machines without the others.
#include <fmt/format.h>

#include "bench/output/run_record.hpp"
#include "bench/report/fidelity_report.hpp"

int main(int argc, char** argv) {
  using namespace palpate;
  CLI::App app{kFidelityText, "palpate-fidelity"};
  describe_program(app, PALPATE_VERSION, fmt::format("palpate-fidelity {}", kFidelityExample));
  app.option_defaults()->always_capture_default();
  Run run;
  add_fidelity_flags(app, run);
  return run_experiments(app, [&] {
    app.parse(argc, argv);
    set_run_record("palpate-fidelity", "fidelity", app);
    return run();
  });
}
