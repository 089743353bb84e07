// Measures the limits of the method that the paper names.
#include <fmt/format.h>

#include <algorithm>

#include "bench/lab/experiments.hpp"
#include "bench/lab/limits.hpp"
#include "bench/output/output.hpp"

namespace palpate {
namespace {

const LimitCurve& find(const std::vector<LimitCurve>& curves, std::string_view body, Scheme scheme, double rtt_ms) {
  return *std::find_if(curves.begin(), curves.end(),
                       [&](const LimitCurve& c) { return c.body == body && c.scheme == scheme && c.rtt_ms == rtt_ms; });
}

std::string from_to(const LimitCurve& c, const char* unit) {
  return fmt::format("{:.0f} dB at {:g}{}, {:.0f} dB at {:g}{}", c.snr_db.front(), c.at.front(), unit, c.snr_db.back(),
                     c.at.back(), unit);
}

struct Claim {
  Flaw flaw;
  const char *what, *paper;
  bool ring_fails;
  const char* reason;
};

constexpr Claim kClaims[] = {
    {Flaw::soft_below, "deep tissue softer than the surface", "violates the dominance of local states", true, ""},
    {Flaw::stiff_at_top, "a stiff lump under the tool", "inhomogeneous material: may violate it", true,
     "The ring lies inside the lump, and what gives way lies around it."},
    {Flaw::stiff_inside, "a stiff lump deep inside", "inhomogeneous material: may violate it", false,
     "Far from the tool a lump does no harm: it makes the nodes that ring holds still move less."},
    {Flaw::torn, "a torn layer two cells below the surface", "discontinuities away from the contact violate it", true, ""}};

}  // namespace

PaperSection paper_limits(const std::filesystem::path& folder, bool quick) {
  constexpr double kRateHz = 20, kFailsDb = 6;
  const auto out = make_output_folder(folder.string());
  const LimitsPlan plan = limits_plan(quick);
  const Limits limits = find_limits(plan, kRateHz, out);
  PaperSection s;
  s.title = "Section 7: limits of local models";
  s.command = "palpate-lab limits --out DIR";
  s.text =
      "The 6x6x6 cube with one flaw at a time, stiffness ratios from 1 to 100, grasped and moved 10 mm deep with the base "
      "excursion at "
      "20 Hz; fidelity against the full model at 1 kHz. Then the homogeneous cube, deeper and deeper, with scheme port: a linear "
      "patch "
      "is true as far as the body is linear over its prediction horizon.";
  for (const Claim& claim : kClaims) {
    const LimitCurve& ring = find(limits.flaws, name_of(claim.flaw), Scheme::ring, plan.rtt_ms.front());
    const LimitCurve& port = find(limits.flaws, name_of(claim.flaw), Scheme::port, plan.rtt_ms.front());
    const bool fails = ring.snr_db.back() < ring.snr_db.front() - kFailsDb;
    s.findings.push_back({fmt::format("{}: ring by stiffness ratio", claim.what), claim.paper, from_to(ring, ":1"),
                          fails == claim.ring_fails ? Verdict::agrees : Verdict::differs, claim.reason});
    s.findings.push_back({fmt::format("{}: port", claim.what), "", from_to(port, ":1"), Verdict::beyond, ""});
  }
  for (const char* body : {"linear springs", "stiffening springs"})
    for (const double rtt_ms : {plan.rtt_ms.front(), plan.rtt_ms.back()}) {
      const LimitCurve& port = find(limits.depths, body, Scheme::port, rtt_ms);
      s.findings.push_back({fmt::format("deeper excursions, {}, port, RTT {:g} ms", body, rtt_ms),
                            "significant geometric nonlinearity violates it", from_to(port, " mm"),
                            port.snr_db.back() < port.snr_db.front() ? Verdict::agrees : Verdict::differs, ""});
    }
  s.pictures = {
      {out / "flaws.svg", "SNR of the displayed force against the ratio of stiff to soft springs, for no delay and the longest."},
      {out / "depths.svg", "SNR of scheme port against the mean depth of the excursion."}};
  return s;
}

}  // namespace palpate
