// Models of the paper's sheet at its port against scaling laws, interpolation, symmetry and dense sampling.
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "bench/paper/local_models.hpp"
#include "bench/paper/port_study.hpp"
#include "bench/paper/truncation_map.hpp"

namespace palpate {
namespace {

const std::string kSource = PALPATE_SOURCE_DIR;

double distance(const ComplexMatrix& a, const ComplexMatrix& b) { return (a - b).norm() / b.norm(); }

TEST_CASE("The specimen is the body of scenes/sheet13.json, and has the paper's 524 states", "[paper]") {
  const Specimen sheet = Specimen::sheet(kPaperNodes, {});
  const Scene scene = load_scene(kSource + "/scenes/sheet13.json");
  REQUIRE(sheet.body().nodes.size() == scene.body.nodes.size());
  REQUIRE(sheet.body().elements.size() == scene.body.elements.size());
  for (std::size_t i = 0; i < scene.body.nodes.size(); ++i) {
    CHECK((sheet.body().nodes[i] - scene.body.nodes[i]).norm() < 1e-15);
    CHECK(sheet.body().masses_kg[i] == Approx(scene.body.masses_kg[i]).epsilon(1e-12));
    CHECK(sheet.body().fixed[i] == scene.body.fixed[i]);
  }
  for (std::size_t e = 0; e < scene.body.elements.size(); ++e)
    CHECK(sheet.body().elements[e].damping_n_s_m == scene.body.elements[e].damping_n_s_m);
  CHECK(sheet.port_node() == scene.tool.node);
  CHECK(2 * sheet.system().size() == 524);
  CHECK(sheet.system().ports() == 2);
}

TEST_CASE("The cube has the paper's 6000 states less those of the held node", "[paper]") {
  const SecondOrderSystem cube = Specimen::cube(10, {}).system();
  CHECK(2 * cube.size() == 6000 - 6);
  CHECK(cube.ports() == 3);
}

TEST_CASE("But for the scales of force and time the response depends on b / sqrt(k m) alone", "[paper]") {
  const double force = 7, mass = 0.3, time = std::sqrt(mass / force);
  const Material one{100, 0.5, 0.001}, other{100 * force, 0.5 * std::sqrt(force * mass), 0.001 * mass};
  CHECK(other.damping_ratio() == Approx(one.damping_ratio()).epsilon(1e-12));
  const SecondOrderSystem a = Specimen::sheet(7, one).system(), b = Specimen::sheet(7, other).system();
  const TransferFunction g(a), h(b);
  for (const Complex s : {Complex(0, 0), Complex(0, 40), Complex(3, 200)}) CHECK(distance(h(s / time), force * g(s)) < 1e-10);
}

TEST_CASE("Normal and tangential do not couple at the middle of the edge, by symmetry", "[paper]") {
  const SecondOrderSystem system = Specimen::sheet(kPaperNodes, {}).system();
  const TransferFunction g(system);
  constexpr double kMinus200Db = 1e-10;
  for (const double f : log_frequencies(0.1, 1000, 5)) {
    const ComplexMatrix v = g(Complex(0, 2 * std::numbers::pi * f));
    CHECK(std::abs(v(0, 1)) < kMinus200Db * std::abs(v(1, 1)));
    CHECK(std::abs(v(1, 0)) < kMinus200Db * std::abs(v(1, 1)));
  }
}

TEST_CASE("Rings have the nodes of their layers, grow softer and end as the whole body", "[paper]") {
  const Specimen sheet = Specimen::sheet(kPaperNodes, {});
  const SecondOrderSystem system = sheet.system();
  const ComplexMatrix rest = TransferFunction(system)(0);
  double stiffness = 1e300;
  for (const int layers : {1, 2, 3, 4}) {
    const SecondOrderSystem ring = sheet.ring(layers);
    CHECK(ring.size() == 2 * ((2 * layers + 1) * (layers + 1) - 1));
    const double normal = TransferFunction(ring)(0)(1, 1).real();
    CHECK(normal < stiffness);
    CHECK(normal > rest(1, 1).real());
    stiffness = normal;
  }
  const SecondOrderSystem all = sheet.ring(kPaperNodes);
  CHECK(all.size() == system.size());
  CHECK(distance(TransferFunction(all)(Complex(0, 100)), TransferFunction(system)(Complex(0, 100))) < 1e-12);
}

TEST_CASE("Static condensation keeps the stiffness at rest with the ring's number of states", "[paper]") {
  const Specimen sheet = Specimen::sheet(9, {});
  const SecondOrderSystem system = sheet.system(), small = condensed(sheet, system, 1);
  CHECK(small.size() == sheet.ring(1).size());
  CHECK(distance(TransferFunction(small)(0), TransferFunction(system)(0)) < 1e-12);
  CHECK(distance(TransferFunction(small)(Complex(0, 300)), TransferFunction(system)(Complex(0, 300))) > 1e-3);
}

TEST_CASE("A port basis responds exactly at its shifts, real and imaginary", "[paper]") {
  const Specimen sheet = Specimen::sheet(9, {100, 0.1, 0.001});
  const SecondOrderSystem system = sheet.system();
  const std::vector<Complex> shifts{20, Complex(0, 100), Complex(0, 300)};
  const SecondOrderSystem small = krylov(system, shifts);
  CHECK(small.size() == 2 * (1 + 2 + 2));
  for (const Complex s : shifts) CHECK(distance(TransferFunction(small)(s), TransferFunction(system)(s)) < 1e-9);
  CHECK(distance(TransferFunction(small)(Complex(0, 200)), TransferFunction(system)(Complex(0, 200))) > 1e-9);
}

TEST_CASE("The server's basis matches the response and its slope at its shift", "[paper]") {
  const Specimen sheet = Specimen::sheet(9, {});
  const SecondOrderSystem system = sheet.system(), small = krylov_moments(sheet, system, 20, 6);
  CHECK(small.size() == 6);
  const TransferFunction g(system), r(small);
  const double step = 0.1;
  CHECK(distance(r(20), g(20)) < 1e-9);
  CHECK(distance(r(20 + step) - r(20 - step), g(20 + step) - g(20 - step)) < 1e-7);
}

TEST_CASE("The patch that is sent responds as the whole sheet where it is made for", "[paper]") {
  const Specimen sheet = Specimen::sheet(kPaperNodes, {});
  const SecondOrderSystem system = sheet.system(), patch = patch_model(sheet, system, 22);
  CHECK(2 * patch.size() == 22);
  CHECK(distance(TransferFunction(patch)(0), TransferFunction(system)(0)) < 1e-9);
  CHECK(distance(TransferFunction(patch)(Complex(0, 60)), TransferFunction(system)(Complex(0, 60))) < 1e-3);
}

TEST_CASE("Ten balanced states have less than 1 % where damping is strong, computed as sampled, within the bounds", "[paper]") {
  const SecondOrderSystem system = Specimen::sheet(kPaperNodes, {}).system();
  const BalancedReduction balanced(system);
  const StateSpace ten = balanced.truncated(10);
  const ReductionError error = reduction_error(balanced, ten);
  CHECK(error.peak.norm / proper_norm(balanced).norm < 0.01);
  CHECK(error.peak.norm <= balanced.error_bound(10));
  CHECK(error.peak.norm + error.uncertainty >= balanced.hankel()[10]);
  const TransferFunction full(system);
  const PeakGain sampled = sampled_peak([&](Complex s) -> ComplexMatrix { return full(s) - ten.transfer(s); }, 0.1, 1e5, 200);
  CHECK(sampled.norm == Approx(error.peak.norm).epsilon(1e-4));
}

TEST_CASE("Where damping is light ten states are not enough for 1 %, and the map says how many are", "[paper]") {
  const std::vector<double> dampings{0.1, 0.5};
  const std::vector<int> orders{6, 10, 20, 26};
  const std::vector<MapPoint> map = truncation_map(kPaperNodes, {}, dampings, orders);
  REQUIRE(map.size() == 8);
  for (const MapPoint& p : map) CHECK(p.error <= p.bound * (1 + 1e-6));
  const auto needed = orders_needed(map, 0.01);
  CHECK(needed[0].order == 20);
  CHECK(needed[1].order == 10);
  const double ratio = ratio_needed(map, 10, 0.01);
  CHECK(ratio > map.front().damping_ratio);
  CHECK(ratio < map.back().damping_ratio);
}

TEST_CASE("Thresholds are interpolated along a power law exactly and are infinite where nothing is enough", "[paper]") {
  std::vector<MapPoint> map;
  for (const double ratio : {0.1, 1.0, 10.0})
    for (const int order : {4, 8}) map.push_back({ratio, ratio, order, 0.02 / ratio / order, 1});
  CHECK(ratio_needed(map, 4, 0.001) == Approx(5).epsilon(1e-12));
  CHECK(std::isinf(ratio_needed(map, 4, 1e-6)));
  CHECK(ratio_needed(map, 8, 1) == 0.1);
  CHECK(orders_needed(map, 0.003)[1].order == 8);
  CHECK(orders_needed(map, 0.003)[0].order == 0);
}

TEST_CASE("Errors are those of the worst direction against the largest force, by band", "[paper]") {
  const std::vector<double> f = log_frequencies(1, 1000, 10);
  CHECK(f.size() == 31);
  CHECK(f[10] == Approx(10).epsilon(1e-12));
  CHECK(f.back() == 1000);
  const Transfer body = [](Complex s) -> ComplexMatrix { return s * ComplexMatrix(Eigen::Vector2cd(2, 1).asDiagonal()); };
  const Transfer model = [](Complex s) -> ComplexMatrix {
    return s * ComplexMatrix(Eigen::Vector2cd(2, 1 + 1.0 / std::abs(s)).asDiagonal());
  };
  const auto error = relative_error(sample(model, f), sample(body, f));
  // |difference| = 1, |body| = 2 omega: the worst of a band is at its lower end.
  CHECK(worst_in_band(f, error, 10, 100) == Approx(1 / (2 * 2 * std::numbers::pi * 10)).epsilon(1e-9));
}

TEST_CASE("A study names its models, the whole body first, and its errors agree with its curves", "[paper]") {
  const Specimen sheet = Specimen::sheet(7, {});
  const BalancedReduction balanced(sheet.system());
  PortStudyOptions options;
  options.orders = {6, 10};
  options.rings = 2;
  options.per_decade = 20;
  const PortStudy study = study_port(sheet, balanced, options);
  CHECK(study.full().name == "full");
  CHECK(study.full().states == 2 * sheet.system().size());
  CHECK(study.find("balanced-6")->states == 6);
  CHECK(study.find("nothing") == nullptr);
  for (const PortModel& m : study.models) {
    CHECK(m.hinf_sampled_n_m <= m.hinf.peak.norm * (1 + 1e-6) + m.hinf.uncertainty);
    CHECK(m.error.size() == m.response.frequency_hz.size());
  }
  CHECK(study.find("balanced-10")->hinf.relative < study.find("balanced-6")->hinf.relative);
  CHECK(study.find("ring-2")->dc_rel_error < study.find("ring-1")->dc_rel_error);
  CHECK(study.find("condensed-1")->dc_rel_error < 1e-12);
}

}  // namespace
}  // namespace palpate
