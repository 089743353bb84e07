// palpate-lab world: simulated worlds drawn from seeds, run under checks.
#include <fmt/format.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <iterator>
#include <map>
#include <mutex>
#include <set>
#include <thread>

#include "bench/lab/experiments.hpp"
#include "bench/lab/flags.hpp"
#include "bench/output/output.hpp"
#include "bench/output/plot.hpp"
#include "bench/world/attacked.hpp"
#include "common/base/error.hpp"
#include "common/base/limits.hpp"

namespace palpate {
namespace {

struct WorldFlags {
  DrawOptions draw;
  std::uint64_t seeds = 1;
  double for_s = 0;
  int jobs = 0;
  bool no_faults = false, no_drift = false, no_losses = false, adversary = false, quiet = false;
  std::string out;
};

/// Command that repeats one seed of this call.
std::string command(const WorldFlags& f, std::uint64_t seed) {
  std::string line = fmt::format("palpate-lab world --seed {}", seed);
  if (f.draw.duration_s != DrawOptions{}.duration_s) line += fmt::format(" --duration-s {:g}", f.draw.duration_s);
  if (f.draw.stations_max != DrawOptions{}.stations_max) line += fmt::format(" --stations {}", f.draw.stations_max);
  if (f.draw.deadband > 0) line += fmt::format(" --deadband {:g}", f.draw.deadband);
  for (const auto& [off, flag] : {std::pair{f.draw.small, " --small"},
                                  {f.no_faults, " --no-faults"},
                                  {f.no_drift, " --no-drift"},
                                  {f.no_losses, " --no-losses"},
                                  {f.adversary, " --adversary"}})
    if (off) line += flag;
  return line;
}

std::string say(const WorldFlags& flags, std::uint64_t seed, const WorldReport& r) {
  std::string text = fmt::format(
      "seed {}: {} ticks, {} patches used, oldest {} ms, energy at least {:.2f} mJ, hash {:016x}: {}\n", seed, r.ticks,
      r.patches_used, r.oldest_calm / Micros{1000}, 1e3 * r.energy_lowest_j, r.hash, r.violations.empty() ? "good" : "FAILED");
  for (const Violation& v : r.violations) text += fmt::format("  {:.6f} s  {}: {}\n", seconds(v.at), v.check, v.what);
  if (!r.violations.empty()) text += "  again: " + command(flags, seed) + "\n";
  return text;
}

WorldReport run_seed(const WorldFlags& flags, const Scenario& scenario) {
  RunOptions options;
  options.keep_rows = !flags.out.empty();
  return flags.adversary ? run_attacked(scenario.drawn_with, options.keep_rows) : run_twice(scenario, options);
}

/// Seeds to run, handed out to threads until there are no more or the time is up.
class Work {
 public:
  explicit Work(const WorldFlags& flags) : flags_(flags), next_(flags.draw.seed) {
    if (flags.for_s > 0)
      until_ = std::chrono::steady_clock::now() +
               std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(flags.for_s));
  }
  void run() {
    const auto jobs = flags_.jobs > 0 ? static_cast<unsigned>(flags_.jobs) : std::max(1u, std::thread::hardware_concurrency());
    std::vector<std::jthread> threads;
    for (unsigned k = 1; k < std::min<std::uint64_t>(jobs, flags_.for_s > 0 ? jobs : flags_.seeds); ++k)
      threads.emplace_back([this] { work(); });
    work();
  }
  std::uint64_t done() const { return done_; }
  const std::vector<std::uint64_t>& failed() const { return failed_; }
  double energy_lowest_j() const { return energy_lowest_j_; }
  /// Summary of the faults by number of worlds, and of the judgements.
  std::string exercised() const {
    std::string text = "  worlds with";
    for (std::size_t k = 0; k < kFaultKinds; ++k)
      text += fmt::format("{} {}: {}", k > 0 ? "," : "", describe(static_cast<FaultKind>(k)), faults_[k]);
    text += "\n  judged";
    const char* comma = "";
    for (const auto& [check, times] : judged_) {
      text += fmt::format("{} {} {} times in {} worlds", comma, check, times.first, times.second);
      comma = ",";
    }
    return text + "\n";
  }
  double virtual_s() const { return virtual_s_; }
  void check_error() const {
    if (error_) std::rethrow_exception(error_);
  }

