// Blades anywhere through small bodies, by the code that a room uses: what parts stays whole in mass, momentum, energy and
// frequency, its surface closed, and what hangs on nothing goes.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <cmath>
#include <memory>
#include <numeric>

#include "common/base/random.hpp"
#include "server/dynamics/needle_ports.hpp"
#include "server/room/live_cuts.hpp"
#include "server/room/stepped_body.hpp"
#include "server/scene/disjoint_sets.hpp"
#include "server/scene/hexa_mesh.hpp"
#include "server/scene/surface.hpp"
#include "server/scene/tetra_mesh.hpp"
#include "tests/support/eigenvalues.hpp"

using namespace palpate;

namespace {

constexpr double kDrawnSpacingM = 0.012, kDrawnLengthM = 0.08, kDrawnWidthM = 0.03;

Vec3 drawn_vector(Random& random) { return Vec3(random.uniform(), random.uniform(), random.uniform()) - Vec3::Constant(0.5); }

std::size_t below(std::size_t n, Random& random) { return static_cast<std::size_t>(random.uniform() * static_cast<double>(n)); }

Scene drawn_scene(Random& random) {
  const auto count = [&] { return 3 + static_cast<int>(3 * random.uniform()); };
  const int nx = count(), ny = count(), nz = count();
  const char* const fixed[] = {R"("fixed_faces": ["z-"])", R"("fixed_faces": ["x-", "x+"])", R"("fixed_faces": ["y+"])"};
  const char* const laws[] = {"neo-hookean", "corotational"};
  const std::string relaxation = random.uniform() < 0.3 ? R"(, "relaxation": [{"share": 0.3, "time_s": 0.2}])" : "";
  return read_scene(fmt::format(
                        R"({{"body": {{"lattice": {{"nodes": [{}, {}, {}], "size_m": [{}, {}, {}], "density_kg_m3": 1060, {},
          "solid": {{"element": "{}", "young_pa": 8000, "poisson": {}, "law": "{}", "damping_s": 0.01{}}}}},
          "tissue": [{{"toughness_j_m2": 30, "puncture_n": 0.5, "friction_n_m": 3}}]}},
          "tool": {{"contact": "touch", "radius_m": 0.02, "blade": {{"length_m": {}, "width_m": {}}}}}}})",
                        nx, ny, nz, kDrawnSpacingM * (nx - 1), kDrawnSpacingM * (ny - 1), kDrawnSpacingM * (nz - 1),
                        fixed[below(3, random)], random.uniform() < 0.5 ? "hexahedron" : "tetrahedron",
                        0.2 + 0.28 * random.uniform(), laws[below(2, random)], relaxation, kDrawnLengthM, kDrawnWidthM),
                    "drawn");
}

/// Largest eigenvalue of M^-1 K of each cell by itself; that of the body, however it is held, is no larger.
double stiffest_cell(const LumpedBody& body) {
  double most = 0;
  const auto take = [&](const auto& cell, auto into, LumpedBody one) {
    auto alone = cell;
    for (std::size_t c = 0; c < cell.nodes.size(); ++c) {
      one.nodes.push_back(body.nodes[cell.nodes[c]]);
      alone.nodes[c] = static_cast<std::uint32_t>(c);
    }
    (one.*into).push_back(alone);
    one.fixed.assign(one.nodes.size(), 0);
    one.masses_kg = lumped_masses(one.*into, one.nodes, 1060);
    const Dynamics dynamics(one);
    const auto n = static_cast<Eigen::Index>(3 * one.nodes.size());
    Matrix k(n, n);
    const BodyState rest = dynamics.rest_state();
    for (Eigen::Index i = 0; i < n; ++i) {
      Vector k_y, d_y;
      dynamics.multiply_tangents(rest, Vector::Unit(n, i), k_y, d_y);
      k.col(i) = k_y;
    }
    most = std::max(most, test::symmetric_eigenvalues(k, dynamics.masses().asDiagonal().toDenseMatrix()).maxCoeff());
  };
  LumpedBody like = body;
  like.nodes.clear();
  like.triangles.clear();
  like.embedded.clear();
  like.elements.clear();
  like.hexahedra.clear();
  like.tetrahedra.clear();
  for (const Hexahedron& cell : body.hexahedra) take(cell, &LumpedBody::hexahedra, like);
  for (const Tetrahedron& cell : body.tetrahedra) take(cell, &LumpedBody::tetrahedra, like);
  return most;
}

