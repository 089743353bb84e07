// Tears and threads against closed forms. `cells` are those over 20 mm: 2, 4 and 8 are spacings of 10, 5 and 2.5 mm. Tears are
// looked at as in a room of 20 Hz.
//
//   double cantilever, energy   G of the next row, over that of beams, P^2 l^2 / (b E I), l = a + h / 2 + 0.67 H (Williams,
//   1989),
//                               and over P^2 / (2 b) dC/da of the bodies with both lengths of the cut, and of CalculiX
//                               (bench/calculix/README.md)
//   double cantilever, work     (W - dU) / A: J
//   trouser tear                force of a leg that folds by a right angle, J b / 2, and (W - dU) / A: J
//   thread around a bite        T_2 / T_1 = e^(mu pi)
//   thread that cuts            its force J d, and (W - dU) / length: J d
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "bench/tissue/pulled_body.hpp"
#include "bench/tissue/tissue_case.hpp"
#include "server/room/stepped_body.hpp"

namespace palpate {
namespace {

constexpr double kLegJ = 90, kLegThickM = 0.02;
constexpr double kThreadJ = 300, kThreadM = 0.001, kThreadMu = 0.2;

double spacing_m(int cells) { return 0.02 / cells; }

/// By which the compliance of the bar [m/N] grows where its cut of 80 mm does by a row; 0: not known.
double compliance_by_calculix(int cells) { return cells == 2 ? 0.07205 : cells == 4 ? 0.03419 : cells == 8 ? 0.01665 : 0; }

enum class EnergyBy { two_lengths, beams, calculix };

TissueSolution bar_energy(int cells, EnergyBy by) {
  constexpr double kCutM = 0.08, kForceN = 1e-5;
  const double h = spacing_m(cells);
  const Scene scene = double_cantilever(h, kCutM);
  const Dynamics now(scene.body);
  const auto row = TearRow::ahead(*scene.tearing, {0, CutEnd::last});
  if (!row) throw std::runtime_error("the cut of a double cantilever has no row ahead");
  const OpenedArms before = opened_arms(now, kForceN);
  BodyState state = now.rest_state();
  state.x += before.u;
  const double release = row->release_j_m2(now, Skin(scene.body, 0), state, {});
  const auto over_growth = [&](double wider_m) {
    return TissueSolution{now.nodes(), release / (kForceN * wider_m / (2 * DoubleCantilever::kBroadM * h))};
  };
  if (by == EnergyBy::calculix) return over_growth(compliance_by_calculix(cells) * kForceN);
  if (by == EnergyBy::two_lengths) {
    const Scene cut_on = double_cantilever(h, kCutM + h);
    return over_growth(opened_arms(Dynamics(cut_on.body), kForceN).apart_m - before.apart_m);
  }
  const double inertia = DoubleCantilever::kBroadM * std::pow(DoubleCantilever::kArmM, 3) / 12,
               length_m = kCutM + 0.5 * h + 0.67 * DoubleCantilever::kArmM;
  return {now.nodes(),
          release / (std::pow(kForceN * length_m, 2) / (DoubleCantilever::kBroadM * DoubleCantilever::kYoungPa * inertia))};
}

TissueSolution bar_work(int cells, double speed_m_s) {
  constexpr double kWayM = 0.03, kRestS = 0.3;
  const double h = spacing_m(cells);
  PulledBody bar = pulled_arms(h, 0.06, [=](double t) { return std::min(speed_m_s * t, kWayM); });
  while (bar.time_s() < kRestS + kWayM / speed_m_s) bar.frame(bar.due_s());
  return {bar.scene().body.nodes.size(), (bar.work_j() - bar.energy_j()) / (bar.cells() * h * h)};
}

/// Tears the legs of a sheet apart at both grips, until the legs have folded and the tear is longer by 100 mm.
TissueSolution legs(int cells, bool force) {
  // The grip of a leg goes up by what the tear is longer: 2 F da = J b da.
  constexpr double kLegM = 0.03, kLongM = 0.3, kFirstM = 0.123;
  const double h = spacing_m(cells), speed_m_s = cells > 2 ? 0.03 : 0.015;
  const auto nodes = [&](double extent_m) { return 1 + static_cast<int>(std::lround(extent_m / h)); };
  Scene scene =
      read_scene(fmt::format(R"({{"body": {{"lattice": {{"nodes": [{}, {}, {}], "size_m": [{}, {}, {}], "fixed_faces": ["x+"],
        "solid": {{"young_pa": 30000, "poisson": 0.4, "damping_s": 0.002}}}},
        "cuts": [{{"path": [{{"at_m": [-0.01, {}, -0.01]}}, {{"at_m": [{}, {}, -0.01]}}], "direction": [0, 0, 1], "depth_m": 0.04}}],
        "tissue": [{{"toughness_j_m2": {}}}], "tears": true}}, "tool": {{"contact": "attach"}}}})",
                             nodes(kLongM), nodes(2 * kLegM), nodes(kLegThickM), kLongM, 2 * kLegM, kLegThickM, kLegM, kFirstM,
                             kLegM, kLegJ),
                 "sheet");
  std::vector<std::uint32_t> held;  // at half of the thickness: hinges
  for (std::uint32_t i = 0; i < scene.tearing->uncut().nodes.size(); ++i) {
    const Vec3& x = scene.body.nodes[i];
    if (x.x() < 1e-9 && std::abs(x.y() - kLegM) > 1e-9 && std::abs(x.z() - 0.5 * kLegThickM) < 1e-9) held.push_back(i);
  }
  PulledBody sheet = gripped(std::move(scene), held, [=](const Vec3& rest, double t) {
    return Vec3(rest + speed_m_s * t * Vec3(1, 0, rest.y() < kLegM ? 1 : -1));
  });
  struct Torn {
    double way_m, work_j, energy_j, area_m2;
  };
  std::vector<Torn> rows;
  while (rows.empty() || rows.back().area_m2 < 0.1 * kLegThickM) {
    if (sheet.time_s() > 20) throw std::runtime_error("the legs of a sheet do not tear");
    if (sheet.frame(sheet.due_s()))
      rows.push_back({speed_m_s * sheet.time_s(), sheet.work_j(), sheet.energy_j(), sheet.cells() * h * h});
  }
  const Torn &from = rows[rows.size() / 2 - 1], &to = rows.back();  // before, the legs are not folded yet
  const double work_j = to.work_j - from.work_j;
  return {sheet.scene().body.nodes.size(),
          force ? work_j / (2 * (to.way_m - from.way_m)) : (work_j - to.energy_j + from.energy_j) / (to.area_m2 - from.area_m2)};
}

