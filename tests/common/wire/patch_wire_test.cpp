#include <catch2/catch.hpp>

#include <functional>
#include <limits>

#include "seeds.hpp"

using namespace palpate;

namespace {

Patch round_trip(const Patch& patch) {
  Message out;
  REQUIRE(decode(seeds::bytes_of(seeds::message(PatchMessage{patch})), out) == WireFault::none);
  return std::get<PatchMessage>(out.body).patch;
}

template <class A, class B>
void check_float32(const A& got, const B& sent) {
  REQUIRE(got.rows() == sent.rows());
  REQUIRE(got.cols() == sent.cols());
  for (Eigen::Index j = 0; j < sent.cols(); ++j)
    for (Eigen::Index i = 0; i < sent.rows(); ++i) CHECK(std::abs(got(i, j) - sent(i, j)) <= 6e-8 * std::abs(sent(i, j)));
}

constexpr double kHalfStep = 0.5 / 32767 * 1.0001;

/// A vector of shorts: each number within half a step of 1/32767 of the largest.
void check_shorts(const ModeVector& got, const ModeVector& sent) {
  REQUIRE(got.size() == sent.size());
  CHECK((sent.size() == 0 || (got - sent).cwiseAbs().maxCoeff() <= kHalfStep * sent.cwiseAbs().maxCoeff()));
}

/// D_ii is a half, never less than what was sent; the coupling of modes is within half a step of 1/32767 of sqrt(D_ii D_jj).
void check_damping(const ModeMatrix& got, const ModeMatrix& sent) {
  REQUIRE(got.rows() == sent.rows());
  for (Eigen::Index i = 0; i < sent.rows(); ++i) {
    CHECK(got(i, i) >= sent(i, i) * (1 - 6e-8));
    CHECK(got(i, i) <= sent(i, i) * (1 + 0x1p-10));
  }
  const ModeVector root = got.diagonal().cwiseSqrt();
  ModeMatrix apart = got - sent;
  apart.diagonal().setZero();
  const ModeMatrix off = apart.cwiseAbs().cwiseQuotient(root * root.transpose());
  CHECK((got.rows() == 0 || off.maxCoeff() <= 0.5 / 32767 + 1e-7));
}

void check_common(const Patch& got, const Patch& sent) {
  CHECK(got.seq == sent.seq);
  CHECK(got.stamp == sent.stamp);
  CHECK(got.scheme == sent.scheme);
  CHECK(got.contact == sent.contact);
  CHECK(got.constant == sent.constant);
  CHECK(got.valid_for == sent.valid_for);
  CHECK(got.trust_radius_m == Approx(sent.trust_radius_m).epsilon(1e-7));
  CHECK((got.tool - sent.tool).cwiseAbs().maxCoeff() <= 3.8e-9);
  check_float32(got.force, sent.force);
}

}  // namespace

TEST_CASE("a grasp's patch arrives with its stiffness in float32, forces and damping in 16 bits") {
  for (const int modes : {0, 1, 7, kMaxModes}) {
    const Patch sent = seeds::attach_patch(modes);
    const Patch got = round_trip(sent);
    check_common(got, sent);
    check_float32(got.stiffness, sent.stiffness);
    check_damping(got.damping, sent.damping);
    check_shorts(got.g, sent.g);
    check_shorts(got.q_rate, sent.q_rate);
    check_float32(got.b_k, sent.b_k);
    check_float32(got.b_d, sent.b_d);
    check_float32(got.k_port, sent.k_port);
    check_float32(got.d_port, sent.d_port);
    check_float32(got.tool_velocity, sent.tool_velocity);
  }
}

