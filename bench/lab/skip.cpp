// palpate-lab skip: computing time saved by skipping unneeded work, and its effect on the felt force.
#include <fmt/format.h>

#include <iterator>
#include <optional>

#include "bench/fidelity/metrics.hpp"
#include "bench/lab/experiments.hpp"
#include "bench/lab/flags.hpp"
#include "bench/lab/skip_idle.hpp"
#include "bench/measure/skip.hpp"
#include "bench/output/output.hpp"
#include "bench/output/progress.hpp"
#include "common/base/error.hpp"
#include "common/base/limits.hpp"
#include "server/body/unload.hpp"
#include "server/scene/scene.hpp"

namespace palpate {
namespace {

/// Largest allowed effect of any skipped work on the felt force: a fifth of the step at a hand-over that is not felt
/// (haptic_tick.hpp).
constexpr double kFeltBoundN = 0.01;
constexpr double kIdleShare = 0.005;

struct SkipFlags {
  std::string scenes = "scenes", out;
  std::vector<std::string> names = {"touch-cube", "organ-buckling", "cube6"};
  double deadband = kForceJnd;
  int rooms = 16;
  double wait_s = 5;
};

/// One kind of skipped work, compared with the same touch without skipping.
struct SkipRow {
  std::string scene, what;
  SkipCost with, without;
  double deadband = 0;  ///< set if the deadband skips the work
};

using Rooms = std::vector<SkipRoom>;

SkipCost cost(const Rooms& rooms, double deadband = 0) { return serve(rooms, kVisitS, processor_ns, deadband); }

/// Adds rows in which patches are not sent if their change cannot be felt.
void add_deadband(const std::string& name, const Scene& scene, double deadband, std::vector<SkipRow>& rows) {
  std::vector<std::pair<std::string, Motion>> hands{{"touches", visit(scene)}, {"presses and holds", hold_pressed(scene)}};
  if (scene.tool.contact == ContactKind::touch) hands.emplace_back("lingers", linger(scene));
  for (const auto& [does, hand] : hands) {
    const Rooms room{{&scene, &hand}};
    rows.push_back({name, "hand " + does + ": only patches that are felt", cost(room, deadband), cost(room), deadband});
  }
}

void add_scene(const std::string& name, const Scene& scene, double deadband, std::vector<SkipRow>& rows) {
  const Motion hand = visit(scene);
  const SkipCost touch = cost({{&scene, &hand}}), stepped = cost({{&scene, &hand, false, false}});
  if (deadband > 0) add_deadband(name, scene, deadband, rows);
  rows.push_back({name, "nobody there: no frame", cost({{&scene}}), cost({{&scene, nullptr, false, false}})});
  rows.push_back({name, "body at rest: no step", touch, stepped});
  rows.push_back({name, "no viewer: no shapes", touch, cost({{&scene, &hand, true}})});
  if (scene.tool.contact == ContactKind::touch) {
    constexpr double kCloseM = 0.002;
    const Motion away = wait_above(scene, kAwayM), near = wait_above(scene, kCloseM), lingering = linger(scene);
    rows.push_back(
        {name, "out of reach: no patch", cost({{&scene, &away, false, false}}), cost({{&scene, &near, false, false}})});
    rows.push_back(
        {name, "hand lingers: the same patch again", cost({{&scene, &lingering}}), cost({{&scene, &lingering, false, false}})});
  }
  if (scene.body.law != SpringLaw::linear || scene.body.elements.empty()) return;
  Scene general = scene;
  general.body.law = SpringLaw::stiffening;
  general.body.stiffening = 0;
  rows.push_back({name, "linear springs: no stiffening", stepped, cost({{&general, &hand, false, false}})});
}

/// A wide sheet of tissue on a table under a pressing, trembling hand: most of it rests. 55,296 nodes.
Scene wide_scene() {
  return read_scene(R"({ "name": "wide", "body": { "lattice": { "nodes": [96, 96, 6], "size_m": [0.475, 0.475, 0.025],
    "density_kg_m3": 1000, "stiffness_n_m": 10, "damping_n_s_m": 0.04, "fixed_faces": ["z-"] } },
    "tool": { "contact": "touch", "radius_m": 0.01, "mu": 0.3 } })",
                    "wide sheet");
}

