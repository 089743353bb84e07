// palpate-lab tools: accuracy of force and torque on tools with a body, over the round trip, and its cost.
//
// A cell is the handling (handling.hpp) of one scene with one tool through one scheme at one round trip, with the real cores in
// virtual time, against the full model at 1 kHz with the same tool; or the pull at a fold that its jaws have closed on
// (pinching.hpp), with the force at which they pinch and the largest pull; or a task: a scene of a folder, with its own tool and
// the motion beside it. The scheme `jacobian`, of the comparison alone, is a rigid proxy with a static Jacobian (replay.hpp).
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "bench/fidelity/replay.hpp"
#include "bench/lab/cells.hpp"
#include "bench/lab/experiments.hpp"
#include "bench/lab/flags.hpp"
#include "bench/lab/tasks.hpp"
#include "bench/measure/handling.hpp"
#include "bench/measure/pinching.hpp"
#include "common/base/error.hpp"
#include "common/motion/motion.hpp"
#include "server/body/unload.hpp"
#include "server/scene/tools.hpp"

namespace palpate {
namespace {

constexpr std::array<std::string_view, kSchemeNames.size() + 1> kToolSchemeNames{"hold", "tangent", "ring",
                                                                                 "port", "hyper",   "jacobian"};
constexpr std::size_t kJacobian = kSchemeNames.size();
static_assert(kToolSchemeNames[kJacobian - 1] == kSchemeNames[kJacobian - 1]);

struct ToolCell {
  std::string scene, tool;  // at_place(), tasks.hpp; tool: of scenes/tools, empty: that of the scene, in a task
  std::size_t scheme = 0;
  double pinch = -1;  // opening to which the jaws close; below 0: the handling
  double rtt_ms = 0;
  // Results:
  double force_db = 0, force_p95 = 0, torque_db = 0, torque_p95 = 0, step_n = 0;
  double grip_db = 0, pinch_n = 0, pull_n = 0, felt_pull_n = 0;  // of jaws; the latter three of the largest pull
  double contact_s = 0;                                          // of the full model
  double frame_bytes = 0, build_ms = 0, tick_us = 0, tick_p99_us = 0;
};
using ToolCells = std::vector<ToolCell>;

CellTable<ToolCell> tool_table() {
  CellTable<ToolCell> table;
  table.parameter("scene", &ToolCell::scene)
      .parameter("tool", &ToolCell::tool)
      .parameter("scheme", &ToolCell::scheme, kToolSchemeNames)
      .parameter("pinch", &ToolCell::pinch, "{:g}")
      .parameter("rtt_ms", &ToolCell::rtt_ms, "{:g}")
      .result("force_db", &ToolCell::force_db, "{:.2f}")
      .result("force_p95", &ToolCell::force_p95, "{:.4g}")
      .result("torque_db", &ToolCell::torque_db, "{:.2f}")
      .result("torque_p95", &ToolCell::torque_p95, "{:.4g}")
      .result("step_n", &ToolCell::step_n, "{:.3g}")
      .result("grip_db", &ToolCell::grip_db, "{:.2f}")
      .result("pinch_n", &ToolCell::pinch_n, "{:.4g}")
      .result("pull_n", &ToolCell::pull_n, "{:.4g}")
      .result("felt_pull_n", &ToolCell::felt_pull_n, "{:.4g}")
      .result("contact_s", &ToolCell::contact_s, "{:.4g}")
      .result("frame_bytes", &ToolCell::frame_bytes, "{:.0f}")
      .result("build_ms", &ToolCell::build_ms, "{:.4g}")
      .result("tick_us", &ToolCell::tick_us, "{:.4g}")
      .result("tick_p99_us", &ToolCell::tick_p99_us, "{:.4g}");
  return table;
}

struct ToolFlags {
  std::string out, scenes = "scenes", tasks;
  std::vector<std::string> only, tools, schemes{"port", "hyper"};
  std::vector<double> rtt_ms{0, 50, 150}, pinch;
  int places = 0;
  CellFlags cells;
};

std::string task_of(const ToolCell& cell) { return fmt::format("{}/{}/{:g}", cell.scene, cell.tool, cell.pinch); }

/// The scenes of a folder that have a motion beside them.
std::vector<std::string> tasks_in(const std::filesystem::path& folder, const std::vector<std::string>& only) {
  std::vector<std::string> names = scenes_in(folder, only);
  std::erase_if(names, [&](const std::string& name) { return !std::filesystem::exists(folder / (name + ".csv")); });
  if (names.empty())
    throw InputError("--tasks " + folder.string(), "holds no task", "scenes, each with a motion: NAME.json and NAME.csv");
  return names;
}

ToolCells tool_cells(const ToolFlags& flags) {
  std::vector<std::size_t> schemes;
  for (const std::string& name : flags.schemes) schemes.push_back(index_from(name, kToolSchemeNames, "--schemes"));
  const auto crossed_links = [&](const ToolCells& cells) {
    return crossed(crossed(cells, &ToolCell::scheme, schemes), &ToolCell::rtt_ms, flags.rtt_ms);
  };
  if (!flags.tasks.empty()) return crossed_links(crossed(ToolCells(1), &ToolCell::scene, tasks_in(flags.tasks, flags.only)));
  std::vector<std::string> scenes;
  const std::vector<std::string> usual{"touch-cube", "touch-stiff", "organ"};
  for (const std::string& name : scenes_in(flags.scenes, flags.only.empty() ? usual : flags.only))
    for (int place = flags.places == 0 ? 0 : 1; place <= flags.places; ++place) scenes.push_back(at_place(name, place));
  std::vector<std::string> tools = flags.tools;
  if (tools.empty())
    for (const NamedTool& tool : named_tools()) tools.push_back(tool.name);
  ToolCells cells = crossed(crossed(ToolCells(1), &ToolCell::scene, scenes), &ToolCell::tool, tools);
  if (!flags.pinch.empty()) cells = crossed(cells, &ToolCell::pinch, flags.pinch);
  return crossed_links(cells);
}

void add_task(SweepTasks& tasks, const std::filesystem::path& folder, const ToolCell& cell) {
  if (tasks.contains(task_of(cell))) return;
  Scene scene = open_scene((folder / (cell.scene + ".json")).string());
  Motion motion = read_motion((folder / (cell.scene + ".csv")).string());
  tasks.emplace(task_of(cell), SweepTask{std::move(scene), std::move(motion), {}});
}

StaticJacobian proxy_of(const ToolSpec& tool) {
  double square_m2 = 0;
  for (const ToolSphere& sphere : tool.shape) square_m2 += sphere.centre.squaredNorm() / static_cast<double>(tool.shape.size());
  return {tool.contact_stiffness_n_m, std::sqrt(square_m2)};
}

void add_handling(SweepTasks& tasks, const std::string& folder, const ToolCell& cell) {
  if (tasks.contains(task_of(cell))) return;
  const auto at = cell.scene.rfind('@');
  Scene scene = open_scene((std::filesystem::path(folder) / (cell.scene.substr(0, at) + ".json")).string());
  if (scene.tool.contact != ContactKind::touch)
    throw InputError("--only " + cell.scene, "is a grasp", "a scene that a tool touches");
  const NamedTool* tool = find_tool(cell.tool);
  if (!tool) throw InputError("--tools " + cell.tool, "is not a tool of scenes/tools", list_of_tools());
  scene.tool.shape = tool->shape;
  const ExaminedPlace place =
      at == std::string::npos ? top_of(scene) : drawn_places(scene, std::stoi(cell.scene.substr(at + 1))).back();
  if (cell.pinch >= 0 && !has_jaws(scene.tool.shape))
    throw InputError("--pinch with --tools " + cell.tool, "the tool has no jaws", "a tool of scenes/tools that has");
  Motion motion = cell.pinch >= 0 ? pinching(place, cell.pinch) : handling(place);
  tasks.emplace(task_of(cell), SweepTask{std::move(scene), std::move(motion), {}});
}

/// Returns the force of each face that gives the grip, if it acts halfway along the jaws [N].
double pinch_of(const ToolShape& shape, double grip) {
  double levers = 0;
  for (const ToolSphere& sphere : shape) levers += std::abs(sphere.swing_rad) * (sphere.hinge_m - sphere.centre.z());
  const auto on_one = std::ranges::count_if(shape, [](const ToolSphere& sphere) { return sphere.swing_rad > 0; });
  return grip / (levers / static_cast<double>(on_one));
}

/// Sets what the jaws do while they pull.
void measure_pull(ToolCell& cell, const SweepTask& task, const ReplayResult& result) {
  const Vec3 out = (task.motion.position(kPullEndsS) - task.motion.position(kPullBeginsS)).normalized();
  for (auto i = static_cast<std::size_t>(1e3 * kPullBeginsS); i < static_cast<std::size_t>(1e3 * kPullEndsS); ++i) {
    const ReplayTick& tick = result.ticks[i];
    cell.felt_pull_n = std::max(cell.felt_pull_n, -tick.felt.dot(out));
    if (const double pull_n = -tick.reference.dot(out); pull_n > cell.pull_n) {
      cell.pull_n = pull_n;
      cell.pinch_n = pinch_of(task.scene.tool.shape, tick.reference_grip);
    }
  }
}

void measure_tool(ToolCell& cell, const SweepTask& task) {
  ReplayOptions options;
  options.scheme = cell.scheme == kJacobian ? Scheme::hold : static_cast<Scheme>(cell.scheme);
  if (cell.scheme == kJacobian) options.jacobian = proxy_of(task.scene.tool);
  options.link.latency = from_seconds(cell.rtt_ms * 0.5e-3);
  options.references = {&task.reference, 1};
  const ReplayResult result = replay(task.scene, task.motion, options, processor_ns);
  cell.contact_s = 1e-3 * static_cast<double>(result.fidelity.contact_ticks);
  cell.force_db = result.fidelity.snr_db;
  cell.force_p95 = result.fidelity.p95_rel_error;
  cell.torque_db = result.torque.snr_db;
  cell.torque_p95 = result.torque.p95_rel_error;
  cell.step_n = result.hand_over.max_n;
  cell.grip_db = result.grip.snr_db;
  if (cell.pinch >= 0) measure_pull(cell, task, result);
  cell.frame_bytes = result.patch_bytes_mean;
  cell.build_ms = result.patch_build_ms_mean;
  cell.tick_us = 1e-3 * result.tick_ns_p50;
  cell.tick_p99_us = 1e-3 * result.tick_ns_p99;
}

/// Returns false if some cells were never touched: they are not scored.
bool report(const ToolCells& cells) {
  fmt::print("{:<16} {:<14} {:<6} {:>4}  {:>7} {:>6}  {:>8} {:>6}  {:>8} {:>6} {:>9} {:>12}\n", "scene", "tool", "scheme", "RTT",
             "force", "p95", "torque", "p95", "largest", "patch", "patch", "tick");
  fmt::print("{:<16} {:<14} {:<6} {:>4}  {:>7} {:>6}  {:>8} {:>6}  {:>8} {:>6} {:>9} {:>12}\n", "", "", "", "ms", "dB", "%", "dB",
             "%", "step N", "bytes", "build ms", "us (99 %)");
  for (const ToolCell& c : cells) {
    if (c.contact_s == 0) continue;
    fmt::print("{:<16} {:<14} {:<6} {:>4g}  {:>7.1f} {:>6.1f}  {:>8.1f} {:>6.1f}  {:>8.2f} {:>6.0f} {:>9.2f} {:>5.1f} ({:.1f})\n",
               c.scene, c.tool.empty() ? "its own" : c.tool, kToolSchemeNames[c.scheme], c.rtt_ms, c.force_db, 100 * c.force_p95,
               c.torque_db, 100 * c.torque_p95, c.step_n, c.frame_bytes, c.build_ms, c.tick_us, c.tick_p99_us);
  }
  for (const ToolCell& c : cells)
    if (c.pinch >= 0)
      fmt::print("{} {} {} {:g} ms, closed to {:g}: a pull of {:.2f} N (felt {:.2f} N) at a pinch of {:.2f} N; grip {:.1f} dB\n",
                 c.scene, c.tool, kToolSchemeNames[c.scheme], c.rtt_ms, c.pinch, c.pull_n, c.felt_pull_n, c.pinch_n, c.grip_db);
  std::set<std::string> untouched;
  for (const ToolCell& c : cells)
    if (c.contact_s == 0) untouched.insert(fmt::format("{} {}", c.scene, c.tool));
  for (const std::string& name : untouched) fmt::print("{}: not scored, as the tool never met the body\n", name);
  return untouched.empty();
}

int run_tools(const ToolFlags& flags) {
  check_once_each("--rtt-ms", flags.rtt_ms);
  const auto out = make_output_folder(flags.out);
  SweepTasks tasks;
  CellSweep<ToolCell> sweep{tool_table(), {}};
  if (!flags.cells.merge) sweep.cells = tool_cells(flags);
  sweep.prepare = [&](ToolCells& cells, unsigned jobs) {
    for (const ToolCell& cell : cells)
      if (cell.tool.empty())
        add_task(tasks, flags.tasks, cell);
      else
        add_handling(tasks, flags.scenes, cell);
    add_references(tasks, jobs);
  };
  sweep.measure = [&](ToolCell& cell) { measure_tool(cell, tasks.at(task_of(cell))); };
  const auto cells = run_cells(sweep, flags.cells, out);
  return !cells || report(*cells) ? 0 : 1;
}

}  // namespace

void add_tools(CLI::App& app, Run& run) {
  auto flags = std::make_shared<ToolFlags>();
  CLI::App* c = app.add_subcommand("tools", "measure the error of force and torque on tools with a body, over the round trip");
  c->add_option("--scenes", flags->scenes, "folder of the scenes")->type_name("DIR")->capture_default_str();
  c->add_option("--tasks", flags->tasks,
                "instead of the handling, the scenes of this folder, each with its own tool and the motion in the .csv beside it")
      ->type_name("DIR");
  c->add_option("--only", flags->only,
                "only these scenes, by file name without .json, separated by commas; default: touch-cube, touch-stiff and organ, "
                "of tasks all")
      ->type_name("NAME")
      ->delimiter(',');
  c->add_option("--tools", flags->tools, "only these tools of scenes/tools, separated by commas")
      ->type_name("NAME")
      ->delimiter(',');
  c->add_option("--schemes", flags->schemes, "only these schemes, separated by commas")
      ->type_name("NAME")
      ->delimiter(',')
      ->capture_default_str();
  c->add_option("--rtt-ms", flags->rtt_ms, "round trips, separated by commas")
      ->type_name("MS")
      ->delimiter(',')
      ->check(CLI::Range(0.0, 2000.0))
      ->capture_default_str();
  c->add_option("--pinch", flags->pinch,
                "instead of the handling, jaws close on a fold at the top to these openings, from 0 closed to 1, and pull")
      ->type_name("OPENING")
      ->delimiter(',')
      ->check(CLI::Range(0.0, 1.0));
  c->add_option("--places", flags->places, "number of places drawn on the surface of each scene; 0: its top")
      ->type_name("N")
      ->check(CLI::Range(0, 64));
  for (const char* of_handling : {"--scenes", "--tools", "--pinch", "--places"})
    c->get_option("--tasks")->excludes(c->get_option(of_handling));
  flags->cells.add_to(*c);
  c->add_option("--out", flags->out, "folder for cells.csv")->type_name("DIR")->required();
  c->callback([flags, &run] { run = [flags] { return run_tools(*flags); }; });
}

}  // namespace palpate