TEST_CASE("a touch patch arrives with its surface to 16 bits of what is largest") {
  const Patch sent = seeds::touch_patch(8, 12, 16);
  const Patch got = round_trip(sent);
  check_common(got, sent);
  check_float32(got.stiffness, sent.stiffness);
  check_damping(got.damping, sent.damping);
  check_shorts(got.g, sent.g);
  check_shorts(got.q_rate, sent.q_rate);
  check_float32(got.c_static, sent.c_static);
  CHECK(got.touching);
  CHECK(got.friction == Approx(0.3).epsilon(1e-7));
  CHECK(got.contact_stiffness_n_m == Approx(987.6).epsilon(1e-7));
  CHECK(got.point.triangle == 1);
  CHECK(got.point.weight.sum() == Approx(1).epsilon(1e-15));
  CHECK((got.point.weight - sent.point.weight).cwiseAbs().maxCoeff() <= 1.0 / 65535);
  REQUIRE(got.surface.vertex_count == 12);
  REQUIRE(got.surface.triangle_count == 16);
  for (std::size_t t = 0; t < 16; ++t) CHECK(got.surface.triangles[t] == sent.surface.triangles[t]);
  for (int m = 0; m < 8; ++m) {
    double largest = 0, error = 0;
    for (std::size_t i = 0; i < 12; ++i) {
      const Vec3 a = got.surface.vertices[i].rows.col(m), b = sent.surface.vertices[i].rows.col(m);
      largest = std::max(largest, b.cwiseAbs().maxCoeff());
      error = std::max(error, (a - b).cwiseAbs().maxCoeff());
    }
    CHECK(error <= 2 * kHalfStep * largest);  // the step is a power of two, up to twice what the largest needs
  }
  for (std::size_t i = 0; i < 12; ++i) {
    const Vec3 off = got.surface.vertices[i].position - sent.surface.vertices[i].position;
    CHECK(off.cwiseAbs().maxCoeff() <= kHalfStep * 0.02 + 4e-9);  // the surface reaches 20 mm from vertex 0
    CHECK((got.surface.vertices[i].normal - sent.surface.vertices[i].normal).norm() < 1e-4);
    CHECK(got.surface.vertices[i].normal.isZero(0) == (i == 2));
  }
}