void add_wide(std::vector<SkipRow>& rows) {
  const Scene scene = wide_scene();
  const Motion hand = hold_pressed(scene);
  rows.push_back({scene.name, "regions at rest: no forces", cost({{&scene, &hand}}), cost({{&scene, &hand, false, false}})});
}

/// Adds `count` rooms of which one is touched; the others are empty, or have a waiting hand. Returns the cost of the one alone.
SkipCost add_rooms(const std::string& name, const Scene& scene, int count, std::vector<SkipRow>& rows) {
  const Motion hand = visit(scene), away = wait_above(scene, kAwayM);
  for (const Motion* other : {static_cast<const Motion*>(nullptr), &away}) {
    Rooms sleeping(static_cast<std::size_t>(count), {&scene, other}), stepped(sleeping.size(), {&scene, other, false, false});
    sleeping[0].hand = stepped[0].hand = &hand;
    rows.push_back({name, fmt::format("{} rooms, 1 touched, {}", count, other ? "1 hand each" : "others empty"), cost(sleeping),
                    cost(stepped)});
  }
  return cost({{&scene, &hand}});
}

const char* kHead =
    "scene,what,busy_ms_s,busy_ms_s_without,wake_ups_s,wake_ups_s_without,stepped_s,stepped_s_without,bytes_s,"
    "bytes_s_without,patches_s,patches_s_without,felt_difference_n,felt_difference_share,deadband\n";

/// Largest differences of the felt force.
struct Felt {
  double left_out_n = 0;     ///< due to skipped computations [N]
  double over_deadband = 0;  ///< due to unsent patches, over their allowed share
};

/// Prints the table and fills CSV and summary.
Felt report(const std::vector<SkipRow>& rows, std::string& csv, Json& summary) {
  Felt felt;
  csv = kHead;
  fmt::print("{:<12} {:<42} {:>10} {:>10} {:>8} {:>8} {:>8} {:>9} {:>9} {:>7}\n", "scene", "left out", "ms/s", "else ms/s",
             "saved %", "kB/s", "else", "patches/s", "felt, mN", "%");
  for (const SkipRow& r : rows) {
    const double difference_n = felt_difference_n(r.with, r.without), share = felt_difference_share(r.with, r.without);
    const double saved = 1 - r.with.busy_ms_s / std::max(r.without.busy_ms_s, 1e-9);
    if (r.deadband > 0)
      felt.over_deadband = std::max(felt.over_deadband, share / r.deadband);
    else
      felt.left_out_n = std::max(felt.left_out_n, difference_n);
    fmt::print("{:<12} {:<42} {:>10.3f} {:>10.3f} {:>8.1f} {:>8.2f} {:>8.2f} {:>9.2f} {:>9.3f} {:>7.3f}\n", r.scene, r.what,
               r.with.busy_ms_s, r.without.busy_ms_s, 100 * saved, 1e-3 * r.with.bytes_s, 1e-3 * r.without.bytes_s,
               r.with.patches_s, 1e3 * difference_n, 100 * share);
    fmt::format_to(std::back_inserter(csv),
                   "{},\"{}\",{:.4f},{:.4f},{:.2f},{:.2f},{:.2f},{:.2f},{:.0f},{:.0f},{:.2f},{:.2f},{:.3g},{:.3g},{:g}\n",
                   r.scene, r.what, r.with.busy_ms_s, r.without.busy_ms_s, r.with.wake_ups_s, r.without.wake_ups_s,
                   r.with.stepped_s, r.without.stepped_s, r.with.bytes_s, r.without.bytes_s, r.with.patches_s,
                   r.without.patches_s, difference_n, share, r.deadband);
    summary["left_out"].push_back({{"scene", r.scene},
                                   {"what", r.what},
                                   {"busy_ms_s", r.with.busy_ms_s},
                                   {"busy_ms_s_without", r.without.busy_ms_s},
                                   {"saved_share", saved},
                                   {"bytes_s", r.with.bytes_s},
                                   {"bytes_s_without", r.without.bytes_s},
                                   {"patches_s", r.with.patches_s},
                                   {"patches_s_without", r.without.patches_s},
                                   {"felt_difference_n", difference_n},
                                   {"felt_difference_share", share},
                                   {"deadband", r.deadband}});
  }
  return felt;
}

