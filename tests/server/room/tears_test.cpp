// Tears: the energy that a row of cells gives against closed forms, what a tear takes, where it does not go.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "common/base/error.hpp"
#include "common/base/random.hpp"
#include "server/dynamics/integrator.hpp"
#include "server/room/live_cuts.hpp"
#include "server/room/room.hpp"
#include "server/room/stepped_body.hpp"
#include "server/room/tool_coupling.hpp"
#include "server/scene/grid.hpp"
#include "server/scene/surface.hpp"
#include "server/solve/linear_solver.hpp"

using namespace palpate;

namespace {

constexpr double kArmM = 0.02, kBroadM = 0.02, kBeamM = 0.16, kBeamPa = 200000, kBeamJ = 2;

/// A bar along x, held at its far end, with a cut of `cut_m` along its middle: two arms.
Scene double_cantilever(double spacing_m, double cut_m, const std::string& more = "", const std::string& element = "hexahedron") {
  const auto nodes = [&](double extent_m) { return 1 + static_cast<int>(std::lround(extent_m / spacing_m)); };
  return read_scene(fmt::format(R"({{"body": {{"lattice": {{"nodes": [{}, {}, {}], "size_m": [{}, {}, {}], "fixed_faces": ["x+"],
        "solid": {{"element": "{}", "young_pa": {}, "poisson": 0.4, "law": "corotational", "damping_s": 0.002}}}},
        "cuts": [{{"path": [{{"at_m": [-0.01, -0.01, {}]}}, {{"at_m": [{}, -0.01, {}]}}], "direction": [0, 1, 0], "depth_m": 0.04}}],
        "tissue": [{{"toughness_j_m2": {}}}], "tears": true{}}}, "tool": {{"contact": "attach"}}}})",
                                nodes(kBeamM), nodes(kBroadM), 2 * nodes(kArmM) - 1, kBeamM, kBroadM, 2 * kArmM, element, kBeamPa,
                                kArmM, cut_m + 0.3 * spacing_m, kArmM, kBeamJ, more),
                    "bar");
}

/// Nodes at the ends of both arms: +1 above, -1 below. Those that a cut has copied have none.
std::vector<std::pair<std::uint32_t, int>> ends_of(const LumpedBody& body) {
  std::vector<std::pair<std::uint32_t, int>> ends;
  for (std::uint32_t i = 0; i < body.nodes.size(); ++i) {
    const Vec3& x = body.nodes[i];
    if (x.x() < 1e-9 && (x.z() < 1e-9 || x.z() > 2 * kArmM - 1e-9)) ends.emplace_back(i, x.z() > kArmM ? 1 : -1);
  }
  return ends;
}

/// Displacements of the ends by a force on each arm, and their distance; small ones.
struct Opened {
  Vector u;
  double apart_m = 0;
};
Opened opened(const Dynamics& dynamics, double force_n) {
  const auto ends = ends_of(dynamics.body());
  Opened result{Vector::Zero(dynamics.masses().size())};
  Vector load = result.u;
  for (const auto& [node, side] : ends) at_node(load, node).z() = 2 * side * force_n / static_cast<double>(ends.size());
  BlockMatrix k = dynamics.make_matrix();
  dynamics.assemble(dynamics.rest_state(), 0, 0, 1, dynamics.body().fixed, false, k);
  LinearSolver solver(dynamics.nodes(), LinearSolver::Method::direct);
  REQUIRE(solver.factorise(k));
  solver.solve(load, 1e-12, result.u);
  for (const auto& [node, side] : ends)
    result.apart_m += 2 * side * at_node(result.u, node).z() / static_cast<double>(ends.size());
  return result;
}