TEST_CASE("the growing load of other tools arrives with the patch, and one that is not there costs nothing") {
  for (Patch sent : {seeds::attach_patch(7), seeds::touch_patch(8, 11, 16)}) {
    const auto bare = seeds::bytes_of(seeds::message(PatchMessage{sent})).size();
    CHECK(round_trip(sent).load_rate.size() == 0);
    sent.load_rate = ModeVector::LinSpaced(sent.modes(), -3, 5);
    sent.load_for = Micros{180'000};
    const Patch got = round_trip(sent);
    check_float32(got.load_rate, sent.load_rate);
    CHECK(got.load_for == sent.load_for);
    // Two entries of the vtable, an offset, a count and a time; the rest may move by 4 more for alignment to 8 bytes.
    const auto most = bare + 16 + 4 * static_cast<std::size_t>(sent.modes()) + 4;
    CHECK(seeds::bytes_of(seeds::message(PatchMessage{sent})).size() <= most);
  }
  for (int modes = 1; modes <= kMaxModes; ++modes) {
    const int vertices = max_port_vertices(modes, kMaxPortTriangles, true);
    Patch sent = seeds::touch_patch(modes, vertices, std::min(16, most_triangles(vertices)));
    sent.load_rate = ModeVector::Ones(modes);
    sent.load_for = Micros{1};
    CHECK_FALSE(seeds::bytes_of(seeds::message(PatchMessage{sent})).empty());
  }
}

TEST_CASE("other tools arrive with their paths, normals and rows, and fit beside as many vertices as is said") {
  constexpr int kOthers = 3;
  const Patch sent = seeds::shared_patch(8, 6, 8, kOthers);
  const Patch got = round_trip(sent);
  REQUIRE(got.others.count == kOthers);
  CHECK(got.load_for == sent.load_for);
  for (std::size_t k = 0; k < kOthers; ++k) {
    const OtherContact &a = got.others.of[k], &b = sent.others.of[k];
    CHECK(a.touching == (k == 0));
    check_float32(a.gap, b.gap);
    check_float32(a.c_static, b.c_static);
    CHECK((a.velocity - b.velocity).cwiseAbs().maxCoeff() <= 0.5 / 16384);
    CHECK((a.acceleration - b.acceleration).cwiseAbs().maxCoeff() <= 0.5 / 1024);
    CHECK((a.normal - b.normal).norm() < 1e-4);
    for (int m = 0; m < 8; ++m)
      CHECK((a.rows.col(m) - b.rows.col(m)).cwiseAbs().maxCoeff() <= 1.0002 / 32767 * std::max(4.4, 5.1) / (1 + m));
  }
  for (int others = 0; others <= kMaxOtherContacts; ++others)
    for (int modes = 0; modes <= 10; ++modes) {
      const int vertices = max_port_vertices(modes, kMaxPortTriangles, true, 0, others);
      CAPTURE(others, modes, vertices);
      if (others <= kOthers) REQUIRE(vertices >= 3);
      if (vertices < 3) continue;
      Patch full = seeds::shared_patch(modes, vertices, std::min(kMaxPortTriangles, most_triangles(vertices)), others);
      full.load_rate = ModeVector::Ones(modes);
      full.load_for = Micros{1};
      CHECK_FALSE(seeds::bytes_of(seeds::message(PatchMessage{full})).empty());
    }
}

TEST_CASE("other tools of another kind arrive with their coupling and friction, for which there is room") {
  Patch sent = seeds::shared_patch(8, 6, 8, 3);
  const std::size_t plain = seeds::bytes_of(seeds::message(PatchMessage{sent})).size();
  CHECK_FALSE(round_trip(sent).others.of[0].law);
  sent.others.of[1].law = ContactParameters{300, 0.125};
  const Patch got = round_trip(sent);
  CHECK(got.others.of[0].law == ContactParameters{got.contact_stiffness_n_m, got.friction});
  CHECK(got.others.of[1].law == sent.others.of[1].law);
  CHECK(seeds::bytes_of(seeds::message(PatchMessage{sent})).size() <= plain + 3 * 8 + 28);
  for (int others = 1; others <= 3; ++others)
    for (int modes = 0; modes <= 10; ++modes) {
      PatchContacts contacts(others);
      contacts.laws = true;
      const int vertices = max_port_vertices(modes, kMaxPortTriangles, true, 0, contacts);
      CAPTURE(others, modes, vertices);
      REQUIRE(vertices >= 3);
      Patch full = seeds::shared_patch(modes, vertices, std::min(kMaxPortTriangles, most_triangles(vertices)), others);
      full.load_rate = ModeVector::Ones(modes);
      full.load_for = Micros{1};
      full.others.of[0].law = ContactParameters{300, 0.125};
      CHECK_FALSE(seeds::bytes_of(seeds::message(PatchMessage{full})).empty());
    }
  sent.others.of[1].law->friction = -1;
  CHECK(check(sent) == PatchFault::out_of_range);
}

TEST_CASE("the contacts of a tool's spheres arrive with its pose and torque, and fit beside as many vertices as is said") {
  Patch sent = seeds::body_patch(5, 6, 8, 4, 3);
  const Patch got = round_trip(sent);
  REQUIRE(got.turn);
  CHECK(got.turn->angularDistance(*sent.turn) < 1e-4);
  check_float32(got.torque, sent.torque);
  CHECK(got.others.own == 3);
  CHECK(got.sphere == sent.sphere);
  for (std::size_t j = 0; j < 3; ++j) CHECK(got.others.of[j].sphere == sent.others.of[j].sphere);
  CHECK(got.others.of[3].sphere == ToolSphere{});
  CHECK_FALSE(round_trip(seeds::shared_patch(5, 6, 8, 4)).turn);
  for (int others = 0; others <= kMaxOtherContacts; ++others)
    for (int modes = 0; modes <= kMaxModes; ++modes) {
      PatchContacts contacts{others, true};
      contacts.own = others;
      const int vertices = max_port_vertices(modes, kMaxPortTriangles, false, 0, contacts);
      CAPTURE(others, modes, vertices);
      if (vertices < 3) continue;
      const Patch full =
          seeds::body_patch(modes, vertices, std::min(kMaxPortTriangles, most_triangles(vertices)), others, others);
      CHECK_FALSE(seeds::bytes_of(seeds::message(PatchMessage{full})).empty());
    }
}

TEST_CASE("jaws arrive with their opening, and fit beside as many vertices as is said") {
  const Patch sent = seeds::jaws_patch(5, 6, 8, 4, 3), got = round_trip(sent);
  CHECK(got.opening == sent.opening);
  CHECK(got.sphere == sent.sphere);
  for (std::size_t j = 0; j < 3; ++j) CHECK(got.others.of[j].sphere == sent.others.of[j].sphere);
  for (int own = 0; own <= kMaxOtherContacts; ++own)
    for (int r = 1; r <= kMaxModes; ++r) {
      PatchContacts contacts{own, true, 0, true};
      contacts.own = own;
      const int vertices = max_port_vertices(r, kMaxPortTriangles, false, 0, contacts);
      CAPTURE(own, r, vertices);
      if (vertices < 3) continue;
      const int triangles = std::min(kMaxPortTriangles, most_triangles(vertices));
      CHECK_FALSE(seeds::bytes_of(seeds::message(PatchMessage{seeds::jaws_patch(r, vertices, triangles, own, own)})).empty());
    }
  Patch wrong = sent;
  wrong.opening = 1.5;
  CHECK(check(wrong) == PatchFault::out_of_range);
  wrong = sent;
  wrong.sphere.swing_rad = -1.2;
  CHECK(check(wrong) == PatchFault::out_of_range);
}

TEST_CASE("the crossing of scissors arrives with its slide, and does not turn besides") {
  Patch sent = seeds::needle_patch(5, 6, 8, 2);
  sent.opening = 0.5;
  sent.sphere.slide_m = 2000 * kToolStepM;
  CHECK(round_trip(sent).sphere == sent.sphere);
  sent.sphere.swing_rad = 0.25;
  CHECK(check(sent) == PatchFault::out_of_range);
  CHECK(seeds::bytes_of(seeds::message(PatchMessage{sent})).empty());
}

TEST_CASE("a tool's contacts that the surface of the terms moves arrive in few bytes, before those of other tools") {
  const Patch sent = seeds::jaws_patch(5, 6, 8, 5, 3), got = round_trip(sent);
  REQUIRE(got.others.count == 5);
  CHECK(got.others.own == 3);
  for (std::size_t j = 0; j < 3; ++j) {
    const OtherContact &a = got.others.of[j], &b = sent.others.of[j];
    CHECK(a.touching == b.touching);
    CHECK(a.sphere == b.sphere);
    CHECK((a.gap - b.gap).cwiseAbs().maxCoeff() <= 2 * kHalfStep * b.gap.cwiseAbs().maxCoeff());
    CHECK((a.normal - b.normal).norm() < 1e-4);
    CHECK((a.c_static - b.c_static).norm() < 1e-3 * b.c_static.norm());  // halves
    CHECK((a.rows.rows() == 3 && a.rows.cols() == 5 && a.rows.isZero(0)));
  }
  CHECK(got.others.of[4].rows.isApprox(sent.others.of[4].rows, 1e-3));
  CHECK(seeds::bytes_of(seeds::message(PatchMessage{got})) == seeds::bytes_of(seeds::message(PatchMessage{sent})));
}

TEST_CASE("a patch says whether terms follow, and a constant one with terms is refused") {
  Patch sent = seeds::touch_patch(3, 6, 5);
  CHECK_FALSE(round_trip(sent).has_terms);
  sent.has_terms = true;
  CHECK(round_trip(sent).has_terms);
  sent.constant = true;
  CHECK(check(sent) == PatchFault::sizes);
}

TEST_CASE("a tool's body that none can be is refused") {
  const Patch right = seeds::body_patch(5, 6, 8, 4, 3);
  REQUIRE(check(right) == PatchFault::none);
  const auto fault = [&](const std::function<void(Patch&)>& spoil) {
    Patch wrong = right;
    spoil(wrong);
    return check(wrong);
  };
  CHECK(fault([](Patch& p) { p.others.own = 5; }) == PatchFault::sizes);
  CHECK(fault([](Patch& p) { p.turn.reset(); }) == PatchFault::sizes);
  CHECK(fault([](Patch& p) { p.turn = Rotation(0.5, 0, 0, 0); }) == PatchFault::out_of_range);
  CHECK(fault([](Patch& p) { p.turn = Rotation(NAN, 0, 0, 1); }) == PatchFault::not_finite);
  CHECK(fault([](Patch& p) { p.sphere.radius_m = -1e-3; }) == PatchFault::out_of_range);
  CHECK(fault([](Patch& p) { p.others.of[1].sphere.centre.x() = 0.3; }) == PatchFault::out_of_range);
  CHECK(fault([](Patch& p) { p.torque.y() = NAN; }) == PatchFault::not_finite);
}

TEST_CASE("a needle's path arrives with its layers, and fits beside as many vertices as is said") {
  const Patch sent = seeds::needle_patch(5, 6, 8, 3), got = round_trip(sent);
  CHECK(got.needle.layers.count == 3);
  CHECK(got.needle.layers.length_m == Approx(0.04).epsilon(1e-7));
  CHECK(got.needle.tip.inside);
  CHECK(got.needle.tip.depth_m == Approx(0.013).epsilon(1e-7));
  CHECK(got.needle.tip.front_m == Approx(0.017).epsilon(1e-7));
  CHECK(got.needle.tip.layer == 1);
  for (std::size_t k = 0; k < 3; ++k) {
    const NeedleLayer &a = got.needle.layers.of[k], &b = sent.needle.layers.of[k];
    CHECK(a.begins_m == Approx(b.begins_m).epsilon(1e-7));
    CHECK(a.puncture_n == Approx(b.puncture_n).epsilon(1e-7));
    CHECK(a.cutting_n == Approx(b.cutting_n).epsilon(1e-7));
    CHECK(a.friction_n_m == Approx(b.friction_n_m).epsilon(1e-7));
  }
  for (std::size_t j = 0; j < kNeedlePoints; ++j) {
    const PatchNeedle::Point &a = got.needle.points[j], &b = sent.needle.points[j];
    check_float32(a.position, b.position);
    CHECK(a.bond_m == Approx(b.bond_m).epsilon(1e-7));
    CHECK((a.rows - b.rows).cwiseAbs().maxCoeff() <= 1e-4 * sent.surface.vertices[0].rows.cwiseAbs().maxCoeff());
  }
  CHECK(round_trip(seeds::body_patch(5, 6, 8, 0, 0)).needle.empty());
  for (int layers = 1; layers <= kMaxNeedleLayers; ++layers)
    for (int modes = 0; modes <= kMaxModes; ++modes) {
      const int vertices = max_port_vertices(modes, kMaxPortTriangles, false, 0, {0, true, layers});
      CAPTURE(layers, modes, vertices);
      if (modes <= 8) REQUIRE(vertices >= 3);
      if (vertices < 3) continue;
      const Patch full = seeds::needle_patch(modes, vertices, std::min(kMaxPortTriangles, most_triangles(vertices)), layers);
      CHECK_FALSE(seeds::bytes_of(seeds::message(PatchMessage{full})).empty());
    }
}

TEST_CASE("a thread arrives with its bites, and fits beside as many vertices as is said") {
  const Patch sent = seeds::suture_patch(5, 6, 8, 6), got = round_trip(sent);
  CHECK(got.suture.law.bites == 6);
  CHECK(got.suture.law.stiffness_n_m == Approx(2000));
  CHECK(got.suture.law.friction == Approx(0.12).epsilon(1e-7));
  CHECK(got.suture.law.drag_n == Approx(0.03).epsilon(1e-7));
  CHECK(got.suture.law.tear_n == Approx(0.4).epsilon(1e-7));
  CHECK(got.suture.law.first_tied);
  CHECK_FALSE(got.suture.law.last_tied);
  for (std::size_t i = 0; i < 7; ++i) CHECK(got.suture.length_m[i] == Approx(sent.suture.length_m[i]).epsilon(1e-7));
  for (std::size_t j = 0; j < 6; ++j) {
    check_float32(got.suture.bites[j].position, sent.suture.bites[j].position);
    CHECK((got.suture.bites[j].rows - sent.suture.bites[j].rows).cwiseAbs().maxCoeff() <=
          1e-4 * sent.surface.vertices[0].rows.cwiseAbs().maxCoeff());
  }
  CHECK(round_trip(seeds::touch_patch(5, 6, 8)).suture.empty());
  for (int bites = 1; bites <= kMaxBites; ++bites)
    for (int modes = 0; modes <= kMaxModes; ++modes) {
      PatchContacts contacts;
      contacts.bites = bites;
      const int vertices = max_port_vertices(modes, kMaxPortTriangles, false, 0, contacts);
      CAPTURE(bites, modes, vertices);
      if (modes <= 6) REQUIRE(vertices >= 3);
      if (vertices < 3) continue;
      const Patch full = seeds::suture_patch(modes, vertices, std::min(kMaxPortTriangles, most_triangles(vertices)), bites);
      CHECK_FALSE(seeds::bytes_of(seeds::message(PatchMessage{full})).empty());
    }
}

TEST_CASE("a thread that none can be is refused") {
  const Patch right = seeds::suture_patch(5, 6, 8, 3);
  REQUIRE(check(right) == PatchFault::none);
  const auto fault = [&](const std::function<void(PatchSuture&)>& spoil) {
    Patch wrong = right;
    spoil(wrong.suture);
    return check(wrong);
  };
  CHECK(fault([](PatchSuture& s) { s.law.bites = kMaxBites + 1; }) == PatchFault::sizes);
  CHECK(fault([](PatchSuture& s) { s.bites[2].rows.resize(3, 4); }) == PatchFault::sizes);
  CHECK(fault([](PatchSuture& s) { s.law.stiffness_n_m = 0; }) == PatchFault::out_of_range);
  CHECK(fault([](PatchSuture& s) { s.law.tear_n = -1; }) == PatchFault::out_of_range);
  CHECK(fault([](PatchSuture& s) { s.law.friction = -0.1; }) == PatchFault::out_of_range);
  CHECK(fault([](PatchSuture& s) { s.length_m[3] = -0.01; }) == PatchFault::out_of_range);
  CHECK(fault([](PatchSuture& s) { s.bites[1].position.y() = NAN; }) == PatchFault::not_finite);
}

TEST_CASE("a needle that none can be is refused") {
  const Patch right = seeds::needle_patch(5, 6, 8, 3);
  REQUIRE(check(right) == PatchFault::none);
  const auto fault = [&](const std::function<void(PatchNeedle&)>& spoil) {
    Patch wrong = right;
    spoil(wrong.needle);
    return check(wrong);
  };
  CHECK(fault([](PatchNeedle& n) { n.layers.count = kMaxNeedleLayers + 1; }) == PatchFault::sizes);
  CHECK(fault([](PatchNeedle& n) { n.points[2].rows.resize(3, 4); }) == PatchFault::sizes);
  CHECK(fault([](PatchNeedle& n) { n.layers.length_m = 0; }) == PatchFault::out_of_range);
  CHECK(fault([](PatchNeedle& n) { n.layers.of[0].begins_m = 0.001; }) == PatchFault::out_of_range);
  CHECK(fault([](PatchNeedle& n) { n.layers.of[2].begins_m = 0.010; }) == PatchFault::out_of_range);
  CHECK(fault([](PatchNeedle& n) { n.layers.of[1].friction_n_m = -1; }) == PatchFault::out_of_range);
  CHECK(fault([](PatchNeedle& n) { n.tip.depth_m = 0.018; }) == PatchFault::out_of_range);
  CHECK(fault([](PatchNeedle& n) { n.tip.front_m = 0.05; }) == PatchFault::out_of_range);
  CHECK(fault([](PatchNeedle& n) { n.tip.layer = 3; }) == PatchFault::out_of_range);
  CHECK(fault([](PatchNeedle& n) { n.points[4].position.x() = NAN; }) == PatchFault::not_finite);
  CHECK(fault([](PatchNeedle& n) { n.points[1].bond_m = NAN; }) == PatchFault::not_finite);
  CHECK(fault([](PatchNeedle& n) { n.layers.of[1].cutting_n = INFINITY; }) == PatchFault::not_finite);
  Patch upright = right;
  upright.turn.reset();
  CHECK(check(upright) == PatchFault::sizes);
}

TEST_CASE("other tools that no body can have are refused") {
  const Patch right = seeds::shared_patch(5, 6, 8, 2);
  REQUIRE(check(right) == PatchFault::none);
  const auto fault = [&](const std::function<void(OtherContact&)>& spoil) {
    Patch wrong = right;
    spoil(wrong.others.of[1]);
    return check(wrong);
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  CHECK(fault([](OtherContact& o) { o.gap.x() = kNan; }) == PatchFault::not_finite);
  CHECK(fault([](OtherContact& o) { o.velocity.y() = kNan; }) == PatchFault::not_finite);
  CHECK(fault([](OtherContact& o) { o.acceleration.z() = INFINITY; }) == PatchFault::not_finite);
  CHECK(fault([](OtherContact& o) { o.rows(1, 2) = kNan; }) == PatchFault::not_finite);
  CHECK(fault([](OtherContact& o) { o.gap.x() = 21; }) == PatchFault::out_of_range);
  CHECK(fault([](OtherContact& o) { o.normal *= 1.01; }) == PatchFault::out_of_range);
  CHECK(fault([](OtherContact& o) { o.normal.setZero(); }) == PatchFault::out_of_range);
  CHECK(fault([](OtherContact& o) { o.c_static = -o.c_static; }) == PatchFault::stiffness_indefinite);
  CHECK(fault([](OtherContact& o) { o.c_static(0, 1) += 1e-3; }) == PatchFault::stiffness_indefinite);
  CHECK(fault([](OtherContact& o) { o.rows.resize(3, 4); }) == PatchFault::sizes);
  Patch wrong = right;
  wrong.others.count = kMaxOtherContacts + 1;
  CHECK(check(wrong) == PatchFault::sizes);
  Patch grasp = seeds::attach_patch(5);
  grasp.others = right.others;
  CHECK(check(grasp) == PatchFault::sizes);
}

TEST_CASE("stress that fades arrives with the patch, and one that does not costs nothing") {
  for (Patch sent : {seeds::attach_patch(7), seeds::touch_patch(8, 8, 12)}) {
    CHECK(round_trip(sent).fading.count == 0);
    const auto bare = seeds::bytes_of(seeds::message(PatchMessage{sent})).size();
    const Eigen::Index variables = sent.modes() + (sent.contact == ContactKind::attach ? 3 : 0);
    sent.fading.count = 2;
    sent.fading.of[0] = {{0.4, 0.5}, BoundedMatrix<kMaxModes + 3, 1>::LinSpaced(variables, -3, 5)};
    sent.fading.of[1] = {{0.25, 50}, BoundedMatrix<kMaxModes + 3, 1>::Zero(variables)};
    const Patch got = round_trip(sent);
    REQUIRE(got.fading.count == 2);
    CHECK(got.fading.of[0].prony.share == Approx(0.4).epsilon(1e-6));
    CHECK(got.fading.of[1].prony.time_s == 50);
    CHECK((got.fading.of[0].pull - sent.fading.of[0].pull).cwiseAbs().maxCoeff() <= 5.0 / 32767);
    CHECK(got.fading.of[1].pull.isZero(0));
    const auto most = bare + 24 + 4 + 2 * (12 + 2 * static_cast<std::size_t>(variables));
    CHECK(seeds::bytes_of(seeds::message(PatchMessage{sent})).size() <= most);

    for (Patch wrong : {sent, sent, sent, sent}) {
      static int which = 0;
      if (which % 4 == 0) wrong.fading.of[0].prony.share = 0.8;  // 1.05 in total
      if (which % 4 == 1) wrong.fading.of[0].prony.time_s = 0.001;
      if (which % 4 == 2) wrong.fading.of[1].pull[0] = 1e13;
      if (which++ % 4 == 3) wrong.fading.of[1].pull.resize(variables - 1);
      CHECK(check(wrong) != PatchFault::none);
    }
  }
  for (int branches = 0; branches <= static_cast<int>(kMaxPronyBranches); ++branches) {
    Patch sent = seeds::attach_patch(max_port_modes(ContactKind::attach, branches));
    CHECK((branches > 0 || sent.modes() == kMaxModes));
    CHECK(sent.modes() >= 12);
    sent.load_rate = ModeVector::Ones(sent.modes());
    sent.load_for = Micros{1};
    sent.fading.count = branches;
    for (PatchBranch& branch : sent.fading.branches())
      branch = {{0.1, 1}, BoundedMatrix<kMaxModes + 3, 1>::Ones(sent.modes() + 3)};
    CHECK_FALSE(seeds::bytes_of(seeds::message(PatchMessage{sent})).empty());
  }
  const int branches = static_cast<int>(kMaxPronyBranches), most_modes = max_port_modes(ContactKind::touch, branches);
  CHECK(most_modes >= 13);
  for (int modes = 1; modes <= most_modes; ++modes) {
    const int vertices = max_port_vertices(modes, kMaxPortTriangles, true, branches);
    REQUIRE(vertices >= 3);
    Patch sent = seeds::touch_patch(modes, vertices, std::min(16, most_triangles(vertices)));
    sent.load_rate = ModeVector::Ones(modes);
    sent.load_for = Micros{1};
    sent.fading.count = branches;
    for (PatchBranch& branch : sent.fading.branches()) branch = {{0.1, 1}, ModeVector::Ones(modes)};
    CHECK_FALSE(seeds::bytes_of(seeds::message(PatchMessage{sent})).empty());
  }
}

TEST_CASE("a constant patch carries its force and nothing of a model") {
  Patch sent = seeds::common_patch(ContactKind::attach);
  sent.constant = true;
  sent.scheme = Scheme::hold;
  const Patch got = round_trip(sent);
  check_common(got, sent);
  CHECK(got.modes() == 0);
}

TEST_CASE("rounding leaves singular damping acceptable where there was left room for it") {
  // Rank one: every rounding error may push an eigenvalue below zero.
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::mt19937 random(seed);
    Patch patch = seeds::attach_patch(11);
    Eigen::VectorXd direction(14);
    for (int i = 0; i < 14; ++i) direction[i] = seeds::noise(random) * std::pow(10.0, i % 5);
    const Eigen::MatrixXd d = direction * direction.transpose();
    patch.d_port = d.topLeftCorner(3, 3);
    patch.b_d = -d.bottomLeftCorner(11, 3);
    patch.damping = d.bottomRightCorner(11, 11);
    REQUIRE(check(patch) == PatchFault::none);
    const ModeVector at_stamp = patch.g - patch.damping * patch.q_rate;
    leave_room_for_rounding(patch);
    CHECK((patch.g - patch.damping * patch.q_rate - at_stamp).norm() < 1e-9 * patch.g.norm());
    REQUIRE(check(round_trip(patch)) == PatchFault::none);
  }
}

TEST_CASE("a patch that its own sender should have refused is refused on receipt") {
  Patch patch = seeds::attach_patch(5);
  patch.damping(2, 2) = -1;
  Message out;
  CHECK(decode(seeds::bytes_of(seeds::message(PatchMessage{patch})), out) == WireFault::patch_refused);
  patch = seeds::touch_patch(5, 9, 8);
  patch.surface.triangles[3] = {1, 2, 15};
  CHECK(decode(seeds::bytes_of(seeds::message(PatchMessage{patch})), out) == WireFault::patch_refused);
}