 private:
  bool more(std::uint64_t seed) const {
    if (error_seen_) return false;
    if (flags_.for_s > 0) return std::chrono::steady_clock::now() < until_;
    return seed - flags_.draw.seed < flags_.seeds;
  }
  void work() try {
    for (std::uint64_t seed = next_++; more(seed); seed = next_++) {
      DrawOptions draw = flags_.draw;
      draw.seed = seed;
      const Scenario scenario = draw_scenario(draw);
      const WorldReport report = run_seed(flags_, scenario);
      const std::lock_guard lock(mutex_);
      ++done_;
      virtual_s_ += seconds(scenario.end);
      energy_lowest_j_ = std::min(energy_lowest_j_, report.energy_lowest_j);
      count(scenario, report);
      if (!report.violations.empty()) failed_.push_back(seed);
      if (!report.violations.empty() || !flags_.quiet) fmt::print("{}", say(flags_, seed, report));
      std::fflush(stdout);
    }
  } catch (...) {
    const std::lock_guard lock(mutex_);
    error_ = std::current_exception();
    error_seen_ = true;
  }

  void count(const Scenario& scenario, const WorldReport& report) {
    std::set<FaultKind> kinds;
    for (const Fault& fault : scenario.faults) kinds.insert(fault.kind);
    for (const FaultKind kind : kinds) ++faults_[static_cast<std::size_t>(kind)];
    for (const auto& [check, times] : report.judged) {
      judged_[check].first += times;
      judged_[check].second += times > 0 ? 1 : 0;
    }
  }

  const WorldFlags& flags_;
  std::atomic<std::uint64_t> next_;
  std::atomic<bool> error_seen_ = false;
  std::chrono::steady_clock::time_point until_{};
  std::mutex mutex_;
  std::exception_ptr error_;
  std::uint64_t done_ = 0;
  double energy_lowest_j_ = 0, virtual_s_ = 0;
  std::vector<std::uint64_t> failed_;
  std::array<std::uint64_t, kFaultKinds> faults_{};
  std::map<std::string, std::pair<std::uint64_t, std::uint64_t>> judged_;  ///< times, worlds
};

void write_rows(const std::filesystem::path& out, const Scenario& s, const WorldReport& r) {
  std::vector<Panel> panels;
  for (std::size_t k = 0; k < s.stations.size(); ++k) {
    const std::string& name = s.stations[k].client.hello.station;
    std::string csv = "t_s,x_m,y_m,z_m,fx_n,fy_n,fz_n,patch_age_ms,contact\n";
    bool any = false;
    for (const FeltRow& row : r.rows) {
      if (row.station != k) continue;
      any = true;
      fmt::format_to(std::back_inserter(csv), "{:.6f},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.3f},{}\n", seconds(row.now),
                     row.position.x(), row.position.y(), row.position.z(), row.force.x(), row.force.y(), row.force.z(),
                     1e3 * seconds(row.patch_age), row.contact ? 1 : 0);
    }
    if (!any) continue;
    const auto file = out / (name + ".csv");
    write_text(file, csv);
    plot_csv(
        file, out / (name + ".svg"), fmt::format("{} in the world of seed {}", name, s.drawn_with.seed), "time [s]",
        {{"force [N]", {{"1:5", "x", 1}, {"1:6", "y", 2}, {"1:7", "z", 3}}}, {"age of the patch [ms]", {{"1:8", "in use", 1}}}});
  }
}

int run_one(const WorldFlags& flags) {
  const Scenario scenario = draw_scenario(flags.draw);
  fmt::print("{}", describe(scenario));
  const WorldReport report = run_seed(flags, scenario);
  fmt::print("{}", say(flags, flags.draw.seed, report));
  if (flags.out.empty()) return report.violations.empty() ? 0 : 1;
  const auto out = make_output_folder(flags.out);
  write_text(out / "scene.json", scenario.scene_json);
  write_text(out / "scenario.txt", describe(scenario) + say(flags, flags.draw.seed, report));
  write_rows(out, scenario, report);
  write_json(out / "summary.json", {{"seed", flags.draw.seed},
                                    {"good", report.violations.empty() ? 1 : 0},
                                    {"violations", report.violations.size()},
                                    {"ticks", report.ticks},
                                    {"datagrams", report.datagrams},
                                    {"patches_used", report.patches_used},
                                    {"patch_age_calm_max_ms", 1e3 * seconds(report.oldest_calm)},
                                    {"energy_lowest_j", report.energy_lowest_j},
                                    {"rest_error_max_n", report.apart_worst_n}});
  return report.violations.empty() ? 0 : 1;
}

int run_world(WorldFlags flags) {
  for (const auto& [flag, value] : {std::pair{"--duration-s", flags.draw.duration_s}, {"--for-s", flags.for_s}})
    if (std::isnan(value)) throw InputError(flag, "is nan", "a number of seconds");
  flags.draw.faults = !flags.no_faults;
  flags.draw.drift = !flags.no_drift;
  flags.draw.losses = !flags.no_losses;
  flags.draw.keys = flags.adversary;
  if (flags.seeds == 1 && flags.for_s <= 0) return run_one(flags);
  Work work(flags);
  work.run();
  work.check_error();
  fmt::print("{} worlds, {:.0f} s of their time, energy at least {:.2f} mJ, {} failed\n", work.done(), work.virtual_s(),
             1e3 * work.energy_lowest_j(), work.failed().size());
  fmt::print("{}", work.exercised());
  for (const std::uint64_t seed : work.failed()) fmt::print("  {}\n", command(flags, seed));
  return work.failed().empty() ? 0 : 1;
}

}  // namespace

