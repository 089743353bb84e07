// palpate-lab couplings: the related work of the paper's introduction, each part selectable.
#include <fmt/format.h>

#include "bench/lab/coupling_parts.hpp"
#include "bench/lab/flags.hpp"
#include "bench/output/progress.hpp"

namespace palpate {
namespace {

struct Part {
  const char* name;
  CouplingPart (*show)(const std::filesystem::path& out, const CouplingFlags& flags);
};

constexpr Part kParts[] = {{"virtual-coupling", show_virtual_coupling},
                           {"proxy", show_proxy},
                           {"braking-pulse", show_braking_pulse},
                           {"norton", show_norton}};

struct CouplingsFlags {
  CouplingFlags of_parts;
  double period_ms = 1;
  std::string part = "all", out;
};

struct Shown {
  Json summary;
  std::vector<GridPanel> overview;
  std::vector<Finding> findings;
  std::vector<Figure> pictures;
  std::string table;
};

Shown show(const std::filesystem::path& out, const CouplingFlags& flags, const std::string& which) {
  Shown shown;
  Steps steps(which == "all" ? std::size(kParts) : 1);
  for (const Part& p : kParts) {
    if (which != "all" && which != p.name) continue;
    steps.begin(p.name);
    CouplingPart part = p.show(out, flags);
    shown.summary[p.name] = std::move(part.summary);
    shown.overview.push_back(std::move(part.key_panel));
    shown.findings.insert(shown.findings.end(), part.findings.begin(), part.findings.end());
    shown.pictures.push_back(std::move(part.picture));
    shown.table += part.table;
  }
  write_json(out / "summary.json", shown.summary);
  if (which == "all") {
    plot_grid(out / "couplings.svg", "Related work of the introduction, at work", 2, shown.overview);
    shown.pictures.insert(
        shown.pictures.begin(),
        {out / "couplings.svg", "Virtual coupling, god-object, braking pulse, Norton equivalents: one view of each."});
  }
  return shown;
}

int run_command(CouplingsFlags flags) {
  const auto out = make_output_folder(flags.out);
  flags.of_parts.period_s = flags.period_ms * 1e-3;
  fmt::print("{}{}\n", show(out, flags.of_parts, flags.part).table, (out / "summary.json").string());
  return 0;
}

}  // namespace

PaperSection paper_couplings(const std::filesystem::path& folder, bool quick) {
  const auto out = make_output_folder(folder.string());
  CouplingFlags flags;
  flags.quick = quick;
  Shown shown = show(out, flags, "all");
  return {
      "Section 1, related work: couplings and stiff contact", "palpate-lab couplings --out DIR",
      "What the introduction cites, rebuilt as small parts: the virtual coupling against the passivity condition of a sampled "
      "wall, the god-object against penalties, the braking pulse, and coarse and fine meshes joined through Norton equivalents.",
      std::move(shown.findings), std::move(shown.pictures)};
}

void add_couplings(CLI::App& app, Run& run) {
  auto flags = std::make_shared<CouplingsFlags>();
  CouplingFlags& f = flags->of_parts;
  CLI::App* c =
      app.add_subcommand("couplings", "related work of section 1: virtual coupling, god-object, braking pulse, Norton coupling");
  c->add_option("--part", flags->part, "which of them")
      ->check(one_of({"virtual-coupling", "proxy", "braking-pulse", "norton", "all"}))
      ->capture_default_str();
  const auto number = [c](const char* name, double& value, const char* text, double low, double high) {
    c->add_option(name, value, text)->check(number_from<double>(low, high))->capture_default_str();
  };
  number("--device-mass-kg", f.device.mass_kg, "device, virtual-coupling and braking-pulse", 0.001, 10);
  number("--device-damping-n-s-m", f.device.damping_n_s_m, "its damping, with what the hand adds", 0, 50);
  number("--period-ms", flags->period_ms, "sampling period", 0.1, 20);
  number("--coupling-n-m", f.coupling.stiffness_n_m, "virtual coupling: stiffness", 1, 1e6);
  number("--coupling-n-s-m", f.coupling.damping_n_s_m, "virtual coupling: damping", 0, 100);
  number("--tool-mass-kg", f.coupling.tool_mass_kg, "virtual coupling: mass of the virtual tool", 0, 10);
  number("--wall-n-m", f.wall_n_m, "proxy, braking-pulse: stiffness of the wall", 1, 1e5);
  number("--speed-m-s", f.speed_m_s, "braking-pulse: at contact", 0.01, 2);
  number("--push-n", f.push_n, "braking-pulse: the hand's push", 0, 5);
  number("--force-max-n", f.force_max_n, "braking-pulse: what the device can show", 0.5, 100);
  c->add_option("--fine-layers", f.sheet.fine_layers, "norton: layers of nodes around the port at 1 kHz")
      ->check(number_from(1, 5))
      ->capture_default_str();
  number("--stiffness-n-m", f.sheet.stiffness_n_m, "norton: of every element", 1, 1e5);
  number("--damping-n-s-m", f.sheet.damping_n_s_m, "norton: of every element", 0.01, 50);
  number("--node-mass-kg", f.sheet.node_mass_kg, "norton: of every node", 1e-5, 0.1);
  c->add_option("--out", flags->out, "folder for summary.json, CSV files and plots")->type_name("DIR")->required();
  c->callback([flags, &run] { run = [flags] { return run_command(*flags); }; });
}

}  // namespace palpate
