#include "bench/lab/link_flags.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "bench/lab/flags.hpp"
#include "common/base/error.hpp"
#include "common/base/limits.hpp"
#include "common/base/types.hpp"

namespace palpate {

std::vector<Scheme> available_schemes() {
  std::vector<Scheme> schemes;
  for (std::size_t k = 0; k < kSchemeNames.size(); ++k) schemes.push_back(static_cast<Scheme>(k));
  return schemes;
}

Scheme available_scheme(const std::string& name, std::string_view also) {
  if (const auto scheme = scheme_from_name(name)) return *scheme;
  std::string expected = fmt::format("one of {}", fmt::join(kSchemeNames, ", "));
  if (!also.empty()) expected += fmt::format(", {}", also);
  throw InputError("--scheme " + name, "is no scheme of a server", expected);
}

std::vector<Scheme> schemes_named(const std::vector<std::string>& names) {
  std::vector<Scheme> schemes;
  for (const std::string& name : names) schemes.push_back(available_scheme(name));
  return names.empty() ? available_schemes() : schemes;
}

void LinkFlags::add_to(CLI::App& command) {
  command.add_option("--rtt-ms", rtt_ms, "round trip; each way takes half")->check(number_from<double>(0, 10'000));
  add_to_sweep(command);
}

void LinkFlags::add_to_sweep(CLI::App& command) {
  command.add_option("--rate-hz", rate_hz, "frames of the server per second")->check(number_from<double>(kMinRateHz, kMaxRateHz));
  command.add_option("--jitter-ms", jitter_ms, "largest deviation of the delay each way, drawn evenly; the order is kept")
      ->check(number_from<double>(0, 1'000));
  command.add_option("--loss-pct", loss_pct, "share of datagrams lost each way")->check(number_from<double>(0, 100));
  command.add_option("--burst", burst, "mean number of datagrams lost in a row, 0: independent losses")
      ->check(number_from<double>(0, 1'000));
  command.add_option("--seed", seed, "seed of everything that is drawn")->check(whole_number());
  command.add_option("--compute-ms", compute_ms, "time of the server from frame to patch")->check(number_from<double>(0, 10'000));
}

LinkSpec LinkFlags::one_way() const {
  LinkSpec link;
  link.latency = from_seconds(rtt_ms * 0.5e-3);
  link.jitter = from_seconds(jitter_ms * 1e-3);
  link.loss = loss_pct / 100;
  link.burst_mean = burst;
  link.seed = seed;
  validate(link, "link");
  return link;
}

ReplayOptions replay_options(const std::string& scheme, int order, const LinkFlags& link) {
  ReplayOptions o;
  o.scheme = available_scheme(scheme);
  o.order = order;
  o.rate_hz = link.rate_hz;
  o.link = link.one_way();
  o.seed = link.seed;
  o.compute = from_seconds(link.compute_ms * 1e-3);
  return o;
}

}  // namespace palpate
