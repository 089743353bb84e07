// The terms of a patch in datagrams: they arrive as sent, with the precision of their numbers, and invalid ones are refused.
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cstring>
#include <limits>
#include <optional>

#include "seeds.hpp"

using namespace palpate;

namespace {

PatchTerms round_trip(const PatchTerms& piece) {
  const auto bytes = seeds::bytes_of(seeds::message(piece));
  REQUIRE(bytes.size() > 0);
  CHECK(bytes.size() <= kMaxDatagramBytes);
  Message out;
  REQUIRE(decode(bytes, out) == WireFault::none);
  return std::get<PatchTerms>(out.body);
}

/// Terms that a client has for a patch after all their pieces came.
std::optional<NonlinearTerms> arrived(const NonlinearTerms& terms, const Patch& patch) {
  TermsAssembly assembly;
  for (const PatchTerms& piece : to_pieces(terms, patch.seq)) CHECK(assembly.take(round_trip(piece)));
  return assembly.terms_for(patch);
}

/// Size of a patch and its terms, datagrams included.
std::size_t bytes_of(const Patch& patch, const NonlinearTerms& terms) {
  std::size_t bytes = seeds::bytes_of(seeds::message(PatchMessage{patch})).size();
  for (const PatchTerms& piece : to_pieces(terms, patch.seq)) bytes += seeds::bytes_of(seeds::message(piece)).size();
  return bytes;
}

template <class A, class B>
void check_half(const A& got, const B& sent) {
  REQUIRE(got.rows() == sent.rows());
  REQUIRE(got.cols() == sent.cols());
  if (sent.size() > 0) CHECK((got - sent).cwiseAbs().maxCoeff() <= 5e-4 * sent.cwiseAbs().maxCoeff());
}

}  // namespace

TEST_CASE("terms that are springs arrive, how nodes move to the last bit, and those that no spring can be do not count") {
  for (const bool grasp : {true, false}) {
    const int tool = grasp ? 3 : 0;
    const NonlinearTerms sent = seeds::spring_terms(12, grasp, 34, 15);
    const Patch patch = grasp ? seeds::attach_patch(12) : seeds::touch_patch(12, 4, 3);
    const auto got = arrived(sent, patch);
    REQUIRE(got);
    CHECK(got->variables == sent.variables);
    CHECK(got->grasp == grasp);
    CHECK(got->elements.stiffening == sent.elements.stiffening);
    CHECK(got->elements.motion.rows(tool) == sent.elements.motion.rows(tool));
    CHECK(got->elements.nodes == sent.elements.nodes);
    CHECK((got->elements.spans() - sent.elements.spans()).cwiseAbs().maxCoeff() < 1e-6F);
    CHECK((got->elements.rest_length - sent.elements.rest_length).cwiseAbs().maxCoeff() < 1e-6F);
    check_half(got->elements.stiffness, sent.elements.stiffness);
    check_half(got->elements.damping, sent.elements.damping);
    CHECK(got->elements.max_slope == sent.elements.max_slope);
    check_half(got->e2, sent.e2);
    CHECK(got->rate == stamp_rate(patch));
    NonlinearTerms bad = sent;
    bad.elements.stiffness[3] = -1;
    CHECK_FALSE(arrived(bad, patch));
    bad = sent;
    bad.elements.max_slope.pop_back();
    CHECK(to_pieces(bad, patch.seq).empty());
    bad = sent;
    bad.elements.damping[7] = -1;
    CHECK_FALSE(arrived(bad, patch));
    bad = sent;
    bad.elements.rest_length[5] = 0;
    CHECK_FALSE(arrived(bad, patch));
    bad = sent;
    bad.elements.nodes(1, 33) = 15;
    CHECK_FALSE(arrived(bad, patch));
    bad = sent;
    bad.elements.motion.parent[4] = 5;
    CHECK_FALSE(arrived(bad, patch));
    bad = sent;
    bad.elements.motion.tool = 15;
    CHECK_FALSE(arrived(bad, patch));
  }
  CHECK(to_pieces(seeds::spring_terms(12, true, kMaxSprings + 1, 15), 1).empty());
  CHECK(to_pieces(seeds::spring_terms(12, true, 34, kMaxSampledNodes + 1), 1).empty());
}

