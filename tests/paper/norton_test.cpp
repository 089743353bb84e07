#include "bench/paper/norton.hpp"

#include <catch2/catch.hpp>
#include <cmath>

using namespace palpate;

namespace {

constexpr double kTickS = 1e-3;

/// A smooth motion along both axes, small compared with an element.
PortMotion wave(Eigen::Index ports, std::size_t ticks) {
  PortMotion m;
  Vector before = Vector::Zero(ports);
  for (std::size_t n = 0; n < ticks; ++n) {
    const double t = static_cast<double>(n) * kTickS;
    Vector d(ports);
    for (Eigen::Index j = 0; j < ports; ++j) d[j] = 1e-7 * std::sin(9 * t + 40 * t * t + static_cast<double>(j));
    d *= 1 - std::exp(-t / 0.05);
    m.d.push_back(d);
    m.rate.push_back((d - before) / kTickS);
    before = d;
  }
  return m;
}

std::vector<std::uint8_t> near(const Specimen& sheet, const SecondOrderSystem& s, int layers) {
  const auto nodes = sheet.near_port(layers);
  std::vector<std::uint8_t> fine;
  for (const std::uint32_t c : s.coordinates) fine.push_back(nodes[c / 3]);
  return fine;
}

double relative(const std::vector<Vector>& a, const std::vector<Vector>& b) {
  double error = 0, power = 0;
  for (std::size_t n = 0; n < b.size(); ++n) {
    error += (a[n] - b[n]).squaredNorm();
    power += b[n].squaredNorm();
  }
  return std::sqrt(error / power);
}

}  // namespace

TEST_CASE("a mesh split at equal rates is the unsplit mesh to rounding", "[paper]") {
  const Specimen sheet = Specimen::sheet(7, {});
  const SecondOrderSystem s = sheet.system();
  const PortMotion motion = wave(s.ports(), 300);
  const MeshRun whole = step_whole(s, motion, kTickS);
  for (const int layers : {1, 2}) CHECK(relative(step_split(s, near(sheet, s, layers), 1, motion, kTickS), whole.force) < 1e-11);
}

TEST_CASE("the unsplit mesh answers a slow ramp with the static stiffness of its transfer function", "[paper]") {
  const Specimen sheet = Specimen::sheet(5, {});
  const SecondOrderSystem s = sheet.system();
  PortMotion motion;
  const Vector end = Vector::Constant(s.ports(), 1e-6);
  for (int n = 0; n < 3000; ++n) {
    const double share = std::min(1.0, n / 1000.0);
    motion.d.push_back(share * end);
    motion.rate.push_back((share < 1 && n > 0 ? 1.0 : 0.0) * end);
  }
  const Vector expected = (TransferFunction(s)(0).real() * end);
  CHECK((step_whole(s, motion, kTickS).force.back() - expected).norm() < 1e-8 * expected.norm());
}

TEST_CASE("a coarse side at a tenth of the rate comes to the same rest, and nearer the faster it runs", "[paper]") {
  const Specimen sheet = Specimen::sheet(7, {});
  const SecondOrderSystem s = sheet.system();
  const auto fine = near(sheet, s, 2);
  const PortMotion motion = wave(s.ports(), 600);
  const MeshRun whole = step_whole(s, motion, kTickS);
  const double at_500_hz = relative(step_split(s, fine, 2, motion, kTickS), whole.force),
               at_100_hz = relative(step_split(s, fine, 10, motion, kTickS), whole.force),
               at_20_hz = relative(step_split(s, fine, 50, motion, kTickS), whole.force);
  CHECK(at_500_hz < at_100_hz);
  CHECK(at_100_hz < at_20_hz);
  CHECK(at_500_hz < 0.01);
}

TEST_CASE("a patch built at every tick shows the whole mesh's force, and the port may not pull at the coarse side", "[paper]") {
  const Specimen sheet = Specimen::sheet(7, {});
  const SecondOrderSystem s = sheet.system();
  const PortMotion motion = wave(s.ports(), 400);
  const MeshRun whole = step_whole(s, motion, kTickS);
  CHECK(relative(hold_frames(whole, 1), whole.force) == 0);
  CHECK(relative(play_patches(sheet, s, whole, motion, 20, Scheme::port), whole.force) < 0.01);
  CHECK_THROWS_AS(step_split(s, std::vector<std::uint8_t>(s.coordinates.size(), 0), 1, motion, kTickS), std::invalid_argument);
}
