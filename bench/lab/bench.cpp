// palpate-lab bench: runs the microbenchmarks, a program of its own (palpate-bench in the same folder), with results like those
// of any experiment.
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "bench/lab/experiments.hpp"
#include "bench/output/output.hpp"
#include "common/base/error.hpp"

namespace palpate {
namespace {

struct BenchFlags {
  std::string filter, scenes = "scenes", out;
};

/// Returns only if the program cannot be started.
int run_bench(const BenchFlags& flags) {
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "palpate-bench";
  std::vector<std::string> arguments{program.string(), "--scenes", flags.scenes,
                                     "--benchmark_out=" + (make_output_folder(flags.out) / "micro.json").string(),
                                     "--benchmark_out_format=json"};
  if (!flags.filter.empty()) arguments.push_back("--benchmark_filter=" + flags.filter);
  std::vector<char*> raw;
  for (std::string& argument : arguments) raw.push_back(argument.data());
  raw.push_back(nullptr);
  ::execv(program.c_str(), raw.data());
  throw InputError(program.string(), fmt::format("cannot be started: {}", std::strerror(errno)),
                   "palpate-bench beside palpate-lab");
}

}  // namespace

void add_bench(CLI::App& app, Run& run) {
  auto flags = std::make_shared<BenchFlags>();
  CLI::App* c =
      app.add_subcommand("bench", "microbenchmarks of kernels, solves, reduction, codec and tick, beside the machine's limit");
  c->add_option("--filter", flags->filter, "only these, for example tick/, patch/, body/, frame/organ")->type_name("TEXT");
  c->add_option("--scenes", flags->scenes, "folder of the scenes")->type_name("DIR")->capture_default_str();
  c->add_option("--out", flags->out, "folder for micro.json")->type_name("DIR")->required();
  c->callback([flags, &run] { run = [flags] { return run_bench(*flags); }; });
}

}  // namespace palpate
