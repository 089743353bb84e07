#include "bench/lab/release_sweep.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "bench/lab/link_flags.hpp"
#include "bench/lab/parallel.hpp"
#include "bench/output/output.hpp"
#include "bench/output/plot.hpp"

namespace palpate {
namespace {

struct Grid {
  double rate_hz = 20;
  std::vector<double> rtt_ms;
};
struct Plan {
  std::vector<Grid> grids;
  std::vector<double> decays_ms;  ///< round trips of the first grid whose windows are drawn
  bool damping = true;
};

Plan plan_of(bool quick) {
  if (quick) return {{{20, {0, 100}}, {10, {1000}}}, {0, 100}, false};
  return {{{20, {0, 20, 50, 100, 150, 200, 300, 400, 500, 600, 800, 1000}}, {10, {0, 100, 200, 400, 700, 1000}}},
          {0, 100, 400},
          true};
}

constexpr double kLostMm = 300;  ///< value of a lost tool in plots

std::string sweep_file(double rate_hz) { return fmt::format("sweep_{:g}hz.csv", rate_hz); }
std::string decay_file(double rtt_ms) { return fmt::format("decay_{:g}ms.csv", rtt_ms); }

std::vector<double> round_trips(const RateSweep& points) {
  std::vector<double> rtt_ms;
  for (const ReleasePoint& p : points)
    if (p.scheme == points[0].scheme) rtt_ms.push_back(p.rtt_ms);
  return rtt_ms;
}

void write_points(const std::filesystem::path& file, const RateSweep& points) {
  const std::vector<double> rtt_ms = round_trips(points);
  std::string csv = "scheme,rtt_ms,scheme_no,rtt_no,stable,lost,growth_1_s,display_min_j,last_mm,shown_mm,label,text_colour\n";
  for (std::size_t i = 0; i < points.size(); ++i) {
    const ReleasePoint& p = points[i];
    const double last_mm = p.last_m() * 1e3, shown_mm = p.lost ? kLostMm : std::clamp(last_mm, 0.01, kLostMm);
    constexpr double kDarkAboveMm = 4;
    fmt::format_to(
        std::back_inserter(csv), "{},{:g},{},{},{},{},{:.4g},{:.4g},{:.4g},{:.4g},{},{}\n", name_of(p.scheme), p.rtt_ms,
        i / rtt_ms.size(), i % rtt_ms.size(), p.verdict.stable ? 1 : 0, p.lost ? 1 : 0, p.verdict.growth_1_s, p.display_min_j,
        last_mm, shown_mm,
        p.lost ? "lost"
               : fmt::format("{:.{}f}{}", last_mm, last_mm < 9.95 ? (last_mm < 0.995 ? 2 : 1) : 0, p.verdict.stable ? "" : " !"),
        shown_mm > kDarkAboveMm ? 0xffffff : 0x000000);
  }
  write_text(file, csv);
}

void write_decay(const std::filesystem::path& file, const RateSweep& points, double rtt_ms) {
  std::string csv = "t_s";
  std::size_t windows = 0;
  for (const ReleasePoint& p : points)
    if (p.rtt_ms == rtt_ms) {
      csv += fmt::format(",{}_mm", name_of(p.scheme));
      windows = std::max(windows, p.verdict.peak_to_peak_m.size());
    }
  csv += '\n';
  for (std::size_t k = 0; k < windows; ++k) {
    csv += fmt::format("{:g}", (static_cast<double>(k) + 0.5) * kWindowS);
    for (const ReleasePoint& p : points)
      if (p.rtt_ms == rtt_ms)
        csv += k < p.verdict.peak_to_peak_m.size() ? fmt::format(",{:.4g}", p.verdict.peak_to_peak_m[k] * 1e3) : ",nan";
    csv += '\n';
  }
  write_text(file, csv);
}

RateSweep sweep_rate(const Scene& scene, const ReleaseOptions& base, const Grid& grid) {
  RateSweep points;
  for (const Scheme scheme : available_schemes())
    for (const double rtt_ms : grid.rtt_ms) points.push_back({scheme, grid.rate_hz, rtt_ms, {}, false, 0});
  run_all(points.size(), [&](std::size_t i) {
    ReleasePoint& p = points[i];
    ReleaseOptions options = base;
    options.scheme = p.scheme;
    options.rate_hz = p.rate_hz;
    options.link.latency = from_seconds(p.rtt_ms * 0.5e-3);
    ReleaseResult r = release(scene, options);
    p.verdict = std::move(r.verdict);
    p.lost = r.loop.lost;
    p.display_min_j = r.display_min_j;
  });
  return points;
}

double damping_needed(const Scene& scene, ReleaseOptions options) {
  for (const double damping : {0.0, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0}) {
    options.device_damping_n_s_m = damping;
    if (release(scene, options).verdict.stable) return damping;
  }
  return std::numeric_limits<double>::infinity();
}

std::vector<double> find_damping(const Scene& scene, const ReleaseOptions& base, double rate_hz) {
  const std::vector<Scheme> schemes = available_schemes();
  std::vector<double> damping(schemes.size());
  run_all(schemes.size(), [&](std::size_t k) {
    ReleaseOptions options = base;
    options.scheme = schemes[k];
    options.rate_hz = rate_hz;
    options.link.latency = Micros{};
    damping[k] = damping_needed(scene, options);
  });
  return damping;
}

void plot_map(const std::filesystem::path& out, const std::vector<RateSweep>& sweeps) {
  std::string s =
      fmt::format("set multiplot layout {},1 title {} font ',15'\n", sweeps.size(),
                  quoted("After the grip is let go: motion left in the last 0.6 s [mm, peak to peak]; ! = not stable"));
  s += map_palette() + "set logscale cb\nset cbrange [0.03:300]\nset cblabel 'motion left [mm]'\nunset grid\nunset key\n";
  s += "set lmargin 15\nset rmargin 14\n";
  for (const auto& points : sweeps) {
    const std::vector<double> rtt_ms = round_trips(points);
    std::string x, y;
    for (std::size_t k = 0; k < rtt_ms.size(); ++k) x += fmt::format("{}'{:g}' {}", k > 0 ? ", " : "", rtt_ms[k], k);
    const std::size_t schemes = points.size() / rtt_ms.size();
    for (std::size_t k = 0; k < schemes; ++k)
      y += fmt::format("{}'{}' {}", k > 0 ? ", " : "", name_of(points[k * rtt_ms.size()].scheme), k);
    s += fmt::format(
        "set xtics ({})\nset ytics ({})\nset xrange [-0.5:{}]\nset yrange [-0.5:{}]\nset ylabel 'frames at {:g} Hz'\n", x, y,
        static_cast<double>(rtt_ms.size()) - 0.5, static_cast<double>(schemes) - 0.5, points[0].rate_hz);
    s += "set xlabel 'round trip [ms]'\n";
    const std::string file = quoted((out / sweep_file(points[0].rate_hz)).string());
    s += fmt::format(
        "plot {0} using 4:3:(0.5):(0.5):10 skip 1 with boxxyerror fs solid noborder fc palette, "
        "{0} using 4:3:11:12 skip 1 with labels tc rgb variable\n",
        file);
  }
  plot_script(out / "release_map.svg", 960, 70 + 330 * static_cast<int>(sweeps.size()), s + "unset multiplot\n");
}

void plot_decays(const std::filesystem::path& out, const std::vector<double>& decays_ms) {
  const std::vector<Scheme> schemes = available_schemes();
  std::vector<Panel> panels;
  for (const double rtt_ms : decays_ms) {
    // One legend for all panels.
    Panel panel{fmt::format("RTT {:g} ms: p-p [mm]", rtt_ms), {}, true, panels.empty() ? "set yrange [0.02:500]" : "unset key"};
    for (std::size_t k = 0; k < schemes.size(); ++k)
      panel.curves.push_back({fmt::format("1:{}", k + 2), std::string(name_of(schemes[k])), static_cast<int>(k) + 1,
                              out / decay_file(rtt_ms), "linespoints"});
    panels.push_back(panel);
  }
  plot_csv(out / decay_file(decays_ms[0]), out / "release_decay.svg", "After the grip is let go: motion in windows of 0.3 s",
           "time since the release [s]", panels);
}

Json sweep_summary(const ReleaseSweep& sweep) {
  Json json;
  for (const RateSweep& points : sweep.rates)
    for (const ReleasePoint& p : points) {
      Json windows_mm = Json::array();
      for (const double w : p.verdict.peak_to_peak_m) windows_mm.push_back(w * 1e3);
      json["schemes"][std::string(name_of(p.scheme))].push_back({{"rtt_ms", p.rtt_ms},
                                                                 {"rate_hz", p.rate_hz},
                                                                 {"stable", p.verdict.stable ? 1 : 0},
                                                                 {"lost", p.lost ? 1 : 0},
                                                                 {"growth_1_s", p.verdict.growth_1_s},
                                                                 {"peak_to_peak_mm", windows_mm}});
    }
  for (std::size_t k = 0; k < sweep.damping_n_s_m.size(); ++k)
    if (std::isfinite(sweep.damping_n_s_m[k]))
      json["damping_needed_n_s_m"][std::string(name_of(available_schemes()[k]))] = sweep.damping_n_s_m[k];
  return json;
}

}  // namespace

double ReleasePoint::last_m() const {
  const auto& p = verdict.peak_to_peak_m;
  return *std::max_element(p.end() - static_cast<std::ptrdiff_t>(std::min<std::size_t>(2, p.size())), p.end());
}

ReleaseSweep sweep_release(const Scene& scene, const ReleaseOptions& base, bool quick, const std::filesystem::path& out) {
  const Plan plan = plan_of(quick);
  ReleaseSweep sweep;
  for (const Grid& grid : plan.grids) {
    sweep.rates.push_back(sweep_rate(scene, base, grid));
    write_points(out / sweep_file(grid.rate_hz), sweep.rates.back());
  }
  for (const double rtt_ms : plan.decays_ms) write_decay(out / decay_file(rtt_ms), sweep.rates[0], rtt_ms);
  plot_map(out, sweep.rates);
  plot_decays(out, plan.decays_ms);
  if (plan.damping) {
    sweep.damping_n_s_m = find_damping(scene, base, plan.grids[0].rate_hz);
    std::string csv = "scheme,damping_n_s_m\n";
    for (std::size_t k = 0; k < sweep.damping_n_s_m.size(); ++k)
      csv += fmt::format("{},{:g}\n", name_of(available_schemes()[k]), sweep.damping_n_s_m[k]);
    write_text(out / "damping.csv", csv);
  }
  write_json(out / "summary.json", sweep_summary(sweep));
  return sweep;
}

void print_sweep(const ReleaseSweep& sweep) {
  fmt::print("\nMotion left in the last 0.6 s of the run [mm, peak to peak]; ! = not stable\n");
  for (const RateSweep& points : sweep.rates) {
    fmt::print("\n  {:>4g} Hz, RTT [ms]", points[0].rate_hz);
    for (const ReleasePoint& p : points)
      if (p.scheme == points[0].scheme) fmt::print("{:>8g}", p.rtt_ms);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const ReleasePoint& p = points[i];
      if (i == 0 || points[i - 1].scheme != p.scheme) fmt::print("\n  {:<16}", name_of(p.scheme));
      fmt::print("{:>8}",
                 p.lost ? "lost !"
                        : fmt::format("{:.{}f}{}", p.last_m() * 1e3, p.last_m() < 0.01 ? 2 : 0, p.verdict.stable ? "  " : " !"));
    }
    fmt::print("\n");
  }
  if (!sweep.damping_n_s_m.empty()) fmt::print("\n  Friction of the device with which it comes to rest at no delay [N s/m]:");
  for (std::size_t k = 0; k < sweep.damping_n_s_m.size(); ++k)
    fmt::print("{} {} {:g}", k > 0 ? "," : "", name_of(available_schemes()[k]), sweep.damping_n_s_m[k]);
  fmt::print("\n\n");
}

void write_release(const std::filesystem::path& file, const Scene& scene, const ReleaseResult& r) {
  const Vec3 into = into_body(scene), home = r.loop.ticks[0].position;
  std::string csv = "t_s,depth_mm,x_mm,y_mm,z_mm,speed_m_s,push_n,fx_n,fy_n,fz_n,patch_age_ms,kinetic_mj,display_mj\n";
  for (std::size_t i = 0; i < r.loop.ticks.size(); ++i) {
    const LoopTick& t = r.loop.ticks[i];
    const Vec3 moved = 1e3 * (t.position - home);
    fmt::format_to(std::back_inserter(csv),
                   "{:.3f},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:g},{:.6g},{:.6g}\n",
                   static_cast<double>(i) * 1e-3 - kReleaseS, moved.dot(into), moved.x(), moved.y(), moved.z(), t.velocity.norm(),
                   -t.force.dot(into), t.force.x(), t.force.y(), t.force.z(), seconds(t.patch_age) * 1e3, 1e3 * t.kinetic_j,
                   1e3 * t.display_j);
  }
  write_text(file, csv);
}

}  // namespace palpate