/// A block of 80 x 40 x 40 mm whose lower face is held, with a thread from x = 20 mm on, tied there, through another bite, to a
/// hand that moves by a way.
class Sewn {
 public:
  Sewn(int cells, double bite_x_m, double tissue_j_m2, double mu)
      : scene_(read_scene(
            fmt::format(R"({{"body": {{"lattice": {{"nodes": [{0}, {1}, {1}], "size_m": [0.08, 0.04, 0.04], "fixed_faces": ["z-"],
        "solid": {{"young_pa": 20000, "poisson": 0.4, "damping_s": 0.01}}}}, "tissue": [{{"toughness_j_m2": {2}}}],
        "sutures": [{{"name": "thread", "bites": [{{"at_m": [0.0212, 0.0203, 0.0307]}}, {{"at_m": [{3}, 0.0203, 0.0307]}}],
          "radius_m": {4}, "mu": {5}, "drag_n": 0, "tail_m": 0.01}}]}}, "tool": {{"contact": "touch", "holds": ["thread"]}}}})",
                        1 + 4 * cells, 1 + 2 * cells, tissue_j_m2, bite_x_m, 0.5 * kThreadM, mu),
            "block")),
        body_(scene_) {
    body_.start(now_);
  }
  /// Moves the hand on by a frame.
  void frame(const Vec3& to) {
    FrameJob job;
    job.target = now_ + kFrame;
    job.may_sleep = false;
    StationJob& hand = job.stations.emplace_back();
    hand.id = 1;
    for (Micros t = now_; t <= job.target + kTick; t += kTick)
      hand.samples.push_back({t, at_ + seconds(t - now_) / seconds(kFrame) * (to - at_)});
    const Vec3 before = force();
    const auto report = body_.step(job);
    if (!report || !report->converged) throw std::runtime_error("a block with a thread found no equilibrium");
    now_ = job.target;
    work_j_ -= 0.5 * (before + force()).dot(to - at_);
    at_ = to;
  }
  void begin_at(const Vec3& at) { at_ = at; }
  /// On the hand.
  Vec3 force() const { return body_.ports().empty() ? Vec3(Vec3::Zero()) : Vec3(-body_.ports().front().lambda); }
  SuturePull pull() const {
    const Sutures& sutures = body_.dynamics().sutures();
    return sutures.pull_of(body_.state(), 0, shape_of(scene_.body.sutures[0].law, sutures.place_of(body_.state(), 0)));
  }
  double torn_m() const { return body_.state().sutures->torn_m; }
  double kept_j() const { return work_j_ - body_.dynamics().energy(body_.state()); }
  std::size_t nodes() const { return scene_.body.nodes.size(); }
  static constexpr Micros kFrame{10'000};

 private:
  Scene scene_;
  SteppedBody body_;
  Micros now_{7'000'000};
  Vec3 at_ = Vec3::Zero();
  double work_j_ = 0;
};

