#include "bench/lab/release_sweep.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <limits>

#include "bench/lab/flags.hpp"
#include "bench/lab/output.hpp"
#include "bench/lab/parallel.hpp"
#include "bench/lab/plot.hpp"

namespace palpate {
namespace {

constexpr double kLostMm = 300;  ///< what a lost tool counts as in plots

std::string sweep_file(double rate_hz) { return fmt::format("sweep_{:g}hz.csv", rate_hz); }
std::string decay_file(double rtt_ms) { return fmt::format("decay_{:g}ms.csv", rtt_ms); }

std::vector<double> round_trips(const std::vector<SweepPoint>& points) {
  std::vector<double> rtt_ms;
  for (const SweepPoint& p : points)
    if (p.scheme == points[0].scheme) rtt_ms.push_back(p.rtt_ms);
  return rtt_ms;
}

void write_points(const std::filesystem::path& file, const std::vector<SweepPoint>& points) {
  const std::vector<double> rtt_ms = round_trips(points);
  std::string csv = "scheme,rtt_ms,scheme_no,rtt_no,stable,lost,growth_1_s,display_min_j,last_mm,shown_mm,label,text_colour\n";
  for (std::size_t i = 0; i < points.size(); ++i) {
    const SweepPoint& p = points[i];
    const double last_mm = p.last_m() * 1e3, shown_mm = p.lost ? kLostMm : std::clamp(last_mm, 0.01, kLostMm);
    constexpr double kDarkAboveMm = 4;
    fmt::format_to(std::back_inserter(csv), "{},{:g},{},{},{},{},{:.4g},{:.4g},{:.4g},{:.4g},{},{}\n", name_of(p.scheme),
                   p.rtt_ms, i / rtt_ms.size(), i % rtt_ms.size(), p.verdict.stable ? 1 : 0, p.lost ? 1 : 0, p.verdict.growth_1_s,
                   p.display_min_j, last_mm, shown_mm,
                   p.lost ? "lost" : fmt::format("{:.{}f}{}", last_mm, last_mm < 9.95 ? 1 : 0, p.verdict.stable ? "" : " !"),
                   shown_mm > kDarkAboveMm ? 0xffffff : 0x000000);
  }
  write_text(file, csv);
}

void write_decay(const std::filesystem::path& file, const std::vector<SweepPoint>& points, double rtt_ms) {
  std::string csv = "t_s";
  std::size_t windows = 0;
  for (const SweepPoint& p : points)
    if (p.rtt_ms == rtt_ms) {
      csv += fmt::format(",{}_mm", name_of(p.scheme));
      windows = std::max(windows, p.verdict.peak_to_peak_m.size());
    }
  csv += '\n';
  for (std::size_t k = 0; k < windows; ++k) {
    csv += fmt::format("{:g}", (static_cast<double>(k) + 0.5) * kWindowS);
    for (const SweepPoint& p : points)
      if (p.rtt_ms == rtt_ms)
        csv += k < p.verdict.peak_to_peak_m.size() ? fmt::format(",{:.4g}", p.verdict.peak_to_peak_m[k] * 1e3) : ",nan";
    csv += '\n';
  }
  write_text(file, csv);
}

}  // namespace

double SweepPoint::last_m() const {
  const auto& p = verdict.peak_to_peak_m;
  return *std::max_element(p.end() - static_cast<std::ptrdiff_t>(std::min<std::size_t>(2, p.size())), p.end());
}

std::vector<SweepPoint> sweep_release(const Scene& scene, const ReleaseOptions& base, const SweepGrid& grid) {
  std::vector<SweepPoint> points;
  for (const Scheme scheme : available_schemes())
    for (const double rtt_ms : grid.rtt_ms) points.push_back({scheme, grid.rate_hz, rtt_ms, {}, false, 0});
  run_all(points.size(), [&](std::size_t i) {
    SweepPoint& p = points[i];
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

void write_sweep(const std::filesystem::path& out, const std::vector<SweepPoint>& points, const std::vector<double>& decays_ms) {
  write_points(out / sweep_file(points[0].rate_hz), points);
  for (const double rtt_ms : decays_ms) write_decay(out / decay_file(rtt_ms), points, rtt_ms);
}

bool plot_sweep(const std::filesystem::path& out, const std::filesystem::path& svg,
                const std::vector<std::vector<SweepPoint>>& sweeps) {
  std::string s = fmt::format("set multiplot layout {},1 title {} font ',15'\n", sweeps.size(),
                              quoted("After the grip is let go: motion left, peak to peak [mm], in the last 0.6 s"));
  s += map_palette() + "set logscale cb\nset cbrange [0.03:300]\nset cblabel 'motion left [mm]'\nunset grid\nunset key\n";
  s += "set lmargin 12\nset rmargin 14\n";
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
    s += fmt::format("plot {0} using 4:3:10 skip 1 with image, {0} using 4:3:11:12 skip 1 with labels tc rgb variable\n", file);
  }
  return plot_script(svg, 960, 70 + 330 * static_cast<int>(sweeps.size()), s + "unset multiplot\n");
}

bool plot_decays(const std::filesystem::path& out, const std::filesystem::path& svg, const std::vector<double>& decays_ms) {
  const std::vector<Scheme> schemes = available_schemes();
  std::vector<Panel> panels;
  for (const double rtt_ms : decays_ms) {
    Panel panel{fmt::format("RTT {:g} ms: p-p [mm]", rtt_ms), {}, true, "set yrange [0.02:500]"};
    for (std::size_t k = 0; k < schemes.size(); ++k)
      panel.curves.push_back({fmt::format("1:{}", k + 2), std::string(name_of(schemes[k])), static_cast<int>(k) + 1,
                              out / decay_file(rtt_ms), "linespoints"});
    panels.push_back(panel);
  }
  return plot_csv(out / decay_file(decays_ms[0]), svg, "After the grip is let go: motion in windows of 0.3 s",
                  "time since the release [s]", panels);
}

}  // namespace palpate
