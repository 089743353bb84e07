// palpate-lab settle: equilibrium of a body under gravity, one row per node, for comparison with other programs.
#include "server/body/settle.hpp"

#include <fmt/format.h>

#include <iterator>

#include "bench/lab/experiments.hpp"
#include "bench/output/output.hpp"
#include "common/base/error.hpp"
#include "server/body/unload.hpp"

namespace palpate {
namespace {

struct SettleFlags {
  std::string scene, out;
};

std::string csv_of_nodes(const LumpedBody& body, const Vector& x) {
  std::string csv = "rest_x_m,rest_y_m,rest_z_m,x_m,y_m,z_m\n";
  for (std::uint32_t i = 0; i < body.nodes.size(); ++i) {
    const Vec3 rest = body.nodes[i], at = at_node(x, i);
    fmt::format_to(std::back_inserter(csv), "{:.9g},{:.9g},{:.9g},{:.12g},{:.12g},{:.12g}\n", rest.x(), rest.y(), rest.z(),
                   at.x(), at.y(), at.z());
  }
  return csv;
}

double farthest_m(const LumpedBody& body, const Vector& x) {
  double most = 0;
  for (std::uint32_t i = 0; i < body.nodes.size(); ++i) most = std::max(most, (at_node(x, i) - body.nodes[i]).norm());
  return most;
}

int run_settle(const SettleFlags& flags) {
  const Scene scene = open_scene(flags.scene);
  if (scene.body.gravity_m_s2.squaredNorm() == 0)
    throw InputError(flags.scene, "has no gravity: its body stays as it is", "gravity_m_s2 in its body");
  const Dynamics dynamics(scene.body);
  const Equilibrium hangs = find_equilibrium(dynamics);
  if (!hangs.found)
    throw InputError(flags.scene,
                     fmt::format("finds no equilibrium: after {} steps {:.3g} N of {:.3g} N are out of balance", hangs.iterations,
                                 hangs.residual_n, hangs.load_n),
                     "a body that is fixed somewhere and stiff enough for its weight");
  const double sag_m = farthest_m(scene.body, hangs.state.x);
  const auto out = make_output_folder(flags.out);
  write_text(out / "nodes.csv", csv_of_nodes(scene.body, hangs.state.x));
  write_json(out / "summary.json", {{"nodes", scene.body.nodes.size()},
                                    {"load_n", hangs.load_n},
                                    {"residual_n", hangs.residual_n},
                                    {"steps", hangs.iterations},
                                    {"energy_j", dynamics.energy(hangs.state)},
                                    {"farthest_mm", 1e3 * sag_m}});
  fmt::print("{} nodes hang still after {} steps, {:.2g} N of {:.3g} N out of balance; the farthest moved {:.3f} mm; in {}\n",
             scene.body.nodes.size(), hangs.iterations, hangs.residual_n, hangs.load_n, 1e3 * sag_m, flags.out);
  return 0;
}

}  // namespace

void add_settle(CLI::App& app, Run& run) {
  auto flags = std::make_shared<SettleFlags>();
  CLI::App* c = app.add_subcommand("settle", "where a body hangs under gravity: every node, and what is left out of balance");
  c->add_option("--scene", flags->scene, "scene file (JSON) with gravity_m_s2")->type_name("FILE")->required();
  c->add_option("--out", flags->out, "folder for nodes.csv and summary.json")->type_name("DIR")->required();
  c->callback([flags, &run] { run = [flags] { return run_settle(*flags); }; });
}

}  // namespace palpate