/// A body with tools that move as they are told.
class Pulled {
 public:
  using Motion = std::function<ToolAt(const ToolPort& port, double time_s)>;
  Pulled(Scene scene, std::vector<ToolPort> ports, Motion motion)
      : scene_(std::move(scene)), motion_(std::move(motion)), ports_(std::move(ports)) {}
  /// Moves on by a frame and lets the body tear. Returns true if it did.
  bool frame(double length_s) {
    std::vector<Vec3> force, place;
    for (const ToolPort& port : ports_) {
      force.push_back(port.lambda);
      place.push_back(motion_(port, state_.time_s).position);
    }
    const auto tools = [&](std::size_t k, double t) { return motion_(ports_[k], t); };
    REQUIRE(integrator_->advance(state_, ports_, state_.time_s + length_s, tools).converged);
    for (std::size_t k = 0; k < ports_.size(); ++k)
      work_j += 0.5 * (force[k] + ports_[k].lambda).dot(motion_(ports_[k], state_.time_s).position - place[k]);
    const double energy_before_j = energy_j();
    const Vec3 momentum_before = momentum();
    if (!cuts_.cut_on()) return false;
    CHECK(energy_j() == Approx(energy_before_j).epsilon(1e-11));
    CHECK((momentum() - momentum_before).norm() <= 1e-11 * dynamics_->masses().sum());
    for (std::size_t k = 1; k < cuts_.parted().cell_before.size(); ++k)
      cells += cuts_.parted().cell_before[k] == cuts_.parted().cell_before[k - 1];
    integrator_.emplace(*dynamics_, skin_, options_);
    return true;
  }
  double energy_j() const { return dynamics_->energy(state_); }
  Vec3 momentum() const {
    Vec3 sum = Vec3::Zero();
    for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i) sum += dynamics_->masses()[3 * i] * at_node(state_.v, i);
    return sum;
  }
  double time_s() const { return state_.time_s; }
  const Scene& scene() const { return scene_; }
  const BodyState& state() const { return state_; }
  const std::vector<ToolPort>& ports() const { return ports_; }
  double work_j = 0;  ///< of the tools
  int cells = 0;      ///< that have torn

 private:
  static constexpr IntegratorOptions options_{.step_s = 0.01, .tolerance_m = 1e-8};
  Scene scene_;
  Motion motion_;
  Skin skin_{scene_.body, scene_.tool.radius_m};
  std::unique_ptr<NeedleTissue> tissue_;
  std::optional<Dynamics> dynamics_{std::in_place, scene_.body};
  BodyState state_ = dynamics_->rest_state(), at_rest_ = state_;
  std::vector<ToolPort> ports_;
  std::optional<Integrator> integrator_{std::in_place, *dynamics_, skin_, options_};
  LiveCuts cuts_{BodyInParts{&scene_, &skin_, &tissue_, &dynamics_, &state_, &at_rest_, &ports_}};
};

/// A body whose nodes are held by grips: `grips` is where a node goes that was at rest there.
Pulled gripped(Scene scene, const std::vector<std::uint32_t>& held, std::function<Vec3(const Vec3& rest, double time_s)> grips) {
  std::vector<ToolPort> ports;
  for (const std::uint32_t node : held) {
    ToolPort& port = ports.emplace_back();
    port.kind = ContactKind::attach;
    port.node = node;
  }
  auto motion = [rest = scene.body.nodes, grips = std::move(grips)](const ToolPort& port, double t) {
    constexpr double kStepS = 1e-6;
    ToolAt at;
    at.position = grips(rest[port.node], t);
    at.velocity = (grips(rest[port.node], t + kStepS) - grips(rest[port.node], t - kStepS)) / (2 * kStepS);
    return at;
  };
  return Pulled(std::move(scene), std::move(ports), std::move(motion));
}

/// A double cantilever whose arms are pulled apart.
Pulled pulled_bar(double spacing_m, double cut_m, const std::function<double(double)>& apart_m, const std::string& more = "") {
  Scene scene = double_cantilever(spacing_m, cut_m, more);
  std::vector<std::uint32_t> held;
  for (const auto& [node, side] : ends_of(scene.body)) held.push_back(node);
  return gripped(std::move(scene), held, [=](const Vec3& rest, double t) {
    return Vec3(rest + (rest.z() > kArmM ? 0.5 : -0.5) * apart_m(t) * Vec3::UnitZ());
  });
}

}  // namespace

