#include "bench/output/run_record.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <string_view>

#include "common/io/provenance.hpp"

namespace palpate {
namespace {

constexpr std::array<std::string_view, 3> kOwnPlace{"scheme", "order", "seed"};
constexpr std::array<std::string_view, 4> kInputFiles{"scene", "motion", "recording", "report"};
constexpr std::array<std::string_view, 6> kLinkFlags{"rate_hz", "rtt_ms", "jitter_ms", "loss_pct", "burst", "compute_ms"};
constexpr std::array<std::string_view, 4> kNoFacts{"help", "out", "shard", "jobs"};  // flags that do not affect the figures

Json& the_run() {
  static Json run = Json::object();
  return run;
}

template <std::size_t kSize>
bool one_of(const std::array<std::string_view, kSize>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

Json value_of(const std::string& text) {
  char* end = nullptr;
  const double number = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0' || !std::isfinite(number)) return text;
  if (number == std::floor(number) && std::abs(number) < 9e15) return static_cast<std::int64_t>(number);
  return number;
}

/// Value as typed, or the default; null if there is neither.
Json value_of(const CLI::Option& flag) {
  if (flag.count() == 0) return flag.get_default_str().empty() ? Json() : value_of(flag.get_default_str());
  if (flag.get_expected_max() == 0) return 1;
  Json list = Json::array();
  for (const std::string& text : flag.results()) list.push_back(value_of(text));
  return list.size() == 1 ? list[0] : list;
}

Json input_file(const std::string& file) {
  Json json{{"file", file}};
  if (const std::string hash = file_hash(file); !hash.empty()) json["hash"] = hash;
  if (!file.ends_with(".json")) return json;
  std::ifstream in(file);
  const Json scene = Json::parse(in, nullptr, false);
  if (scene.is_object() && scene.contains("name")) json["name"] = scene["name"];
  return json;
}

}  // namespace

void set_run_record(const std::string& program, const std::string& experiment, const CLI::App& typed) {
  Json& run = the_run();
  run = {{"program", program}, {"version", PALPATE_VERSION}, {"experiment", experiment}};
  Json link = Json::object(), flags = Json::object();
  for (const CLI::Option* flag : typed.get_options()) {
    std::string name = flag->get_single_name();
    std::replace(name.begin(), name.end(), '-', '_');
    const Json value = value_of(*flag);
    if (value.is_null() || value == "[]" || one_of(kNoFacts, name)) continue;
    if (one_of(kOwnPlace, name))
      run[name] = value;
    else if (one_of(kInputFiles, name) && value.is_string())
      run[name] = input_file(value.get<std::string>());
    else if (one_of(kLinkFlags, name))
      link[name] = value;
    else
      flags[name] = value;
  }
  if (!link.empty()) run["link"] = link;
  if (!flags.empty()) run["flags"] = flags;
  const MachineName machine = this_machine();
  run["machine"] = {{"processor", machine.processor}, {"cores", machine.cores}, {"system", machine.system}};
}

const Json& run_record() { return the_run(); }

}  // namespace palpate
