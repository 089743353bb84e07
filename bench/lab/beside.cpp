// palpate-lab beside: the cost of one hand for another on the same body when one of them is far away.
//
// Each row is two runs of the same two motions: both hands over the link of the first, and the second over a worse one. The
// effect of the far hand on the near one is the difference between the near one's figures in the two runs; the effect of the near
// hand on the far one is the difference to a run of two equally far hands.
#include <fmt/format.h>

#include <iterator>

#include "bench/fidelity/replay.hpp"
#include "bench/lab/experiments.hpp"
#include "bench/lab/flags.hpp"
#include "bench/lab/parallel.hpp"
#include "bench/measure/tools_apart.hpp"
#include "bench/output/output.hpp"
#include "common/base/error.hpp"
#include "common/command_line/mesh_folders.hpp"
#include "server/body/unload.hpp"

namespace palpate {
namespace {

struct BesideFlags {
  std::string scene, out;
  MeshFolders mesh_folders;
  double near_rtt_ms = 15, apart_mm = 30, duration_s = 4;
  std::uint64_t seed = 1;
};

struct Far {
  double rtt_ms = 0, jitter_ms = 0, loss_pct = 0;
};
constexpr Far kFar[] = {{15, 20, 0}, {60, 0, 0}, {150, 0, 0}, {150, 20, 0}, {150, 20, 5}, {300, 20, 5}};

LinkSpec link_of(const Far& far, std::uint64_t seed) {
  return {.latency = from_seconds(far.rtt_ms * 0.5e-3),
          .jitter = from_seconds(far.jitter_ms * 1e-3),
          .loss = far.loss_pct / 100,
          .seed = seed};
}

struct Pair {
  double snr_db[2] = {}, age_p95_ms[2] = {}, late_pct[2] = {};
};

Pair run_pair(const Scene& scene, const std::vector<Motion>& motions, const LinkSpec& first, const LinkSpec& second) {
  ReplayOptions options;
  options.links = {first, second};
  const std::vector<ReplayResult> results = replay_together(scene, motions, options, [] { return std::int64_t{0}; });
  Pair pair;
  for (std::size_t k = 0; k < 2; ++k) {
    pair.snr_db[k] = results[k].fidelity.snr_db;
    pair.age_p95_ms[k] = 1e3 * seconds(results[k].age_p95);
    pair.late_pct[k] = 100 * results[k].late_share;
  }
  return pair;
}

/// Runs both hands near; then, for each of kFar, both far and one of each.
std::vector<Pair> run_pairs(const Scene& scene, const std::vector<Motion>& motions, const BesideFlags& flags) {
  const LinkSpec near = link_of({flags.near_rtt_ms, 0, 0}, flags.seed);
  std::vector<Pair> pairs(1 + 2 * std::size(kFar));
  run_all(
      pairs.size(),
      [&](std::size_t k) {
        const LinkSpec far = k == 0 ? near : link_of(kFar[(k - 1) / 2], flags.seed);
        pairs[k] = run_pair(scene, motions, k % 2 == 0 ? near : far, far);
      },
      0, "the pairs of hands");
  return pairs;
}

int run_beside(const BesideFlags& flags) {
  const Scene scene = open_scene(flags.scene, flags.mesh_folders);
  if (scene.tool.contact != ContactKind::touch)
    throw InputError(flags.scene, "has tools that attach to one node", "a scene with \"contact\": \"touch\"");
  const std::vector<Motion> motions = tools_apart(scene, 2, flags.apart_mm * 1e-3, flags.duration_s);
  const auto out = make_output_folder(flags.out);
  const std::vector<Pair> pairs = run_pairs(scene, motions, flags);
  const Pair& both_near = pairs[0];
  std::string csv =
      "far_rtt_ms,far_jitter_ms,far_loss_pct,near_alike_db,near_db,near_age_ms,near_late_pct,far_alike_db,far_db,far_age_alike_"
      "ms,"
      "far_age_ms,far_late_pct\n";
  fmt::print("{:>23} {:>28} {:>36}\n", "far hand", "near hand (RTT " + fmt::format("{:g} ms)", flags.near_rtt_ms), "far hand");
  fmt::print("{:>8} {:>6} {:>7} {:>10} {:>6} {:>10} {:>10} {:>6} {:>10} {:>7}\n", "RTT [ms]", "jitter", "loss [%]", "alike [dB]",
             "[dB]", "p95 age", "alike [dB]", "[dB]", "p95 age", "late");
  for (std::size_t k = 0; k < std::size(kFar); ++k) {
    const Far& far = kFar[k];
    const Pair &both_far = pairs[2 * k + 1], &mixed = pairs[2 * k + 2];
    fmt::print("{:>8g} {:>6g} {:>7g} {:>10.1f} {:>6.1f} {:>7.0f} ms {:>10.1f} {:>6.1f} {:>7.0f} ms {:>5.1f} %\n", far.rtt_ms,
               far.jitter_ms, far.loss_pct, both_near.snr_db[0], mixed.snr_db[0], mixed.age_p95_ms[0], both_far.snr_db[1],
               mixed.snr_db[1], mixed.age_p95_ms[1], mixed.late_pct[1]);
    fmt::format_to(std::back_inserter(csv), "{:g},{:g},{:g},{:.2f},{:.2f},{:.1f},{:.2f},{:.2f},{:.2f},{:.1f},{:.1f},{:.2f}\n",
                   far.rtt_ms, far.jitter_ms, far.loss_pct, both_near.snr_db[0], mixed.snr_db[0], mixed.age_p95_ms[0],
                   mixed.late_pct[0], both_far.snr_db[1], mixed.snr_db[1], both_far.age_p95_ms[1], mixed.age_p95_ms[1],
                   mixed.late_pct[1]);
  }
  write_text(out / "beside.csv", csv);
  fmt::print("\n  alike: with both hands over that link. late: samples that came when the body had gone past them.\n{}\n",
             (out / "beside.csv").string());
  return 0;
}

}  // namespace

void add_beside(CLI::App& app, Run& run) {
  auto flags = std::make_shared<BesideFlags>();
  CLI::App* c = app.add_subcommand("beside", "a near and a far hand on one body: what each loses by the other's link");
  c->add_option("--scene", flags->scene, "scene file (JSON) with touch contact")->type_name("FILE")->required();
  add_mesh_folders(*c, flags->mesh_folders);
  c->add_option("--near-rtt-ms", flags->near_rtt_ms, "round trip of the near hand")->check(number_from<double>(0, 10'000));
  c->add_option("--apart-mm", flags->apart_mm, "distance between the hands")->check(number_from<double>(0, 1000));
  c->add_option("--duration-s", flags->duration_s, "length of the motions")->check(number_from<double>(0.5, 600));
  c->add_option("--out", flags->out, "folder for beside.csv")->type_name("DIR")->required();
  c->callback([flags, &run] { run = [flags] { return run_beside(*flags); }; });
}

}  // namespace palpate