/// A lower bound of the largest eigenvalue of M^-1 K at rest, by a few steps of the power method.
double stiffest(const Dynamics& dynamics, Random& random) {
  const BodyState rest = dynamics.rest_state();
  Vector y(rest.x.size()), k_y, d_y;
  for (double& each : y) each = random.uniform() - 0.5;
  double most = 0;
  for (int k = 0; k < 12; ++k) {
    mask(dynamics.body().fixed, y);
    dynamics.multiply_tangents(rest, y, k_y, d_y);
    mask(dynamics.body().fixed, k_y);
    most = std::max(most, y.dot(k_y) / y.dot(dynamics.masses().cwiseProduct(y)));
    y = k_y.cwiseQuotient(dynamics.masses()).normalized();
  }
  return most;
}

template <class F>
void each_cell(const LumpedBody& body, const F& visit) {
  for (const Hexahedron& cell : body.hexahedra) visit(cell);
  for (const Tetrahedron& cell : body.tetrahedra) visit(cell);
}

/// Returns true if a fixed node holds each piece.
bool is_held(const LumpedBody& body) {
  DisjointSets pieces(body.nodes.size());
  each_cell(body, [&](const auto& cell) {
    for (const std::uint32_t node : cell.nodes) pieces.join(cell.nodes[0], node);
  });
  std::vector<std::uint8_t> held(body.nodes.size(), 0);
  for (std::uint32_t i = 0; i < body.nodes.size(); ++i)
    if (body.fixed[i] != 0) held[pieces.find(i)] = 1;
  bool all = true;
  each_cell(body, [&](const auto& cell) { all = all && held[pieces.find(cell.nodes[0])] != 0; });
  return all;
}

/// A body with blades that are put anywhere, without steps.
class Cut {
 public:
  explicit Cut(Random& random) : random_(random) {
    stiffest_ = stiffest_cell(scene_.body);
    ports_ = needle_ports(ToolPort{}, *tissue_);
    std::vector<ToolPort> other = needle_ports(ToolPort{}, *tissue_);
    ports_.insert(ports_.end(), other.begin(), other.end());
    for (std::size_t k = ports_.size() / 2; k < ports_.size(); ++k) ports_[k].tool = 1;
    touch_ = ports_.size() / 2;
    stir();
  }
  int parted = 0, loose = 0;

  /// A blade from a point of the surface, into the body in up to four strokes.
  void stab() {
    const SurfacePoint entry = drawn_point();
    const std::size_t kind = below(6, random_);
    Vec3 way = -normal(entry), edge = way.unitOrthogonal();
    if (kind < 4) way = (way + 1.4 * drawn_vector(random_)).normalized();  // oblique
    if (kind < 3) edge = drawn_vector(random_);                            // else along edges and faces of cells
    edge = (edge - edge.dot(way) * way).normalized();
    ToolPort& tip = ports_.front();
    tip.needle.path = tissue_->path(entry, way, edge, state_.x);
    const int strokes = kind == 5 ? 1 : 1 + static_cast<int>(below(4, random_));  // one: faster than the body
    double front_m = 0;
    for (int k = 0; k < strokes; ++k) {
      front_m += (kDrawnLengthM - front_m) * (kind == 5 ? 1.0 : 0.6 * random_.uniform());
      tip.needle.tip = {true, front_m, front_m, 0};
      tip.touching = true;
      tip.lambda = drawn_vector(random_);
      stroke();
      stir();
      const std::uint32_t nodes = dynamics_->nodes();
      CHECK_FALSE(cuts_->cut_on());  // a blade that is still cuts nothing more
      CHECK(dynamics_->nodes() == nodes);
    }
    tip.needle.tip = {};
    tip.needle.path.reset();
    tip.touching = false;
  }
  void make_whole() {
    for (ToolPort& port : ports_) port.needle.path.reset(), port.touching = false, port.point = {};
    cuts_->make_whole();
    CHECK(dynamics_->masses().sum() == whole_kg_);
    stir();
  }