TEST_CASE("The energy that a row gives is that of a double cantilever", "[tears]") {
  const double spacing_m = GENERATE(0.01, 0.005);
  constexpr double kCutM = 0.08, kForceN = 1e-5;
  CAPTURE(spacing_m);
  const Scene scene = double_cantilever(spacing_m, kCutM), cut_on = double_cantilever(spacing_m, kCutM + spacing_m);
  const Dynamics now(scene.body), longer(cut_on.body);
  const Skin skin(scene.body, 0);
  const auto row = TearRow::ahead(*scene.tearing, {0, CutEnd::last});
  REQUIRE(row);
  CHECK(row->area_m2() == Approx(spacing_m * kBroadM).epsilon(1e-9));
  const Opened before = opened(now, kForceN), after = opened(longer, kForceN);
  BodyState state = now.rest_state();
  state.x += before.u;
  const double release = row->release_j_m2(now, skin, state, {});
  // G = P^2 / (2 b) dC/da, of the bodies with both lengths of the cut.
  const double by_compliance = kForceN * (after.apart_m - before.apart_m) / (2 * kBroadM * spacing_m);
  CHECK(release == Approx(by_compliance).epsilon(1e-3));
  // Of beams: C = 2 (a + chi h)^3 / (3 E I), chi = 0.67 for the roots (Williams, 1989).
  const double inertia = kBroadM * std::pow(kArmM, 3) / 12, length_m = kCutM + 0.5 * spacing_m + 0.67 * kArmM;
  const double of_beams = std::pow(kForceN * length_m, 2) / (kBroadM * kBeamPa * inertia);
  CHECK(release == Approx(of_beams).epsilon(0.2 * spacing_m / kArmM));
  // Pressed together, it gives nothing.
  state.x -= 2 * before.u;
  CHECK(row->release_j_m2(now, skin, state, {}) == 0);
}

namespace {

/// Work to tear a double cantilever at a speed, less what the body keeps, per area.
double work_of_tear_j_m2(double spacing_m, double speed_m_s) {
  constexpr double kWayM = 0.03;
  Pulled bar = pulled_bar(spacing_m, 0.06, [=](double t) { return std::min(speed_m_s * t, kWayM); });
  while (bar.time_s() < 0.3 + kWayM / speed_m_s)
    if (bar.frame(0.0125)) CHECK(check_edges(bar.scene().body.triangles).closed());
  const double area = bar.cells * spacing_m * spacing_m;
  CHECK(area > 2 * kBroadM * spacing_m);
  return (bar.work_j - bar.energy_j()) / area;
}

}  // namespace

TEST_CASE("What the hand does to tear a double cantilever, less what the body keeps, is the toughness", "[tears]") {
  const auto [spacing_m, speed_m_s] = GENERATE(table<double, double>({{0.01, 0.005}, {0.01, 0.02}, {0.005, 0.02}}));
  CAPTURE(spacing_m, speed_m_s);
  CHECK(work_of_tear_j_m2(spacing_m, speed_m_s) == Approx(kBeamJ).epsilon(0.05));
}

TEST_CASE("What the hand does to tear a double cantilever of fine cells is the toughness", "[.soak]") {
  CHECK(work_of_tear_j_m2(0.0025, 0.01) == Approx(kBeamJ).epsilon(0.05));
}

TEST_CASE("Tissue that is held does not tear below its toughness", "[tears]") {
  constexpr double kLoadedS = 1.5;
  double most_m = 0;
  Pulled until = pulled_bar(0.01, 0.06, [](double t) { return 0.01 * t; });
  while (!until.frame(0.0125)) most_m = 0.01 * until.time_s();
  Pulled bar = pulled_bar(0.01, 0.06, [&](double t) { return 0.96 * most_m * std::min(t / kLoadedS, 1.0); });
  while (bar.time_s() < kLoadedS + 3) CHECK_FALSE(bar.frame(0.0125));
  Pulled beyond = pulled_bar(0.01, 0.06, [&](double t) { return 1.04 * most_m * std::min(t / kLoadedS, 1.0); });
  while (beyond.time_s() < kLoadedS + 3) beyond.frame(0.0125);
  CHECK(beyond.cells == 2);
}

TEST_CASE("A clip on a cut keeps it closed, and stops a tear", "[tears]") {
  const std::string clip = R"(, "clips": [{"at_m": [0.1, 0.01, 0.02], "radius_m": 0.021, "stiffness_n_m": 1e6}])";
  const auto apart = [](double t) { return 0.01 * std::min(t, 4.0); };
  Pulled bare = pulled_bar(0.01, 0.06, apart), held = pulled_bar(0.01, 0.06, apart, clip);
  while (bare.time_s() < 4.2) bare.frame(0.05), held.frame(0.05);
  CHECK(bare.cells >= 12);
  CHECK(held.cells <= 8);  // to its middle, 100 mm from the end
  CHECK(held.cells >= 2);
}

