#include "bench/lab/bode_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <set>

#include "bench/output/output.hpp"
#include "bench/output/plot.hpp"

namespace palpate {
namespace {

double degrees(Complex z) { return std::arg(z) * 180 / std::numbers::pi; }

void write_curves(const std::filesystem::path& out, const PortStudy& study) {
  for (const PortModel& m : study.models) {
    std::string csv = "frequency_hz,normal_n_m,normal_deg,tangential_n_m,tangential_deg,cross_n_m,cross_deg,rel_error\n";
    for (std::size_t i = 0; i < m.response.value.size(); ++i) {
      const PortEntries e = port_entries(m.response.value[i]);
      fmt::format_to(std::back_inserter(csv), "{:.6g},{:.9g},{:.6f},{:.9g},{:.6f},{:.4g},{:.3f},{:.6g}\n",
                     m.response.frequency_hz[i], std::abs(e.normal), degrees(e.normal), std::abs(e.tangential),
                     degrees(e.tangential), std::abs(e.cross), degrees(e.cross), m.error[i]);
    }
    write_text(out / (m.name + ".csv"), csv);
  }
  std::string csv = "state,hankel_n_m\n";
  for (Eigen::Index i = 0; i < study.hankel.size(); ++i) csv += fmt::format("{},{:.6g}\n", i + 1, study.hankel[i]);
  write_text(out / "hankel.csv", csv);
}

void write_map(const std::filesystem::path& out, const std::vector<MapPoint>& map) {
  std::string csv = "damping_n_s_m,damping_ratio,order,rel_error,rel_bound\n";
  for (const MapPoint& p : map)
    csv += fmt::format("{:.6g},{:.6g},{},{:.6g},{:.6g}\n", p.damping_n_s_m, p.damping_ratio, p.order, p.error, p.bound);
  write_text(out / "map.csv", csv);
  csv = "damping_n_s_m,damping_ratio,order_for_one_per_cent\n";
  for (const OrderNeeded& n : orders_needed(map, kOnePerCent))
    csv += fmt::format("{:.6g},{:.6g},{}\n", n.damping_n_s_m, n.damping_ratio, n.order > 0 ? std::to_string(n.order) : "nan");
  write_text(out / "map-one-per-cent.csv", csv);
}

struct Drawn {
  const PortModel* model;
  int type;            ///< line type, 8 = reference
  std::string dash{};  ///< gnuplot dash type, empty: solid
};

std::string curves(const std::filesystem::path& out, const std::vector<Drawn>& drawn, const std::string& columns) {
  std::string s = "plot ";
  for (const Drawn& d : drawn)
    s += fmt::format("{}{} using {} skip 1 with lines lt {} {}", d.model == drawn.front().model ? "" : ", ",
                     quoted((out / (d.model->name + ".csv")).string()), columns, d.type, d.dash);
  return s + "\n";
}

/// Draws magnitudes above phases: normal, tangential; the cross term's magnitude with the legend below it.
void figure(const std::filesystem::path& out, const std::string& file, const std::string& title,
            const std::vector<Drawn>& drawn) {
  constexpr int kWidth = 960, kHeight = 560;
  const auto& f = drawn.front().model->response.frequency_hz;
  std::string s = fmt::format(
      "set multiplot layout 2,3 title {} font ',15'\nset lmargin 8\nset rmargin 1.5\nset logscale x\nset format x '10^{{%T}}'\n"
      "set xrange [{}:{}]\nset ytics 10\nunset key\n",
      quoted(title), f.front(), f.back());
  const std::string decibels = "1:(20*log10(${}))";
  s += "set title 'normal to normal'\nset ylabel 'magnitude [dB re 1 N/m]'\n" +
       curves(out, drawn, fmt::format(fmt::runtime(decibels), 2));
  s += "set title 'tangential to tangential'\nunset ylabel\n" + curves(out, drawn, fmt::format(fmt::runtime(decibels), 4));
  s += "set title 'normal to tangential'\nset ytics 100\nset yrange [-400:100]\n" + curves(out, drawn, "1:(20*log10($6+1e-18))");
  s += "unset title\nset yrange [*:*]\nset ytics 45\nset ylabel 'phase [degrees]'\nset xlabel 'frequency [Hz]'\n" +
       curves(out, drawn, "1:3");
  s += "unset ylabel\n" + curves(out, drawn, "1:5");
  s += "unset border\nunset tics\nunset xlabel\nunset logscale\nset xrange [0:1]\nset yrange [0:1]\n"
       "set key center center vertical Left reverse samplen 3 spacing 1.4\nplot ";
  for (const Drawn& d : drawn)
    s += fmt::format("{}NaN with lines lt {} {} title {}", d.model == drawn.front().model ? "" : ", ", d.type, d.dash,
                     quoted(fmt::format("{} ({} states)", d.model->title, d.model->states)));
  plot_script(out / file, kWidth, kHeight, s + "\nunset multiplot\n");
}

/// Models of these names that the study contains, the whole body first.
std::vector<Drawn> pick(const PortStudy& study, const std::vector<std::string>& names) {
  const char* dashes[] = {"", "dt '-'", "dt '.'", "dt '-.'", "dt '_'"};
  std::vector<Drawn> drawn{{&study.full(), 8}};
  int type = 1;
  for (const std::string& name : names)
    if (const PortModel* m = study.find(name)) {
      drawn.push_back({m, type, fmt::format("lw 2.2 {}", dashes[type % 5])});
      ++type;
    }
  return drawn;
}

void plot_errors(const std::filesystem::path& out, const PortStudy& study) {
  const auto& f = study.full().response.frequency_hz;
  std::string s = fmt::format(
      "set title 'Relative error at the port, by frequency' font ',15'\nset lmargin 9\nset logscale xy\nset format '10^{{%T}}'\n"
      "set xrange [{}:{}]\nset yrange [1e-8:10]\nset ytics 100\nset xlabel 'frequency [Hz]'\n"
      "set ylabel 'largest error over largest force [-]'\nset key outside right top vertical Left reverse samplen 2\n"
      "set object 1 rectangle from 10,graph 0 to 1000,graph 1 fc rgb '#f2f2f2' fs solid noborder behind\n"
      "set label 1 'alone between frames' at 100,graph 0.96 center textcolor rgb '#666666'\nplot ",
      f.front(), f.back());
  int type = 0;
  for (const char* name :
       {"ring-1", "ring-4", "two-layer", "condensed-1", "port-3-moments", "port", "balanced-10", "balanced-20"}) {
    const PortModel* m = study.find(name);
    if (!m) continue;
    s += fmt::format("{}{} using 1:($8>0?$8:1e-17) skip 1 with lines lt {} lw 2 title {}", type > 0 ? ", " : "",
                     quoted((out / (m->name + ".csv")).string()), type + 1, quoted(fmt::format("{} ({})", m->name, m->states)));
    ++type;
  }
  constexpr int kWidth = 960, kHeight = 460;
  if (type > 0) plot_script(out / "error.svg", kWidth, kHeight, s + "\n");
}

/// Draws error over order and damping, one box each.
void plot_map(const std::filesystem::path& out, const std::vector<MapPoint>& map) {
  std::set<int> orders;
  std::set<double> ratios;
  for (const MapPoint& p : map) {
    orders.insert(p.order);
    ratios.insert(p.damping_ratio);
  }
  const double half_order = 0.5 * (*std::next(orders.begin()) - *orders.begin());
  const double half_ratio = 0.5 * std::log10(*std::next(ratios.begin()) / *ratios.begin());
  const std::string csv = quoted((out / "map.csv").string()), line = quoted((out / "map-one-per-cent.csv").string());
  std::string s = "set title 'Relative H-infinity error of balanced truncation of the sheet' font ',15'\n" + map_palette();
  s += fmt::format(
      "set xlabel 'states'\nset ylabel 'damping b / sqrt(k m) [-]'\nset cblabel 'relative error [-]'\nset logscale y\n"
      "set logscale cb\nset cbrange [1e-6:1]\nset format cb '10^{{%T}}'\nset xrange [{}:{}]\nset yrange [{}:{}]\nunset grid\n"
      "set style fill solid 1 noborder\nset key outside bottom center horizontal\n",
      *orders.begin() - half_order, *orders.rbegin() + half_order, *ratios.begin() * std::pow(10, -half_ratio),
      *ratios.rbegin() * std::pow(10, half_ratio));
  s += fmt::format(
      "plot {0} using 3:2:($3-{1}):($3+{1}):($2*10**-{2}):($2*10**{2}):($4<1e-6?1e-6:$4) skip 1 with boxxyerror fc palette "
      "notitle, "
      "{3} using 3:2 skip 1 with linespoints lc rgb '#009e73' lw 3 pt 7 title 'fewest states with 1 % or less', "
      "'+' using (10):(1.5811) every ::0::0 with points pt 4 ps 1.6 lw 3 lc rgb '#0072b2' title '10 states at k = 100 N/m, "
      "b = 0.5 N s/m, m = 1 g'\n",
      csv, half_order, half_ratio, line);
  constexpr int kWidth = 960, kHeight = 560;
  plot_script(out / "map.svg", kWidth, kHeight, s);
}

}  // namespace

PortEntries port_entries(const ComplexMatrix& g) {
  const Eigen::Index n = g.rows() - 1;
  return {g(n, n), g(0, 0), g(n, 0)};
}

double decibels(double ratio) { return 20 * std::log10(std::max(ratio, 1e-300)); }

double largest_cross(const PortModel& model) {
  double worst = 0;
  for (const ComplexMatrix& g : model.response.value) worst = std::max(worst, std::abs(port_entries(g).cross));
  return worst;
}

void write_bode(const std::filesystem::path& out, const BodeRun& run) {
  write_curves(out, run.study);
  if (!run.map.empty()) write_map(out, run.map);
}

void plot_bode(const std::filesystem::path& out, const BodeRun& run) {
  const PortStudy& study = run.study;
  const auto balanced =
      std::find_if(study.models.begin(), study.models.end(), [](const PortModel& m) { return m.name.starts_with("balanced-"); });
  if (balanced != study.models.end())
    figure(out, "bode.svg", "Whole body and balanced truncation", pick(study, {balanced->name}));
  const PortModel* ring = study.find("ring-1");
  // Balanced model with as many states as the ring, or the nearest requested number.
  const PortModel* same = nullptr;
  const auto distance = [&](const PortModel& m) { return std::abs(static_cast<int>(m.states) - static_cast<int>(ring->states)); };
  for (const PortModel& m : study.models)
    if (ring && m.name.starts_with("balanced-") && (!same || distance(m) < distance(*same))) same = &m;
  if (ring) figure(out, "ring.svg", "The ring around the instrument", pick(study, {"ring-1", same ? same->name : ""}));
  figure(out, "layers.svg", "Rings of one to four layers", pick(study, {"ring-1", "ring-2", "ring-3", "ring-4"}));
  figure(out, "local.svg", "Local models with the right stiffness at rest",
         pick(study, {"two-layer", "condensed-1", "port", same ? same->name : ""}));
  plot_errors(out, study);
  if (!run.map.empty()) plot_map(out, run.map);
}

}  // namespace palpate
