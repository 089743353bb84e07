#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "common/patch/patch.hpp"

using namespace palpate;

namespace {

/// Two modes on one chain: tool - k_1 - q_0, q_0 - k_2 - q_1, all along x; K is already diagonal when k_2 = 0.
Patch grasp() {
  Patch p;
  p.contact = ContactKind::attach;
  p.stiffness = (ModeVector(2) << 100, 400).finished();
  p.damping = (ModeMatrix(2, 2) << 2, -1, -1, 2).finished();
  p.g = p.q_rate = ModeVector::Zero(2);
  p.b_k = ModePort::Zero(2, 3);
  p.b_k(0, 0) = 100;
  p.b_d = ModePort::Zero(2, 3);
  p.k_port = Vec3(100, 1, 1).asDiagonal();
  p.valid_for = Micros{100'000};
  p.trust_radius_m = 0.02;
  return p;
}

Patch touch() {
  Patch p = grasp();
  p.contact = ContactKind::touch;
  p.surface.vertex_count = 3;
  p.surface.triangle_count = 1;
  for (std::size_t i = 0; i < 3; ++i) p.surface.vertices[i].rows = PortRows::Zero(3, 2);
  p.surface.vertices[1].position = Vec3(0.01, 0, 0);
  p.surface.vertices[2].position = Vec3(0, 0.01, 0);
  p.surface.triangles[0] = {0, 1, 2};
  return p;
}

PatchFault after(Patch p, void (*change)(Patch&)) {
  change(p);
  return check(p);
}

}  // namespace

TEST_CASE("a spring between tool and mode is accepted at exactly zero static stiffness and refused below") {
  CHECK(check(grasp()) == PatchFault::none);  // K_p - B^T K^-1 B = 100 - 100^2 / 100 = 0
  CHECK(after(grasp(), [](Patch& p) { p.k_port(0, 0) = 99; }) == PatchFault::stiffness_indefinite);
  CHECK(after(grasp(), [](Patch& p) { p.k_port(1, 1) = -0.1; }) == PatchFault::stiffness_indefinite);
  CHECK(after(grasp(), [](Patch& p) { p.k_port(0, 1) = 5; }) == PatchFault::stiffness_indefinite);
}

TEST_CASE("damping that feeds energy is refused, alone or through the port") {
  CHECK(after(grasp(), [](Patch& p) { p.damping(0, 0) = 0.4; }) == PatchFault::damping_indefinite);
  CHECK(after(touch(), [](Patch& p) { p.damping(0, 0) = 0.4; }) == PatchFault::damping_indefinite);
  CHECK(after(grasp(), [](Patch& p) { p.b_d(0, 0) = 0.1; }) == PatchFault::damping_indefinite);
  CHECK(after(grasp(), [](Patch& p) { p.damping(0, 1) = 0; }) == PatchFault::damping_indefinite);
}

TEST_CASE("the tolerance follows each motion's own scale") {
  // A soft mode next to a stiff one: a negative damper of the soft mode is not excused by the size of the stiff one's.
  CHECK(after(grasp(), [](Patch& p) { p.damping << 1e-1, 0, 0, 1e5; }) == PatchFault::none);
  CHECK(after(grasp(), [](Patch& p) { p.damping << -1e-2, 0, 0, 1e3; }) == PatchFault::damping_indefinite);
  CHECK(after(grasp(), [](Patch& p) { p.damping << 0, 1e-14, 1e-14, 1e3; }) == PatchFault::none);  // rounding noise of the sender
  CHECK(after(grasp(), [](Patch& p) { p.damping.setZero(); }) == PatchFault::none);
}

TEST_CASE("numbers that are not finite or out of range are refused wherever they stand") {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(after(grasp(), [](Patch& p) { p.g[1] = nan; }) == PatchFault::not_finite);
  CHECK(after(grasp(), [](Patch& p) { p.force.y() = INFINITY; }) == PatchFault::not_finite);
  CHECK(after(grasp(), [](Patch& p) { p.b_k(1, 2) = nan; }) == PatchFault::not_finite);
  CHECK(after(touch(), [](Patch& p) { p.surface.vertices[2].rows(0, 1) = nan; }) == PatchFault::not_finite);
  CHECK(after(touch(), [](Patch& p) { p.point.weight.x() = nan; }) == PatchFault::not_finite);
  CHECK(after(grasp(), [](Patch& p) { p.stiffness[0] = -1; }) == PatchFault::out_of_range);
  CHECK(after(grasp(), [](Patch& p) { p.tool.x() = 11; }) == PatchFault::out_of_range);
  CHECK(after(grasp(), [](Patch& p) { p.force.x() = 2e4; }) == PatchFault::out_of_range);
  CHECK(after(grasp(), [](Patch& p) { p.valid_for = Micros{-1}; }) == PatchFault::out_of_range);
  CHECK(after(touch(), [](Patch& p) { p.friction = -0.1; }) == PatchFault::out_of_range);
}

TEST_CASE("sizes that do not agree are refused before anything is read") {
  CHECK(after(grasp(), [](Patch& p) { p.g.resize(1); }) == PatchFault::sizes);
  CHECK(after(grasp(), [](Patch& p) { p.damping.resize(1, 2); }) == PatchFault::sizes);
  CHECK(after(grasp(), [](Patch& p) { p.b_d.resize(3, 3); }) == PatchFault::sizes);
  CHECK(after(touch(), [](Patch& p) { p.surface.vertices[1].rows.resize(3, 1); }) == PatchFault::sizes);
  CHECK(after(touch(), [](Patch& p) { p.surface.vertex_count = kMaxPortVertices + 1; }) == PatchFault::sizes);
  CHECK(after(touch(), [](Patch& p) { p.surface.triangle_count = 0; }) == PatchFault::sizes);
}

TEST_CASE("a local surface needs indices inside, triangles with an area, and a contact point on it") {
  CHECK(check(touch()) == PatchFault::none);
  CHECK(after(touch(), [](Patch& p) { p.surface.triangles[0][2] = 3; }) == PatchFault::surface);
  CHECK(after(touch(), [](Patch& p) { p.surface.triangles[0] = {0, 1, 1}; }) == PatchFault::surface);
  CHECK(after(touch(), [](Patch& p) { p.point.triangle = 1; }) == PatchFault::surface);
  CHECK(after(touch(), [](Patch& p) { p.point.weight = Vec3(0.5, 0.6, 0); }) == PatchFault::surface);
  CHECK(after(touch(), [](Patch& p) { p.point.weight = Vec3(1.5, -0.5, 0); }) == PatchFault::surface);
  CHECK(after(touch(), [](Patch& p) { p.c_static(2, 2) = -1e-4; }) == PatchFault::stiffness_indefinite);
}

TEST_CASE("a constant patch is judged by its force alone") {
  Patch p;
  p.constant = true;
  p.contact = ContactKind::touch;
  CHECK(check(p) == PatchFault::none);
  p.force.x() = std::nan("");
  CHECK(check(p) == PatchFault::not_finite);
}