int run_skip(const SkipFlags& flags) {
  const auto out = make_output_folder(flags.out);
  std::vector<SkipRow> rows;
  std::vector<std::filesystem::path> files;
  std::optional<Steps> steps(std::in_place, flags.names.size() + 3);
  for (const std::string& name : flags.names) {
    steps->begin("touches of " + name + ", with and without");
    files.push_back(std::filesystem::path(flags.scenes) / (name + ".json"));
    add_scene(name, open_scene(files.back()), flags.deadband, rows);
  }
  const Scene first = open_scene(files.front());
  steps->begin("a wide sheet of which most rests");
  add_wide(rows);
  steps->begin(fmt::format("{} rooms", flags.rooms));
  const SkipCost alone = add_rooms(flags.names.front(), first, flags.rooms, rows);
  const double ratio = rows[rows.size() - 2].with.busy_ms_s / alone.busy_ms_s,
               waiting = rows.back().with.busy_ms_s / alone.busy_ms_s;
  steps->begin("a server where nobody is");
  const IdleCost idle = idle_server(files, flags.wait_s);
  steps.reset();
  std::string csv;
  Json summary;
  const Felt felt = report(rows, csv, summary);
  summary["rooms"] = {{"count", flags.rooms}, {"cost_of_one", ratio}, {"cost_of_one_with_a_hand_in_each", waiting}};
  summary["idle_server"] = {{"rooms", files.size()}, {"core_share", idle.core_share}, {"wake_ups_s", idle.wake_ups_s}};
  summary["felt_difference_max_n"] = felt.left_out_n;
  summary["felt_bound_n"] = kFeltBoundN;
  summary["felt_over_deadband"] = felt.over_deadband;
  fmt::print("{} rooms of which one is touched cost {:.2f} times what that one costs; {:.2f} times with a hand waiting in each\n",
             flags.rooms, ratio, waiting);
  fmt::print("palpate-server with {} rooms and nobody there: {:.3f} % of a core, {:.1f} wake-ups a second (bound {:g} %)\n",
             files.size(), 100 * idle.core_share, idle.wake_ups_s, 100 * kIdleShare);
  if (flags.deadband > 0)
    fmt::print("of patches that were not sent {:.2f} % of the force was felt (bound {:g} %)\n",
               100 * felt.over_deadband * flags.deadband, 100 * flags.deadband);
  fmt::print("of the rest {:.2f} mN at most (bound {:g} mN)\n{}\n", 1e3 * felt.left_out_n, 1e3 * kFeltBoundN,
             (out / "summary.json").string());
  write_text(out / "skip.csv", csv);
  write_json(out / "summary.json", summary);
  return felt.left_out_n <= kFeltBoundN && felt.over_deadband <= 1 && idle.core_share <= kIdleShare ? 0 : 1;
}

}  // namespace

void add_skip(CLI::App& app, Run& run) {
  auto flags = std::make_shared<SkipFlags>();
  CLI::App* c =
      app.add_subcommand("skip", "what is not computed where a scene does not need it: what that saves, and is felt of it");
  c->add_option("--scenes", flags->scenes, "folder of the scenes")->type_name("DIR")->capture_default_str();
  c->add_option("--scene", flags->names, "names of scenes in it; the first fills the rooms")
      ->type_name("FILE")
      ->capture_default_str();
  c->add_option("--rooms", flags->rooms, "of which one is touched")->check(number_from(2, 64))->capture_default_str();
  c->add_option("--deadband", flags->deadband,
                "share of the force by which patches may be wrong in the rows that try it, 0: none")
      ->check(number_from<double>(0, kMaxDeadband))
      ->capture_default_str();
  c->add_option("--wait-s", flags->wait_s, "how long the idle server is watched, in real time")
      ->check(number_from<double>(1, 600))
      ->capture_default_str();
  c->add_option("--out", flags->out, "folder for skip.csv and summary.json")->type_name("DIR")->required();
  c->callback([flags, &run] { run = [flags] { return run_skip(*flags); }; });
}

}  // namespace palpate
