// palpate-lab paper: every experiment of Cavusoglu and Tendick, and one page that compares their figures with ours.
#include <fmt/format.h>

#include <algorithm>
#include <exception>

#include "bench/lab/experiments.hpp"
#include "bench/lab/page.hpp"
#include "bench/lab/parallel.hpp"
#include "bench/output/output.hpp"
#include "common/base/error.hpp"
#include "paper_page.hpp"

namespace palpate {
namespace {

struct Experiment {
  const char* name;
  PaperSection (*run)(const std::filesystem::path& out, bool quick);
};

/// Experiments in the paper's order.
constexpr Experiment kExperiments[] = {{"spring1d", paper_spring1d}, {"bode", paper_bode},       {"modes", paper_modes},
                                       {"chain", paper_chain},       {"scaling", paper_scaling}, {"haptic", paper_haptic},
                                       {"release", paper_release},   {"limits", paper_limits}};

struct PaperFlags {
  std::string out;
  std::vector<std::string> only;
  bool quick = false;
};

struct Outcome {
  const Experiment* experiment = nullptr;
  PaperSection section;
  std::string error;
  double wall_s = 0;
};

void run_one(Outcome& outcome, const std::filesystem::path& out, bool quick) {
  const std::int64_t begin = stopwatch_ns();
  try {
    outcome.section = outcome.experiment->run(make_output_folder((out / outcome.experiment->name).string()), quick);
  } catch (const std::exception& e) {
    outcome.section.title = outcome.experiment->name;
    outcome.error = e.what();
  }
  outcome.wall_s = static_cast<double>(stopwatch_ns() - begin) * 1e-9;
}

const char* name_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::agrees:
      return "agrees";
    case Verdict::differs:
      return "differs";
    case Verdict::beyond:
      return "beyond";
  }
  return "";
}

std::size_t count(const Outcome& outcome, Verdict verdict) {
  return static_cast<std::size_t>(std::count_if(outcome.section.findings.begin(), outcome.section.findings.end(),
                                                [&](const Finding& f) { return f.verdict == verdict; }));
}

/// Removes the backquotes that mark names on the terminal.
std::string plain(std::string text) {
  std::erase(text, '`');
  return text;
}

Json section_json(const Outcome& outcome, const std::filesystem::path& out) {
  const PaperSection& s = outcome.section;
  Json json{{"name", outcome.experiment->name},
            {"title", s.title},
            {"command", fmt::format("palpate-lab paper --only {} --out DIR", outcome.experiment->name)},
            {"text", s.text},
            {"error", outcome.error}};
  for (const Verdict v : {Verdict::agrees, Verdict::differs, Verdict::beyond}) json[name_of(v)] = count(outcome, v);
  json["findings"] = Json::array();
  for (const Finding& f : s.findings)
    json["findings"].push_back({{"what", plain(f.what)},
                                {"paper", plain(f.paper)},
                                {"ours", plain(f.ours)},
                                {"verdict", name_of(f.verdict)},
                                {"reason", plain(f.reason)}});
  json["pictures"] = Json::array();
  for (const Figure& p : s.pictures)
    json["pictures"].push_back({{"file", std::filesystem::relative(p.svg, out).string()}, {"caption", p.caption}});
  return json;
}

Json summary(const std::vector<Outcome>& outcomes, const std::filesystem::path& out, const PaperFlags& flags) {
  Json json{{"title", flags.quick ? "The paper, quick run: coarser grids" : "The paper, whole"},
            {"version", PALPATE_VERSION},
            {"command", fmt::format("palpate-lab paper{} --out DIR", flags.quick ? " --quick" : "")}};
  for (const Verdict v : {Verdict::agrees, Verdict::differs, Verdict::beyond}) {
    std::size_t sum = 0;
    for (const Outcome& o : outcomes) sum += count(o, v);
    json[name_of(v)] = sum;
  }
  json["sections"] = Json::array();
  for (const Outcome& o : outcomes) json["sections"].push_back(section_json(o, out));
  return json;
}

void write_report(Json json, const std::filesystem::path& out) {
  for (Json& section : json["sections"])
    for (Json& picture : section["pictures"]) picture["uri"] = picture_uri(out / picture["file"].get<std::string>());
  write_text(out / "report.html", render_page(kPaperPage, json));
}

std::vector<Outcome> chosen(const PaperFlags& flags) {
  std::vector<Outcome> outcomes;
  for (const Experiment& e : kExperiments)
    if (flags.only.empty() || std::find(flags.only.begin(), flags.only.end(), e.name) != flags.only.end())
      outcomes.push_back({&e, {}, {}, 0});
  return outcomes;
}

int run_paper(const PaperFlags& flags) {
  const auto out = make_output_folder(flags.out);
  std::vector<Outcome> outcomes = chosen(flags);
  run_all(outcomes.size(), [&](std::size_t i) { run_one(outcomes[i], out, flags.quick); });
  const Json json = summary(outcomes, out, flags);
  write_json(out / "summary.json", json);
  write_report(json, out);

  fmt::print("{:<10} {:>6} {:>6} {:>6} {:>8}\n", "section", "agree", "differ", "beyond", "time [s]");
  bool whole = true;
  for (const Outcome& o : outcomes) {
    fmt::print("{:<10} {:>6} {:>6} {:>6} {:>8.1f}\n", o.experiment->name, count(o, Verdict::agrees), count(o, Verdict::differs),
               count(o, Verdict::beyond), o.wall_s);
    whole = whole && o.error.empty();
  }
  for (const Outcome& o : outcomes) {
    if (!o.error.empty()) continue;
    fmt::print("\n{}\n", o.section.title);
    for (const Finding& f : o.section.findings) {
      fmt::print("  {:<8} {}: {}", name_of(f.verdict), f.what, f.ours);
      if (!f.paper.empty()) fmt::print("; paper: {}", f.paper);
      fmt::print("{}\n", f.reason.empty() ? "" : fmt::format(" ({})", f.reason));
    }
  }
  fmt::print("{}\n", (out / "report.html").string());
  for (const Outcome& o : outcomes)
    if (!o.error.empty()) fmt::print(stderr, "palpate-lab: {} could not be computed: {}\n", o.experiment->name, o.error);
  return whole ? 0 : 1;
}

}  // namespace

void add_paper(CLI::App& app, Run& run) {
  auto flags = std::make_shared<PaperFlags>();
  std::vector<std::string> names;
  for (const Experiment& e : kExperiments) names.emplace_back(e.name);
  CLI::App* c = app.add_subcommand("paper", "repeat the paper's experiments, and write a report with its figures and ours");
  c->add_flag("--quick", flags->quick, "use coarser grids and shorter runs");
  c->add_option("--only", flags->only, "only these sections")->check(one_of(names));
  c->add_option("--out", flags->out, "folder for report.html, summary.json and a folder for each section")
      ->type_name("DIR")
      ->required();
  c->callback([flags, &run] { run = [flags] { return run_paper(*flags); }; });
}

}  // namespace palpate