 private:
  SurfacePoint drawn_point() {
    SurfacePoint point{static_cast<std::uint32_t>(below(skin_->view().triangles.size(), random_)),
                       Vec3::Unit(static_cast<Eigen::Index>(below(3, random_)))};
    if (random_.uniform() < 0.8) {  // else a vertex
      point.weight = drawn_vector(random_) + Vec3::Constant(0.5 + 1e-3);
      point.weight /= point.weight.sum();
    }
    return point;
  }
  Vec3 normal(const SurfacePoint& at) const { return normal_at(skin_->view(), skin_->place(state_.x), at); }
  Vec3 place(const SurfacePoint& at) const { return position_at(skin_->view(), skin_->place(state_.x), at); }

  /// Deforms and moves the body anyhow, a tenth of a cell, and lets another tool push.
  void stir() {
    const LumpedBody& body = scene_.body;
    const Mat3 affine = Mat3::Identity() + 0.1 * Mat3(Mat3::NullaryExpr([&] { return random_.uniform() - 0.5; }));
    const bool fresh = !state_.traction;
    for (std::uint32_t i = 0; i < body.nodes.size(); ++i) {
      if (body.fixed[i] != 0) continue;
      if (fresh) at_node(state_.x, i) = affine * body.nodes[i];
      at_node(state_.x, i) += 0.05 * kDrawnSpacingM * drawn_vector(random_);
      at_node(state_.v, i) = 0.1 * drawn_vector(random_);
    }
    state_.time_s += 1;
    ports_[touch_].point = drawn_point();
    ports_[touch_].touching = true;
    ports_[touch_].lambda = drawn_vector(random_);
  }

  Vec3 momentum() const {
    Vec3 sum = Vec3::Zero();
    for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i) sum += dynamics_->masses()[3 * i] * at_node(state_.v, i);
    return sum;
  }

  void stroke() {
    const double mass = dynamics_->masses().sum(), energy = dynamics_->energy(state_);
    const Vec3 moves = momentum(), touched = place(ports_[touch_].point);
    if (!cuts_->cut_on()) return;
    ++parted;
    const LumpedBody& body = scene_.body;
    const CutChange& change = cuts_->parted();
    REQUIRE(state_.x.allFinite());
    REQUIRE(state_.traction->load.allFinite());
    const double now_kg = dynamics_->masses().sum();
    if (change.loose == 0) {
      CHECK(std::abs(now_kg - mass) <= 1e-12 * mass);
      CHECK(std::abs(dynamics_->energy(state_) - energy) <= 1e-11 * std::abs(energy));
      CHECK((momentum() - moves).norm() <= 1e-11 * mass);
    } else {
      ++loose;
      CHECK(now_kg < mass);
    }
    CHECK(is_held(body));
    const EdgeReport edges = check_edges(body.triangles);
    CHECK(edges.open == 0);
    CHECK(edges.crowded + edges.shared == 0);
    CHECK(edges.flipped == 0);
    CHECK(stiffest(*dynamics_, random_) <= stiffest_ * (1 + 1e-9));
    for (const double mass_kg : body.masses_kg) CHECK(mass_kg > 0);
    REQUIRE(ports_[touch_].point.triangle < skin_->view().triangles.size());
    if (change.loose == 0) CHECK((place(ports_[touch_].point) - touched).norm() < 0.6 * kDrawnSpacingM);
  }

  Random& random_;
  Scene scene_ = drawn_scene(random_);
  std::unique_ptr<Skin> skin_ = std::make_unique<Skin>(scene_.body, scene_.tool.radius_m);
  std::unique_ptr<NeedleTissue> tissue_ = std::make_unique<NeedleTissue>(scene_, *skin_);
  std::optional<Dynamics> dynamics_{std::in_place, scene_.body};
  BodyState rest_ = dynamics_->rest_state(), state_ = rest_;
  std::vector<ToolPort> ports_;
  std::size_t touch_ = 0;
  double stiffest_ = 0, whole_kg_ = dynamics_->masses().sum();
  std::unique_ptr<LiveCuts> cuts_ =
      std::make_unique<LiveCuts>(BodyInParts{&scene_, skin_.get(), &tissue_, &dynamics_, &state_, &rest_, &ports_});
};