/// Legs of a sheet that stands on its edge; jaws pinch one from both sides and pull it from the other.
Pulled pinched(double friction) {
  constexpr double kSpacing = 0.01;
  Scene scene =
      read_scene(fmt::format(R"({{"body": {{"lattice": {{"nodes": [3, 9, 9], "size_m": [{}, 0.08, 0.08], "fixed_faces": ["z-"],
        "solid": {{"young_pa": 40000, "poisson": 0.4, "damping_s": 0.01}}}},
        "cuts": [{{"path": [{{"at_m": [-0.01, 0.04, 0.09]}}, {{"at_m": [-0.01, 0.04, 0.033]}}], "direction": [1, 0, 0], "depth_m": 0.04}}],
        "tissue": [{{"toughness_j_m2": 10}}], "tears": true}},
        "tool": {{"contact": "touch", "mu": {}, "body": {{"jaws": {{"hinge_z_m": 0.2, "open_deg": 11.5}}, "spheres": [
          {{"center_m": [0.01, 0, 0.004], "radius_m": 0.004, "jaw": 1}}, {{"center_m": [0.01, 0, 0.016], "radius_m": 0.004, "jaw": 1}},
          {{"center_m": [-0.01, 0, 0.004], "radius_m": 0.004, "jaw": -1}}, {{"center_m": [-0.01, 0, 0.016], "radius_m": 0.004, "jaw": -1}}]}}}}}})",
                             2 * kSpacing, friction),
                 "strip");
  ToolPort port;
  port.parameters = {scene.tool.contact_stiffness_n_m, friction};
  std::vector<ToolPort> ports = parts_of(scene.tool.shape, nullptr, port);
  return Pulled(std::move(scene), std::move(ports), [](const ToolPort& of, double t) {
    TurningTool at;
    at.at.position = Vec3(0.01, 0.03 - 0.01 * std::clamp(t - 0.6, 0.0, 2.0), 0.08 - 0.02);
    at.opening = std::max(0.0, 0.4 - t);
    return at.centre_of(of.sphere);
  });
}

TEST_CASE("Jaws slip off a leg before it tears where their friction bears less than the tear", "[tears]") {
  const auto pull = [](Pulled& sheet) {
    double most_n = 0;
    while (sheet.time_s() < 2.6) {
      sheet.frame(0.025);
      double sum = 0;
      for (const ToolPort& port : sheet.ports()) sum -= port.lambda.y();
      most_n = std::max(most_n, sum);
    }
    return most_n;
  };
  Pulled loose = pinched(0.05), firm = pinched(1.0);
  const double slips_n = pull(loose), tears_n = pull(firm);
  CAPTURE(slips_n, tears_n, loose.cells, firm.cells);
  CHECK(loose.cells == 0);
  CHECK(firm.cells >= 2);
  CHECK(slips_n < 0.5 * tears_n);
}