TEST_CASE("terms that are tetrahedra arrive, how nodes move to the last bit, and those that no tetrahedron can be do not count") {
  for (const bool grasp : {true, false}) {
    const int tool = grasp ? 3 : 0;
    const NonlinearTerms sent = seeds::solid_terms(12, grasp, 34, 15);
    const Patch patch = grasp ? seeds::attach_patch(12) : seeds::touch_patch(12, 4, 3);
    const auto got = arrived(sent, patch);
    REQUIRE(got);
    CHECK(got->variables == sent.variables);
    CHECK(got->grasp == grasp);
    CHECK(got->elements.motion.rows(tool) == sent.elements.motion.rows(tool));
    const LawParameters &law = got->elements.law, &sent_law = sent.elements.law;
    CHECK(law.kind == sent_law.kind);
    CHECK(law.shape == Approx(sent_law.shape));
    for (std::size_t p = 0; p < 2; ++p) CHECK(law.exponents[p] == Approx(sent_law.exponents[p]).epsilon(5e-4));
    for (std::size_t a = 0; a < 3; ++a) CHECK(law.fibres.direction[a] == Approx(sent_law.fibres.direction[a]).margin(5e-4));
    CHECK(law.fibres.share == Approx(sent_law.fibres.share).epsilon(5e-4));
    CHECK(law.fibres.exponent == Approx(sent_law.fibres.exponent).epsilon(5e-4));
    CHECK(got->elements.nodes == sent.elements.nodes);
    for (const auto place : {&SampledElements::position, &SampledElements::rest}) {
      const Eigen::Matrix3Xf &there = got->elements.*place, &here = sent.elements.*place;
      CHECK(((there.colwise() - there.col(0)) - (here.colwise() - here.col(0))).cwiseAbs().maxCoeff() < 5e-6F);
    }
    check_half(got->elements.stiffness, sent.elements.stiffness);
    check_half(got->elements.dilation, sent.elements.dilation);
    check_half(got->elements.damping, sent.elements.damping);
    check_half(got->e2, sent.e2);
    const auto refused = [&](auto change) {
      NonlinearTerms bad = sent;
      change(bad.elements);
      return !arrived(bad, patch);
    };
    CHECK(refused([](SampledElements& s) { s.stiffness[3] = -1; }));
    CHECK(refused([](SampledElements& s) { s.dilation[3] = -1; }));
    CHECK(refused([](SampledElements& s) { s.damping[7] = -1; }));
    CHECK(refused([](SampledElements& s) { s.nodes(1, 33) = 15; }));
    CHECK(refused([](SampledElements& s) { s.nodes(1, 33) = s.nodes(0, 33); }));          // zero volume
    CHECK(refused([](SampledElements& s) { std::swap(s.nodes(1, 9), s.nodes(2, 9)); }));  // negative volume
    CHECK(refused([](SampledElements& s) { s.motion.parent[4] = 5; }));
    CHECK(refused([](SampledElements& s) { s.motion.tool = 15; }));
    CHECK(refused([](SampledElements& s) { s.rest(1, 2) = std::numeric_limits<float>::quiet_NaN(); }));
  }
  CHECK(to_pieces(seeds::solid_terms(12, true, kMaxFiniteElements + 1, 15), 1).empty());
  CHECK(to_pieces(seeds::solid_terms(12, true, 34, kMaxSampledNodes + 1), 1).empty());
}