void add_world(CLI::App& app, Run& run) {
  auto flags = std::make_shared<WorldFlags>();
  CLI::App* c = app.add_subcommand("world", "run simulated worlds, drawn from seeds with faults, under checks");
  c->add_option("--seed", flags->draw.seed, "seed of everything that is drawn; the first of several")->check(whole_number());
  c->add_option("--seeds", flags->seeds, "number of seeds, from --seed on")->check(number_from(1, 1'000'000'000));
  c->add_option("--for-s", flags->for_s, "run as many seeds as fit into this time")->check(number_from(0.0, 1e7));
  c->add_option("--duration-s", flags->draw.duration_s, "world time until everything is healed")
      ->check(number_from(1.5, 600.0))
      ->capture_default_str();
  c->add_option("--deadband", flags->draw.deadband, "share of the force below which servers send no change; not drawn")
      ->check(number_from<double>(0, kMaxDeadband))
      ->capture_default_str();
  c->add_option("--stations", flags->draw.stations_max, "largest number of stations")
      ->check(number_from(1, 16))
      ->capture_default_str();
  c->add_flag("--small", flags->draw.small, "use bodies of 27 nodes and sheets of 9");
  c->add_option("--jobs", flags->jobs, "number of threads, 0: one per core")->check(number_from(0, 1024));
  c->add_flag("--no-faults", flags->no_faults, "leave the faults out");
  c->add_flag("--no-drift", flags->no_drift, "use clocks that do not drift");
  c->add_flag("--no-losses", flags->no_losses, "use links that lose, duplicate and reorder nothing by themselves");
  c->add_flag("--adversary", flags->adversary,
              "use the trust channel, with an attacker on the path of all datagrams that must not change the forces");
  c->add_flag("--quiet", flags->quiet, "print only seeds that fail");
  c->add_option("--out", flags->out, "folder for the scenario and forces of a single seed")->type_name("DIR");
  c->callback([flags, &run] { run = [flags] { return run_world(*flags); }; });
}

}  // namespace palpate
