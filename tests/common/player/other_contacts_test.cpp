// Other tools on the modes of a patch, against the equations of patch.hpp integrated in steps a hundred times as fine, statics
// and energy.
#include <catch2/catch.hpp>
#include <cmath>

#include "common/base/random.hpp"
#include "common/player/player.hpp"
#include "tests/support/floor_patch.hpp"

using namespace palpate;
using test::floor_patch, test::kStamp;

namespace {

/// A frictionless floor of soft modes under the tool and another one, which moves it elsewhere.
Patch shared_floor(int r) {
  Patch p = floor_patch(r);
  p.c_static.setZero();
  p.load_for = Micros{150'000};
  for (int i = 0; i < r; ++i) p.damping(i, i) *= 2;
  p.others.count = 1;
  OtherContact& other = p.others.of[0];
  other.rows = 0.8 * p.surface.vertices[0].rows;
  other.rows.col(0) *= 0.5;
  return p;
}

/// Force of a tool at this height along the normal over a point of the modes [N].
double push_n(double height_m, double contact_stiffness_n_m) { return std::max(0.0, -contact_stiffness_n_m * height_m); }

/// The patch's own equations with both contacts, normals along z, by classical Runge-Kutta.
class FineSteps {
 public:
  explicit FineSteps(const Patch& p) : p_(p), q_(ModeVector::Zero(p.modes())), v_(p.q_rate) {}
  /// Advances one tick in which the tool moves from one height to the next; returns the force on it at the end.
  double tick(double from, double to) {
    constexpr int kSteps = 100;
    const double h = 1e-3 / kSteps;
    for (int k = 0; k < kSteps; ++k) {
      const auto tool = [&](double part) { return from + (k + part) / kSteps * (to - from); };
      const ModeVector a1 = rate(q_, v_, tool(0), t_), v2 = v_ + 0.5 * h * a1;
      const ModeVector a2 = rate(q_ + 0.5 * h * v_, v2, tool(0.5), t_ + 0.5 * h), v3 = v_ + 0.5 * h * a2;
      const ModeVector a3 = rate(q_ + 0.5 * h * v2, v3, tool(0.5), t_ + 0.5 * h), v4 = v_ + h * a3;
      const ModeVector a4 = rate(q_ + h * v3, v4, tool(1), t_ + h);
      q_ += h / 6 * (v_ + 2 * v2 + 2 * v3 + v4);
      v_ += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
      t_ += h;
    }
    return push_n(to - own_row().dot(q_), p_.contact_stiffness_n_m);
  }
  double other_push(double t) const {
    const OtherContact& other = p_.others.of[0];
    const double s = std::min(t, seconds(p_.load_for));
    return push_n(other.gap.z() + s * other.velocity.z() + 0.5 * s * s * other.acceleration.z() - other.rows.row(2).dot(q_),
                  p_.contact_stiffness_n_m);
  }

 private:
  ModeVector own_row() const { return p_.surface.vertices[0].rows.row(2).transpose(); }
  ModeVector rate(const ModeVector& q, const ModeVector& v, double tool, double t) const {
    const OtherContact& other = p_.others.of[0];
    const double s = std::min(t, seconds(p_.load_for));
    const double gap = other.gap.z() + s * other.velocity.z() + 0.5 * s * s * other.acceleration.z();
    ModeVector a = p_.g - p_.stiffness.cwiseProduct(q) - p_.damping * v;
    a -= push_n(tool - own_row().dot(q), p_.contact_stiffness_n_m) * own_row();
    a -= push_n(gap - other.rows.row(2).dot(q), p_.contact_stiffness_n_m) * other.rows.row(2).transpose();
    return a;
  }

  Patch p_;
  ModeVector q_, v_;
  double t_ = 0;
};

}  // namespace

TEST_CASE("A tool feels another as the equations of the patch have it, where that presses on, lifts off, comes down or stops") {
  Patch p = shared_floor(GENERATE(2, 6));
  p.contact_stiffness_n_m = GENERATE(300, 2000);
  OtherContact& other = p.others.of[0];
  const int way = GENERATE(0, 1, 2);
  other.touching = way < 2;
  if (way == 0) other.gap.z() = -1e-4, other.velocity.z() = -0.04;
  if (way == 1) other.gap.z() = -1e-3, other.velocity.z() = -0.08, other.acceleration.z() = 1.2;
  if (way == 2) other.gap = Vec3(0.01, 0, 0.001), other.velocity.z() = -0.05;
  PatchPlayer player(p);
  FineSteps fine(p);
  double worst_n = 0, most_n = 0, alone_n = 0, last = 0.0002;
  Patch alone = p;
  alone.others.count = 0;
  PatchPlayer without(alone);
  for (int ms = 1; ms <= 300; ++ms) {
    const double depth = 0.0002 - 0.004 * std::sin(0.012 * ms);
    const double force = fine.tick(last, depth);
    worst_n = std::max(worst_n, std::abs(player.advance({kStamp + ms * kTick, {0, 0, depth}}).force.z() - force));
    alone_n = std::max(alone_n, std::abs(without.advance({kStamp + ms * kTick, {0, 0, depth}}).force.z() - force));
    most_n = std::max(most_n, force);
    last = depth;
  }
  CAPTURE(p.modes(), p.contact_stiffness_n_m, way, most_n, alone_n);
  CHECK(worst_n < 0.01 * most_n);
  CHECK(worst_n < 0.1 * alone_n);
}

TEST_CASE("What yields at once under another tool is in series with its contact, and the stamp begins with its push") {
  Patch p = shared_floor(4);
  OtherContact& other = p.others.of[0];
  other.touching = true;
  other.c_static = Vec3(1e-3, 1e-3, 2e-3).asDiagonal();
  other.gap = Vec3(0, 0, -0.003);
  const double begin_n = 0.003 / (2e-3 + 1 / p.contact_stiffness_n_m);
  p.g = begin_n * other.rows.row(2).transpose();  // in equilibrium at the stamp
  PatchPlayer still(p);
  const Vec3 away(0, 0, 0.5);
  for (int ms = 1; ms <= 100; ++ms) still.advance({kStamp + ms * kTick, away});
  CHECK(still.energy() < 1e-20);

  other.velocity.z() = -0.02;  // 3 mm further
  PatchPlayer player(p);
  for (int ms = 1; ms <= 8000; ++ms) player.advance({kStamp + ms * kTick, away});
  const PortRows& rows = other.rows;
  const double modes = (rows * p.stiffness.cwiseInverse().asDiagonal() * rows.transpose())(2, 2);
  const double more_n = 0.003 / (2e-3 + 1 / p.contact_stiffness_n_m + modes);
  const PortRows& here = p.surface.vertices[0].rows;
  const double sag = (here * p.stiffness.cwiseInverse().asDiagonal() * rows.transpose())(2, 2) * more_n;
  CHECK(player.vertex(0).z() == Approx(-sag).epsilon(1e-4));
}

TEST_CASE(
    "Another tool that goes along the surface drags it as far as friction lets it: its own, where it is another kind of tool") {
  const auto own_law = GENERATE(std::optional<ContactParameters>(), ContactParameters{350, 0.25});
  Patch p = shared_floor(3);
  p.friction = 0.4;
  const ContactParameters law = own_law.value_or(ContactParameters{p.contact_stiffness_n_m, p.friction});
  p.others.of[0].law = own_law;
  const Vec3 own(2, 1.5, 3), others(1, 2, 1.2);  // each mode moves along an axis of its own
  for (PortVertex& vertex : p.surface.vertices) vertex.rows = Mat3(own.asDiagonal());
  OtherContact& other = p.others.of[0];
  other.rows = Mat3(others.asDiagonal());
  other.touching = true;
  other.gap = Vec3(0, 0, -0.004);
  other.velocity = Vec3(0.1, 0, 0);
  p.load_for = Micros{5'000'000};
  PatchPlayer player(p);
  for (int ms = 1; ms <= 4000; ++ms) player.advance({kStamp + ms * kTick, Vec3(0, 0, 0.5)});
  const double push_n = 0.004 / (others.z() * others.z() / p.stiffness[2] + 1 / law.contact_stiffness_n_m);
  const Vec3 lambda(law.friction * push_n, 0, -push_n);
  const Vec3 moved = own.cwiseProduct(others).cwiseProduct(lambda).cwiseQuotient(Vec3(p.stiffness));
  CHECK((player.vertex(0) - p.surface.vertices[0].position - moved).norm() < 1e-4 * moved.norm());
}

TEST_CASE("Beside a tool that stays where it is a tool gets no energy out of any cycle") {
  Random random(11);
  for (int trial = 0; trial < 20; ++trial) {
    Patch p = shared_floor(8);
    p.contact_stiffness_n_m = trial % 2 ? 300 : 3000;
    p.others.count = kMaxOtherContacts;
    for (OtherContact& other : p.others.tools()) {
      other.rows = p.surface.vertices[0].rows * random.uniform(0.5, 1.0);
      other.gap = Vec3(0, 0, random.uniform(-0.002, 0.002));
      other.touching = other.gap.z() < 0;
    }
    if (trial == 3) p.damping.setZero();
    PatchPlayer player(p);
    // Energy in the modes and in the springs of the others beforehand.
    const auto stored = [&] {
      double sum = player.energy();
      for (const OtherContact& other : p.others.tools()) {
        const Vec3 moved = player.vertex(0) - p.surface.vertices[0].position;
        const double share = other.rows(2, 0) / p.surface.vertices[0].rows(2, 0);
        sum += 0.5 * p.contact_stiffness_n_m * std::pow(std::min(0.0, other.gap.z() - share * moved.z()), 2);
      }
      return sum;
    };
    const double before = stored();
    const double fast = random.uniform(0.01, 0.4), deep = random.uniform(0.004, 0.01);
    Vec3 last(0, 0, 0.003), lambda = Vec3::Zero();
    double work = 0, through = 0, worst = 0;
    for (int ms = 1; ms <= 4000; ++ms) {
      const Vec3 tool(0, 0, 0.002 - deep * std::sin(fast * ms));
      const PlayerOutput out = player.advance({kStamp + ms * kTick, tool});
      const double now = 0.5 * (lambda - out.force).dot(out.contact ? Vec3(tool - last) : Vec3::Zero());
      work += now;
      through += std::abs(now);
      last = tool;
      lambda = -out.force;
      worst = std::max(worst, stored() - before - work);
    }
    CAPTURE(trial, through);
    CHECK(through > 0);
    CHECK(worst < 0.01 * through);
  }
}
