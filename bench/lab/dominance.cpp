// palpate-lab dominance: is the response to the hand local to the contact, and is `ring` good enough?
#include "bench/paper/dominance.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "bench/lab/experiments.hpp"
#include "bench/output/output.hpp"
#include "bench/output/plot.hpp"
#include "bench/output/progress.hpp"
#include "common/base/error.hpp"
#include "common/command_line/mesh_folders.hpp"
#include "server/body/unload.hpp"
#include "server/room/room.hpp"

namespace palpate {
namespace {

constexpr std::size_t kNodesMax = 4000;  // balancing takes minutes at this size

struct DominanceFlags {
  std::string scene, out;
  MeshFolders mesh_folders;
  std::vector<int> node;
  int layers = 4;
};

/// Node (i, j, k), each index counted along its axis over the coordinates at which the body has nodes.
std::uint32_t node_at(const LumpedBody& body, const std::vector<int>& index) {
  Vec3 wanted = Vec3::Zero();
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    constexpr double kSame = 1e-9;
    std::vector<double> at;
    for (const Vec3& x : body.nodes) at.push_back(x[axis]);
    std::sort(at.begin(), at.end());
    at.erase(std::unique(at.begin(), at.end(), [](double a, double b) { return b - a < kSame; }), at.end());
    const int i = axis < static_cast<Eigen::Index>(index.size()) ? index[static_cast<std::size_t>(axis)] : 0;
    if (i < 0 || i >= static_cast<int>(at.size()))
      throw InputError("--node", fmt::format("has {} along {}", i, "xyz"[axis]), fmt::format("0 to {}", at.size() - 1));
    wanted[axis] = at[static_cast<std::size_t>(i)];
  }
  const auto distance = [&](const Vec3& a, const Vec3& b) { return (a - wanted).norm() < (b - wanted).norm(); };
  const auto nearest = std::min_element(body.nodes.begin(), body.nodes.end(), distance);
  if ((*nearest - wanted).norm() > 1e-6)
    throw InputError("--node", "is a place where the body has no node", "a node of the lattice");
  return static_cast<std::uint32_t>(nearest - body.nodes.begin());
}

/// Node at which the body is balanced: the named one, the attached one, or the surface node nearest to the start of the tool.
std::uint32_t port_of(const Scene& scene, const DominanceFlags& flags) {
  const LumpedBody& body = scene.body;
  std::uint32_t node = scene.tool.node;
  if (!flags.node.empty()) {
    node = node_at(body, flags.node);
  } else if (scene.tool.contact == ContactKind::touch) {
    const Vec3 home = home_of(scene);
    double least = 1e300;
    for (const Triangle& t : body.triangles)
      for (const std::uint32_t i : t)
        if (!body.fixed[i] && (body.nodes[i] - home).norm() < least) {
          least = (body.nodes[i] - home).norm();
          node = i;
        }
  }
  if (body.fixed[node]) throw InputError("--node", "is a fixed node", "one that moves");
  return node;
}

/// Returns false if the ring would have to be the whole body.
bool ring_serves(const Dominance& d) {
  return d.ring_layers_all > 0 && d.rings[static_cast<std::size_t>(d.ring_layers_all) - 1].states < d.states_full;
}

/// Formats the verdict in two or three sentences.
std::string verdict(const Dominance& d) {
  const double within_2 = d.layers[std::min<std::size_t>(2, d.layers.size() - 1)].within;
  std::string text = fmt::format(
      "{} of {} states are dominant; {:.0f} % of their energy lies within two layers of the contact, half within {:.0f} mm and "
      "nine tenths within {:.0f} mm of a body that reaches {:.0f} mm. ",
      d.states_dominant, d.states_full, 100 * within_2, 1e3 * d.distance_50_m, 1e3 * d.distance_90_m, 1e3 * d.extent_m);
  const double slow_2 = d.layers[std::min<std::size_t>(2, d.layers.size() - 1)].slow_within;
  const bool local = within_2 >= 0.5 && slow_2 >= 0.5;
  text += fmt::format("A slow push deforms the body within two layers by {:.0f} %. ", 100 * slow_2);
  text += local ? "The dominant modes are local to the contact. "
                : "The dominant modes are not local: most of what answers the "
                  "hand lies far from it. ";
  if (ring_serves(d))
    text += fmt::format("ring serves with {} or more layers: its error stays below {:.0f} % from 10 to 1000 Hz.",
                        d.ring_layers_all, 100 * Dominance::kRingError);
  else if (d.ring_layers_fast > 0)
    text += fmt::format("ring with {} or more layers serves above 100 Hz only; below, use port or balanced.", d.ring_layers_fast);
  else
    text += fmt::format("ring does not serve with up to {} layers: use port or balanced.", d.rings.back().layers);
  return text;
}

Json summary(const Dominance& d) {
  Json json = {{"states_full", d.states_full},
               {"states_dominant", d.states_dominant},
               {"distance_50_mm", 1e3 * d.distance_50_m},
               {"distance_90_mm", 1e3 * d.distance_90_m},
               {"extent_mm", 1e3 * d.extent_m},
               {"ring_layers_100_1000", d.ring_layers_fast},
               {"ring_layers_10_1000", d.ring_layers_all},
               {"ring_serves", ring_serves(d) ? 1 : 0}};
  for (const LayerShare& l : d.layers)
    json["layers"][std::to_string(l.layer)] = {{"within_share", l.within},
                                               {"slow_share", l.slow_within},
                                               {"even_share", l.even_within},
                                               {"distance_mm", 1e3 * l.distance_m}};
  for (const RingError& r : d.rings)
    json["rings"][std::to_string(r.layers)] = {{"states", r.states},
                                               {"dc_rel_error", r.dc},
                                               {"band_10_100_rel_error", r.band_10_100},
                                               {"band_100_1000_rel_error", r.band_100_1000}};
  return json;
}

void write_curves(const std::filesystem::path& out, const std::string& name, const Dominance& d) {
  std::string shares = "layer,within_share,slow_share,even_share,distance_m\n",
              rings = "layers,states,dc_rel_error,band_10_100_rel_error,band_100_1000_rel_error\n";
  for (const LayerShare& l : d.layers)
    fmt::format_to(std::back_inserter(shares), "{},{:.6g},{:.6g},{:.6g},{:.6g}\n", l.layer, l.within, l.slow_within,
                   l.even_within, l.distance_m);
  for (const RingError& r : d.rings)
    fmt::format_to(std::back_inserter(rings), "{},{},{:.6g},{:.6g},{:.6g}\n", r.layers, r.states, r.dc, r.band_10_100,
                   r.band_100_1000);
  write_text(out / "layers.csv", shares);
  write_text(out / "rings.csv", rings);
  std::string hankel = "state,hankel_n_m\n";
  for (std::size_t i = 0; i < d.hankel_n_m.size(); ++i)
    fmt::format_to(std::back_inserter(hankel), "{},{:.6g}\n", i + 1, d.hankel_n_m[i]);
  write_text(out / "hankel.csv", hankel);
  const double last = std::max<double>(static_cast<double>(d.layers.size()) - 1, static_cast<double>(d.rings.back().layers));
  plot_csv(out / "layers.csv", out / "dominance.svg",
           fmt::format("{}: where its dominant states live, and what a ring gets wrong", name),
           "layers of nodes around the contact",
           {{"share of the energy",
             {{"1:2", "dominant states", 1, {}, "linespoints"},
              {"1:3", "slow push", 2, {}, "linespoints"},
              {"1:4", "spread evenly", 0, {}, "lines dt 2"}},
             false,
             "set yrange [0:1.05]"},
            {"largest error of ring, relative",
             {{"1:5", "100 to 1000 Hz", 1, out / "rings.csv", "linespoints"},
              {"1:4", "10 to 100 Hz", 2, out / "rings.csv", "linespoints"},
              {"1:3", "at rest (DC)", 3, out / "rings.csv", "linespoints"},
              {"1:(0.1)", "just noticed", 0, {}, "lines dt 2"}},
             true,
             "set yrange [*:*]"}},
           {.setup = fmt::format("set xrange [0:{}]\nset xtics 1", last)});
}

Dominance computed(const Specimen& specimen, int layers) {
  Steps steps(1);
  steps.begin("balancing the body, then its rings");
  return dominance(specimen, layers);
}

int run_dominance(const DominanceFlags& flags) {
  const Scene scene = open_scene(flags.scene, flags.mesh_folders);
  if (scene.body.nodes.size() > kNodesMax)
    throw InputError("--scene", fmt::format("has {} nodes", scene.body.nodes.size()), fmt::format("at most {}", kNodesMax));
  const Specimen specimen(scene.body, port_of(scene, flags));
  const auto out = make_output_folder(flags.out);
  const Dominance d = computed(specimen, flags.layers);
  write_json(out / "summary.json", summary(d));
  write_curves(out, scene.name, d);
  fmt::print("{:<8}{:>15}{:>12}{:>15}{:>15}\n", "layers", "dominant states", "slow push", "spread evenly", "distance [mm]");
  for (const LayerShare& l : d.layers)
    fmt::print("{:<8}{:>13.1f} %{:>10.1f} %{:>13.1f} %{:>15.1f}\n", l.layer, 100 * l.within, 100 * l.slow_within,
               100 * l.even_within, 1e3 * l.distance_m);
  fmt::print("\n{:<8}{:>8}{:>14}{:>14}{:>14}\n", "ring", "states", "DC error", "10-100 Hz", "100-1000 Hz");
  for (const RingError& r : d.rings)
    fmt::print("{:<8}{:>8}{:>12.1f} %{:>12.1f} %{:>12.1f} %\n", r.layers, r.states, 100 * r.dc, 100 * r.band_10_100,
               100 * r.band_100_1000);
  fmt::print("\n{}\n{}\n", verdict(d), (out / "summary.json").string());
  return 0;
}

}  // namespace

void add_dominance(CLI::App& app, Run& run) {
  auto flags = std::make_shared<DominanceFlags>();
  CLI::App* c =
      app.add_subcommand("dominance", "are the states that answer the hand local to the contact? (section 7 of the paper)");
  c->add_option("--scene", flags->scene, "scene file (JSON)")->type_name("FILE")->required();
  add_mesh_folders(*c, flags->mesh_folders);
  c->add_option("--node", flags->node,
                "i,j,k of the node to balance at; default: the attached one, or the surface node nearest to the tool's start")
      ->delimiter(',')
      ->expected(2, 3);
  c->add_option("--layers", flags->layers, "rings to try, of 1, 2, ... layers")->check(number_from(1, 10));
  c->add_option("--out", flags->out, "folder for summary.json, layers.csv, rings.csv, hankel.csv, dominance.svg")
      ->type_name("DIR")
      ->required();
  c->callback([flags, &run] { run = [flags] { return run_dominance(*flags); }; });
}

}  // namespace palpate