namespace {

/// Tears the legs of a sheet apart at both grips, until the legs have folded and the tear is longer by 100 mm.
void tear_legs(double spacing_m, double speed_m_s) {
  // A leg folds by a right angle: its grip goes up by what the tear is longer. 2 F da = J b da.
  constexpr double kLegM = 0.03, kThickM = 0.02, kLongM = 0.3, kJ = 90, kFirstM = 0.123;
  const auto nodes = [&](double extent_m) { return 1 + static_cast<int>(std::lround(extent_m / spacing_m)); };
  Scene scene = read_scene(
      fmt::format(R"({{"body": {{"lattice": {{"nodes": [{}, {}, {}], "size_m": [{}, {}, {}], "fixed_faces": ["x+"],
        "solid": {{"young_pa": 30000, "poisson": 0.4, "damping_s": 0.002}}}},
        "cuts": [{{"path": [{{"at_m": [-0.01, {}, -0.01]}}, {{"at_m": [{}, {}, -0.01]}}], "direction": [0, 0, 1], "depth_m": 0.04}}],
        "tissue": [{{"toughness_j_m2": {}}}], "tears": true}}, "tool": {{"contact": "attach"}}}})",
                  nodes(kLongM), nodes(2 * kLegM), nodes(kThickM), kLongM, 2 * kLegM, kThickM, kLegM, kFirstM, kLegM, kJ),
      "sheet");
  std::vector<std::uint32_t> held;  // at half of the thickness: hinges
  for (std::uint32_t i = 0; i < scene.tearing->uncut().nodes.size(); ++i) {
    const Vec3& x = scene.body.nodes[i];
    if (x.x() < 1e-9 && std::abs(x.y() - kLegM) > 1e-9 && std::abs(x.z() - 0.5 * kThickM) < 1e-9) held.push_back(i);
  }
  Pulled sheet = gripped(std::move(scene), held, [=](const Vec3& rest, double t) {
    return Vec3(rest + speed_m_s * t * Vec3(1, 0, rest.y() < kLegM ? 1 : -1));
  });
  struct Torn {
    double way_m, work_j, energy_j, area_m2;
  };
  std::vector<Torn> rows;
  while (rows.empty() || rows.back().area_m2 < 0.1 * kThickM) {
    REQUIRE(sheet.time_s() < 20);
    if (sheet.frame(0.0125))
      rows.push_back({speed_m_s * sheet.time_s(), sheet.work_j, sheet.energy_j(), sheet.cells * spacing_m * spacing_m});
  }
  const Torn &from = rows[rows.size() / 2 - 1], &to = rows.back();  // before, the legs are not folded yet
  CHECK((to.work_j - from.work_j) / (2 * (to.way_m - from.way_m)) == Approx(0.5 * kJ * kThickM).epsilon(0.05));
  CHECK((to.work_j - from.work_j - to.energy_j + from.energy_j) / (to.area_m2 - from.area_m2) == Approx(kJ).epsilon(0.06));
}

}  // namespace

TEST_CASE("Two legs of a sheet that fold away from each other tear apart with J b / 2 each", "[tears]") {
  tear_legs(0.01, 0.015);
}

TEST_CASE("Two legs of a sheet of fine cells tear apart with J b / 2 each", "[.soak]") { tear_legs(0.005, 0.03); }

TEST_CASE("The energy that a row of tetrahedra gives is what its body becomes softer by", "[tears]") {
  constexpr double kForceN = 1e-5;
  Scene scene = double_cantilever(0.01, 0.08, "", "tetrahedron");
  const auto row = TearRow::ahead(*scene.tearing, {0, CutEnd::last});
  REQUIRE(row);
  const Dynamics now(scene.body), parted(row->body().body());
  BodyState state = now.rest_state();
  const Opened before = opened(now, kForceN), after = opened(parted, kForceN);
  state.x += before.u;
  CHECK(row->release_j_m2(now, Skin(scene.body, 0), state, {}) * row->area_m2() ==
        Approx(0.5 * kForceN * (after.apart_m - before.apart_m)).epsilon(1e-3));
  // Rows that part one after another cover the cut once.
  double area_m2 = row->area_m2();
  CutBody body = row->body();
  while (const auto next = TearRow::ahead(body, {0, CutEnd::last})) {
    area_m2 += next->area_m2();
    body = next->body();
    if (body.cuts()[0].path_m.back().x() > 0.12) break;
  }
  CHECK(area_m2 == Approx(kBroadM * (body.cuts()[0].path_m.back().x() - 0.083)).margin(0.01 * kBroadM));
}