void cut_anyhow(std::uint64_t seed, int cuts) {
  constexpr int kOfABody = 20;
  int parted = 0, loose = 0;
  for (int first = 0; first < cuts; first += kOfABody) {
    Random random(seed + static_cast<std::uint64_t>(first));
    Cut body(random);
    for (int k = 0; k < kOfABody; ++k) {
      INFO("seed " << seed + static_cast<std::uint64_t>(first) << ", cut " << k);
      body.stab();
      if (random.uniform() < 0.3) body.make_whole();
    }
    parted += body.parted;
    loose += body.loose;
  }
  CHECK(parted > cuts / 2);
  CHECK(loose > cuts / 50);
}

}  // namespace

TEST_CASE("A thousand blades anywhere part bodies without a jump, and leave what is held, closed", "[blade]") {
  cut_anyhow(1, 1000);
}

TEST_CASE("A hundred thousand blades anywhere part bodies without a jump, and leave what is held, closed", "[.soak]") {
  cut_anyhow(1'000'000, 100'000);
}

TEST_CASE("A sheet without a width, a way or a direction cuts nothing", "[blade]") {
  Random random(5);
  for (int k = 0; k < 4; ++k) {
    const Scene scene = drawn_scene(random);
    CutBody cut(scene.body);
    const Vec3 a = scene.body.nodes[3], b = scene.body.nodes[7];
    CHECK(cut.set(0, {{a, b}, Vec3::UnitX(), 0}) == 0);
    CHECK(cut.set(1, {{a, a}, Vec3::UnitX(), 0.03}) == 0);
    CHECK(cut.set(2, {{a, b}, Vec3::Zero(), 0.03}) == 0);
    CHECK(cut.set(3, {{a, a + 0.03 * Vec3::UnitX()}, Vec3::UnitX(), 0.03}) == 0);
    CHECK(cut.set(4, {{a}, Vec3::UnitX(), 0.03}) == 0);
    const CutChange change = cut.part();
    CHECK(change.loose == 0);
    CHECK(cut.body().nodes == scene.body.nodes);
  }
}

TEST_CASE("A blade that is swung anyhow, also faster than the body can follow, leaves a body that can be stepped", "[blade]") {
  int cut = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    INFO(seed);
    Random random(seed);
    SteppedBody body(drawn_scene(random));
    Micros now{5'000'000};
    body.start(now);
    const Vec3 top = body.scene().body.nodes.back(), middle = 0.5 * top;
    std::vector<ToolPose> way;  // in along its axis, and out another way
    for (int k = 0; k < 4; ++k) {
      const Vec3 axis = drawn_vector(random).normalized();
      const Rotation turn =
          Rotation::FromTwoVectors(Vec3::UnitZ(), axis) * Rotation(Eigen::AngleAxisd(6 * random.uniform(), Vec3::UnitZ()));
      way.emplace_back(middle + 1.2 * top.norm() * axis, turn);
      way.emplace_back(middle - 0.4 * random.uniform() * top.norm() * axis, turn);
    }
    const double speed_1_s = seed % 3 == 0 ? 20 : 3;
    for (int frame = 0; frame < 24; ++frame) {
      FrameJob job;
      job.begin = now;
      job.target = now + Micros{30'000};
      job.may_sleep = false;
      StationJob hand;
      hand.id = 1;
      for (Micros t = now; t <= job.target + Micros{1000}; t += Micros{1000}) {
        const double s = speed_1_s * seconds(t - Micros{5'000'000});
        const auto k = static_cast<std::size_t>(s);
        const ToolPose &from = way[k % way.size()], &to = way[(k + 1) % way.size()];
        const double part = s - std::floor(s);
        hand.samples.push_back({t, from.position + part * (to.position - from.position), from.turn.slerp(part, to.turn)});
      }
      job.stations.push_back(hand);
      now = job.target;
      body.step(job);
      REQUIRE(body.state().x.allFinite());
      CHECK(check_edges(body.scene().body.triangles).closed());
      CHECK(is_held(body.scene().body));
    }
    cut += body.cuts() != nullptr;
  }
  CHECK(cut > 2);
}