TissueSolution capstan(int cells) {
  Sewn sewn(cells, 0.0607, 1e5, kThreadMu);
  const Vec3 begin(0.04, 0.0203, 0.0307);
  sewn.begin_at(begin);
  for (int k = 0; k <= 60; ++k) sewn.frame(begin - Vec3(0.0001 * k, 0, 0));
  const SuturePull pull = sewn.pull();
  return {sewn.nodes(), pull.tension_n[2] / pull.tension_n[1]};
}

TissueSolution thread_cuts(int cells, bool work) {
  constexpr double kPullMS = 0.01, kFirstM = 0.01, kLastM = 0.03;
  Sewn sewn(cells, 0.0607, kThreadJ, 0);
  const Vec3 begin(0.1, 0.0203, 0.0307);
  const double step_m = kPullMS * seconds(Sewn::kFrame);
  sewn.begin_at(begin);
  double sum_n = 0, first_j = 0, first_m = 0;
  int frames = 0;
  for (double way_m = 0; way_m < kLastM; way_m += step_m) {
    sewn.frame(begin + Vec3(way_m, 0, 0));
    if (way_m < kFirstM) {
      first_j = sewn.kept_j();
      first_m = sewn.torn_m();
    } else {
      sum_n += sewn.force().norm();
      ++frames;
    }
  }
  return {sewn.nodes(), work ? (sewn.kept_j() - first_j) / (sewn.torn_m() - first_m) : sum_n / frames};
}

}  // namespace

std::vector<TissueCase> tear_cases() {
  const auto add = [](const char* family, const char* name, const char* unit, double reference, const char* by,
                      std::vector<int> cells, const auto& solve) {
    return TissueCase{
        family, name, unit, reference, by, {TissueElement::hexahedron}, std::move(cells), [solve](TissueElement, int n) {
          return solve(n);
        }};
  };
  const std::vector<int> all = {2, 4, 8}, coarse = {2, 4};
  return {
      add("double cantilever", "double cantilever, energy by two lengths", "", 1, "P2/2b dC/da", all,
          [](int n) { return bar_energy(n, EnergyBy::two_lengths); }),
      add("double cantilever", "double cantilever, energy by CalculiX", "", 1, "CalculiX", all,
          [](int n) { return bar_energy(n, EnergyBy::calculix); }),
      add("double cantilever", "double cantilever, energy of beams", "", 1, "Williams", all,
          [](int n) { return bar_energy(n, EnergyBy::beams); }),
      add("double cantilever", "double cantilever, work per area, 10 mm/s", "J/m2", DoubleCantilever::kToughnessJM2, "J", all,
          [](int n) { return bar_work(n, 0.01); }),
      add("double cantilever", "double cantilever, work per area, 40 mm/s", "J/m2", DoubleCantilever::kToughnessJM2, "J", coarse,
          [](int n) { return bar_work(n, 0.04); }),
      add("trouser tear", "trouser tear, force of a leg", "N", 0.5 * kLegJ * kLegThickM, "J b / 2", coarse,
          [](int n) { return legs(n, true); }),
      add("trouser tear", "trouser tear, work per area", "J/m2", kLegJ, "J", coarse, [](int n) { return legs(n, false); }),
      add("thread", "thread around a bite, ratio", "", std::exp(kThreadMu * std::numbers::pi), "e^(mu pi)", all, capstan),
      add("thread", "thread that cuts, force", "N", kThreadJ * kThreadM, "J d", all, [](int n) { return thread_cuts(n, false); }),
      add("thread", "thread that cuts, work per length", "N", kThreadJ * kThreadM, "J d", all,
          [](int n) { return thread_cuts(n, true); })};
}

}  // namespace palpate