TEST_CASE("how nodes move is right to half a byte's step of what each moves more than another one") {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> draw(-1, 1);
  constexpr int kNodes = 40, kModes = 7;
  Eigen::MatrixXf rows(3 * kNodes, kModes);
  for (int k = 0; k < kModes; ++k) {
    rows.col(k).setConstant(std::pow(10.0F, static_cast<float>(k - 3)));
    for (float& v : rows.col(k)) v *= 1 + 0.01F * draw(random);  // nearly equal
  }
  const NodeMotion motion = rounded(rows, -1);
  const Eigen::MatrixXf wrong = motion.rows(0) - rows;
  for (int i = 0; i < kNodes; ++i)
    for (int axis = 0; axis < 3; ++axis)
      for (int k = 0; k < kModes; ++k)
        CHECK(std::abs(wrong(3 * i + axis, k)) <= 1.01F * motion.step[i] * motion.scale[k] / (2 * NodeMotion::kByteMax));
  // All but the first are relative to another one, and a hundredth as large.
  CHECK(motion.step.tail(kNodes - 1).maxCoeff() < 0.05F * motion.step[0]);
  const Eigen::MatrixXf held = motion.rows(3);
  CHECK(held.leftCols(3).norm() == 0);
  CHECK(held.rightCols(kModes) == motion.rows(0));
}

TEST_CASE("A patch of any number of modes and terms that fill their budget take at most 7200 bytes") {
  for (const int modes : {1, 8, 13, kMaxModes})
    for (const bool repaired : {false, true})
      for (const bool grasp : {false, true}) {
        const int first = std::min(max_port_vertices(modes), kMaxPortVertices - 1);
        CAPTURE(modes, repaired, grasp, first);
        const TermsBudget budget{modes + (grasp ? 3 : 0), grasp, repaired, grasp ? 0 : first, true};
        int nodes = 0;
        while (nodes < kMaxSampledNodes && numbers_of(budget, nodes + 1, 2 * nodes + 2) <= kUsualNumbers) ++nodes;
        REQUIRE(nodes >= 32);
        NonlinearTerms terms = seeds::spring_terms(modes, grasp, 2 * nodes, nodes);
        if (!repaired) terms.e2.resize(0);
        Patch patch = grasp ? seeds::attach_patch(modes) : seeds::touch_patch(modes, kMaxPortVertices, kMaxPortTriangles);
        if (!grasp) seeds::move_surface(first, 1, patch, terms);
        CHECK(bytes_of(patch, terms) <= 7200);
      }
}

TEST_CASE("the surface that terms bring joins the patch's own, or the terms do not count") {
  const bool alone = GENERATE(false, true);  // without elements, as those of a linear patch
  CAPTURE(alone);
  constexpr int kTriangles = 20;
  const Patch whole = seeds::touch_patch(12, kMaxPortVertices, kTriangles);
  Patch patch = whole;
  NonlinearTerms sent = alone ? seeds::surface_terms(12) : seeds::spring_terms(12, false, 60, 30);
  seeds::move_surface(5, 3, patch, sent);
  const auto got = arrived(sent, patch);
  REQUIRE(got);
  const Patch joined = extended(patch, *got);
  REQUIRE(joined.surface.vertex_count == kMaxPortVertices);
  REQUIRE(joined.surface.triangle_count == kTriangles);
  CHECK(joined.surface.triangles == whole.surface.triangles);
  Eigen::VectorXd most = Eigen::VectorXd::Zero(12);  // for each mode
  for (int i = 5; i < kMaxPortVertices; ++i)
    most = most.cwiseMax(whole.surface.vertices[static_cast<std::size_t>(i)].rows.cwiseAbs().colwise().maxCoeff().transpose());
  for (std::size_t i = 5; i < kMaxPortVertices; ++i) {
    const PortVertex &vertex = joined.surface.vertices[i], &expected = whole.surface.vertices[i];
    CHECK((vertex.position - expected.position).cwiseAbs().maxCoeff() < 0x1p-21);
    for (int k = 0; k < 12; ++k)  // for two that move in opposite directions, half a byte's step
      CHECK((vertex.rows.col(k) - expected.rows.col(k)).cwiseAbs().maxCoeff() < 1.01 * 2 * most[k] / (2 * NodeMotion::kByteMax));
    check_half(vertex.normal, expected.normal);
  }
  CHECK(bytes_of(patch, sent) < 7200);

  NonlinearTerms bad = sent;
  bad.triangles[2][1] = kMaxPortVertices - 1;
  CHECK(arrived(bad, patch));
  bad.vertices.pop_back();  // that vertex no longer exists
  CHECK_FALSE(arrived(bad, patch));
  bad = sent;
  bad.triangles[2] = {4, 4, 6};  // zero area
  CHECK_FALSE(arrived(bad, patch));
  bad = sent;
  bad.vertices[3].position.x() = 11;
  CHECK_FALSE(arrived(bad, patch));
  bad = sent;
  bad.vertices.push_back(bad.vertices.back());  // one more than there is room for
  CHECK_FALSE(arrived(bad, patch));
  bad.vertices.resize(kMaxPortVertices + 1, bad.vertices.back());
  CHECK(to_pieces(bad, 1).empty());
  for (const auto part : {0, 1}) {
    bad = sent;
    (part == 0 ? bad.vertices[4].position.y() : bad.vertices[4].rows(2, 7)) = std::numeric_limits<double>::quiet_NaN();
    CHECK(to_pieces(bad, 1).empty());
  }
  NonlinearTerms grasp = seeds::spring_terms(6, true, 9, 5);
  grasp.triangles.push_back({0, 1, 2});
  CHECK(to_pieces(grasp, 1).empty());
}

