// palpate-bench: cost of each part, compared with the peak performance of this machine. bench/README.md explains the output.
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <cstdio>
#include <exception>
#include <optional>
#include <string_view>

#include "bench/micro/benchmarks.hpp"
#include "bench/micro/fixtures.hpp"
#include "bench/micro/machine.hpp"
#include "common/base/error.hpp"

namespace {

constexpr std::string_view kUsage = R"(palpate-bench: what each part of Palpate costs on this machine

usage: palpate-bench [--scenes DIR] [--benchmark_...]

  --scenes DIR                  folder of the scenes and motions (default: scenes)
  --benchmark_filter=REGEX      only these, for example tick/, patch/, body/, frame/organ, cut/, trust/
  --benchmark_list_tests        name them
  --benchmark_out=FILE          results as JSON, with the machine's description (--benchmark_out_format=csv for a table)
  --benchmark_repetitions=N     repeat; means, medians and deviations are added
  --benchmark_min_time=SECONDS  of each timed loop
  --help, --version
)";

int complain(const std::string& what) {
  std::fprintf(stderr, "palpate-bench: %s\n", what.c_str());
  return 2;
}

/// Returns the exit status for arguments that end the program at once.
std::optional<int> read_arguments(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument == "--help") return std::fwrite(kUsage.data(), 1, kUsage.size(), stdout) == kUsage.size() ? 0 : 1;
    if (argument == "--version") return std::puts("palpate-bench " PALPATE_VERSION) < 0 ? 1 : 0;
    if (argument != "--scenes") return complain("unknown argument " + std::string(argument) + "; see palpate-bench --help");
    if (++i == argc) return complain("--scenes: no value; expected a folder");
    palpate::set_scene_folder(argv[i]);
  }
  return std::nullopt;
}

int run_all() {
  using palpate::machine;
  palpate::add_tick_benchmarks();
  palpate::add_patch_benchmarks();
  palpate::add_body_benchmarks();
  palpate::add_frame_benchmarks();
  palpate::add_cut_benchmarks();
  palpate::add_trust_benchmarks();
  benchmark::AddCustomContext("peak_gflops", std::to_string(machine().peak_gflops));
  benchmark::AddCustomContext("triad_cache_gb_s", std::to_string(machine().near_gb_s));
  benchmark::AddCustomContext("triad_memory_gb_s", std::to_string(machine().far_gb_s));
  using Console = benchmark::ConsoleReporter;
  Console table(isatty(STDOUT_FILENO) ? Console::OO_ColorTabular : Console::OO_Tabular);
  benchmark::RunSpecifiedBenchmarks(&table);
  benchmark::Shutdown();
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  for (int i = 1; i < argc; ++i)
    if (std::string_view(argv[i]) == "--help") return *read_arguments(argc, argv);
  benchmark::Initialize(&argc, argv);
  if (const auto code = read_arguments(argc, argv)) return *code;
  try {
    return run_all();
  } catch (const palpate::InputError& e) {
    return complain(e.what());
  } catch (const std::exception& e) {
    std::fprintf(stderr, "palpate-bench: %s\n", e.what());
    return 1;
  }
}