TEST_CASE("Tissue that is pulled anyhow tears without a jump, and leaves what is held, closed", "[tears]") {
  int torn = 0;
  for (std::uint64_t seed = 1; seed <= 24; ++seed) {
    INFO("seed " << seed);
    Random random(seed);
    const auto in = [&](double low, double high) { return low + (high - low) * random.uniform(); };
    const Vec3 from(in(0, 0.06), in(0, 0.04), 0.05), way(in(-0.05, 0.05), in(-0.05, 0.05), in(-0.02, 0.02));
    const Vec3 down(in(-0.7, 0.7), in(-0.7, 0.7), -1), to = from + way;
    const std::string text = fmt::format(
        R"({{"body": {{"lattice": {{"nodes": [7, 5, 5], "size_m": [0.06, 0.04, 0.04], "fixed_faces": ["z-"],
        "solid": {{"element": "{}", "young_pa": 8000, "poisson": 0.4, "damping_s": 0.01{}}}}},
        "cuts": [{{"path": [{{"at_m": [{}, {}, {}]}}, {{"at_m": [{}, {}, {}]}}], "direction": [{}, {}, {}], "depth_m": 0.025}}],
        "tissue": [{{"toughness_j_m2": 1}}], "tears": true}}, "tool": {{"contact": "attach"}}}})",
        seed % 2 == 0 ? "hexahedron" : "tetrahedron", seed % 3 == 0 ? R"(, "relaxation": [{"share": 0.3, "time_s": 0.2}])" : "",
        from.x(), from.y(), from.z(), to.x(), to.y(), to.z(), down.x(), down.y(), down.z());
    std::optional<Scene> scene;
    try {
      scene = read_scene(text, "drawn");
    } catch (const InputError&) {
      continue;  // it crosses nothing
    }
    SteppedBody body(*scene);
    Micros now{3'000'000};
    const Micros begin = now;
    body.start(now);
    const Vec3 grasped = scene->body.nodes[scene->tool.node], pull(in(-0.05, 0.05), in(-0.05, 0.05), in(0.02, 0.05));
    for (int k = 0; k < 60; ++k) {
      FrameJob job;
      job.target = now + Micros{30'000};
      StationJob hand;
      hand.id = 1;
      for (Micros t = now; t <= job.target + Micros{1000}; t += Micros{1000})
        hand.samples.push_back({t, grasped + std::min(seconds(t - begin), 1.0) * pull});
      job.stations.push_back(hand);
      now = job.target;
      const double mass = body.dynamics().masses().sum();
      body.step(job);
      REQUIRE(body.state().x.allFinite());
      if (!body.parted()) continue;
      ++torn;
      CHECK(body.parted()->loose == 0);
      CHECK(std::abs(body.dynamics().masses().sum() - mass) <= 1e-12 * mass);
      CHECK(check_edges(body.scene().body.triangles).closed());
    }
  }
  CHECK(torn > 20);
}

TEST_CASE("A grasp tears the slab of the scene open, without a step of its force, and others take the tear up", "[tears]") {
  const Scene scene = load_scene(std::filesystem::path(PALPATE_SOURCE_DIR) / "scenes/cuts/tear.json");
  SteppedBody body(scene);
  CHECK(body.integrator().reason.find("a tear is for implicit steps") != std::string::npos);
  Micros now{3'000'000};
  const Micros begin = now;
  body.start(now);
  const Vec3 grasped = scene.body.nodes[scene.tool.node];
  const double mass = body.dynamics().masses().sum();
  std::vector<Vec3> force;
  std::vector<std::size_t> torn;
  for (int k = 0; k < 250; ++k) {
    FrameJob job;
    job.target = now + Micros{20'000};
    StationJob hand;
    hand.id = 1;
    for (Micros t = now; t <= job.target + Micros{1000}; t += Micros{1000})
      hand.samples.push_back({t, grasped + Vec3(0.3, 0, 1) * 0.015 * std::min(seconds(t - begin), 4.0)});
    job.stations.push_back(hand);
    now = job.target;
    const auto report = body.step(job);
    REQUIRE(report);
    REQUIRE(report->converged);
    force.push_back(body.ports().front().lambda);
    if (!body.parted()) continue;
    torn.push_back(force.size() - 1);
    CHECK(body.parted()->loose == 0);
    CHECK(body.dynamics().masses().sum() == Approx(mass).epsilon(1e-12));
    CHECK(check_edges(body.scene().body.triangles).closed());
  }
  REQUIRE(torn.size() >= 3);
  double most_n = 0;
  for (const std::size_t k : torn)
    if (k + 1 < force.size()) most_n = std::max(most_n, (force[k + 1] - force[k]).norm());
  CAPTURE(torn.size(), force.back().norm());
  CHECK(most_n < 0.05);

  SteppedBody other(scene);
  REQUIRE(other.cut_again(*body.cuts()));
  CHECK(other.dynamics().masses() == body.dynamics().masses());
  CHECK(other.scene().body.triangles == body.scene().body.triangles);
  CHECK(other.resume(body.state().x, body.state().v, {}));
  FrameJob job;
  job.target = now + Micros{50'000};
  job.reset = true;
  body.step(job);
  CHECK(body.scene().body.triangles == scene.body.triangles);
  CHECK((body.state().x - body.rest().x).norm() < 1e-9);
}
