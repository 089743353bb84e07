#include "bench/lab/link_flags.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "bench/lab/flags.hpp"
#include "bench/output/routes.hpp"
#include "common/base/error.hpp"
#include "common/base/limits.hpp"
#include "common/base/types.hpp"

namespace palpate {

std::vector<Scheme> available_schemes() {
  std::vector<Scheme> schemes;
  for (std::size_t k = 0; k < kSchemeNames.size(); ++k) schemes.push_back(static_cast<Scheme>(k));
  return schemes;
}

Scheme available_scheme(const std::string& name) {
  if (const auto scheme = scheme_from_name(name)) return *scheme;
  throw InputError("--scheme " + name, "is no scheme of a server", fmt::format("one of {}", fmt::join(kSchemeNames, ", ")));
}

void LinkFlags::add_to(CLI::App& command) {
  command.add_option("--rate-hz", rate_hz, "frames of the server a second")->check(number_from<double>(kMinRateHz, kMaxRateHz));
  auto* rtt = command.add_option("--rtt-ms", rtt_ms, "round trip; each way takes half")->check(number_from<double>(0, 10'000));
  command
      .add_option_function<std::string>(
          "--route", [this](const std::string& name) { rtt_ms = route_from_name(name).rtt_ms; },
          "round trip of a measured route: san-francisco, bangalore, buenos-aires, shanghai")
      ->type_name("NAME")
      ->excludes(rtt);
  command.add_option("--jitter-ms", jitter_ms, "each way's delay is drawn evenly within +- this, in the order sent")
      ->check(number_from<double>(0, 1'000));
  command.add_option("--loss-pct", loss_pct, "datagrams lost, each way")->check(number_from<double>(0, 100));
  command.add_option("--burst", burst, "mean run of lost datagrams, 0: independent losses")->check(number_from<double>(0, 1'000));
  command.add_option("--seed", seed, "of everything that is drawn")->check(whole_number());
  command.add_option("--compute-ms", compute_ms, "the server's time from frame to patch")->check(number_from<double>(0, 10'000));
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