TEST_CASE("pieces that are not sane are not sent, and are dropped and counted when they come") {
  const PatchTerms good = to_pieces(seeds::spring_terms(6, true, 60, 40), 42).front();
  CHECK(check(good) == TermsFault::none);
  PatchTerms bad = good;
  bad.numbers[7] = 0x7c00;  // infinity
  CHECK(check(bad) == TermsFault::not_finite);
  CHECK(seeds::bytes_of(seeds::message(bad)).empty());
  bad = good;
  bad.stiffening = std::numeric_limits<float>::quiet_NaN();
  CHECK(check(bad) == TermsFault::not_finite);
  bad = good;
  bad.unit[2] = -1;
  CHECK(check(bad) == TermsFault::out_of_range);
  bad = good;
  bad.piece = static_cast<std::uint8_t>(bad.pieces);  // beyond the last
  CHECK(check(bad) == TermsFault::sizes);
  bad = good;
  bad.numbers.pop_back();
  CHECK(check(bad) == TermsFault::sizes);
  for (const int variables : {0, 2, 3, kMaxVariables + 1, 255}) {
    bad = good;
    bad.variables = static_cast<std::uint8_t>(variables);
    CHECK(check(bad) == TermsFault::sizes);
  }
  bad = good;
  bad.elements = 0;  // between nodes
  CHECK(check(bad) == TermsFault::sizes);
  for (const float number : {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    for (const auto place : {&NodeMotion::scale, &NodeMotion::step}) {
      NonlinearTerms springs = seeds::spring_terms(6, true, 9, 5);
      (springs.elements.motion.*place)[4] = number;
      CHECK(to_pieces(springs, 1).empty());
    }
    NonlinearTerms springs = seeds::spring_terms(6, true, 9, 5);
    springs.elements.position(1, 3) = number;
    CHECK(to_pieces(springs, 1).empty());
  }
}

TEST_CASE("terms of a law that no finite element of a solid has are refused") {
  constexpr std::uint32_t kSeq = 0x51c0ffee;
  constexpr std::ptrdiff_t kLaw = 46;  // bytes after patch_seq, the first of the head (schema/wire.fbs)
  auto bytes = seeds::bytes_of(seeds::message(to_pieces(seeds::solid_terms(6, true, 9, 8), kSeq).front()));
  std::array<std::byte, sizeof kSeq> seq{};
  std::memcpy(seq.data(), &kSeq, sizeof kSeq);
  const auto head = std::search(bytes.begin(), bytes.end(), seq.begin(), seq.end());
  REQUIRE(head[kLaw] == static_cast<std::byte>(SolidLaw::corotational));
  Message out;
  CHECK(decode(bytes, out) == WireFault::none);
  for (const auto law : {static_cast<std::byte>(SolidLaw::membrane), std::byte{200}}) {
    head[kLaw] = law;
    CHECK(decode(bytes, out) == WireFault::out_of_range);
  }
}
