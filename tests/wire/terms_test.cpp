// The terms of a patch in datagrams: what arrives is what was sent, to half precision, and nothing that is not sane gets through.
#include <catch2/catch.hpp>
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

/// What a client has of terms for a patch, when all their pieces came.
std::optional<CubicTerms> arrived(const CubicTerms& terms, const Patch& patch) {
  TermsAssembly assembly;
  for (const PatchTerms& piece : to_pieces(terms, patch.seq)) CHECK(assembly.take(round_trip(piece)));
  return assembly.terms_for(patch);
}

/// Of a patch and its terms, datagrams and all.
std::size_t bytes_of(const Patch& patch, const CubicTerms& terms) {
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

TEST_CASE("a patch's terms arrive in half precision, whatever their size") {
  for (const int r : {1, 6, 13, kMaxModes})
    for (const bool grasp : {true, false})
      for (const bool repaired : {true, false}) {
        const int leading = std::min(kMaxLeading, r + (grasp ? 3 : 0));
        const CubicTerms sent = seeds::cubic_terms(r, grasp, leading, repaired);
        const Patch patch = grasp ? seeds::attach_patch(r) : seeds::touch_patch(r, 4, 3);
        TermsAssembly assembly;
        const auto pieces = to_pieces(sent, patch.seq);
        REQUIRE(!pieces.empty());
        for (const PatchTerms& piece : pieces) {
          CHECK_FALSE(assembly.terms_for(patch));
          CHECK(assembly.take(round_trip(piece)));
        }
        const auto got = assembly.terms_for(patch);
        REQUIRE(got);
        CHECK(got->variables == sent.variables);
        CHECK(got->leading == sent.leading);
        CHECK(got->grasp == grasp);
        CHECK(got->radius == sent.radius);
        check_half(got->scale, sent.scale);
        check_half(got->e2, sent.e2);
        check_half(got->e3, sent.e3);
        check_half(got->e4, sent.e4);
        const int turning = std::min(leading, kTurning);
        check_half(got->q.topLeftCorner(turning, pairs_of(turning)), sent.q.topLeftCorner(turning, pairs_of(turning)));
        CHECK(got->rate == stamp_rate(*got, patch));
      }
}

TEST_CASE("terms that are springs arrive in half precision, and those that no spring can be do not count") {
  for (const bool grasp : {true, false}) {
    const CubicTerms sent = seeds::spring_terms(12, grasp, 34);
    const Patch patch = grasp ? seeds::attach_patch(12) : seeds::touch_patch(12, 4, 3);
    const auto got = arrived(sent, patch);
    REQUIRE(got);
    CHECK(got->variables == sent.variables);
    CHECK(got->grasp == grasp);
    CHECK(got->scale == sent.scale);
    CHECK(got->springs.stiffening == sent.springs.stiffening);
    check_half(got->springs.motion, sent.springs.motion);
    CHECK((got->springs.span - sent.springs.span).cwiseAbs().maxCoeff() < 1e-5F);
    CHECK((got->springs.rest_length - sent.springs.rest_length).cwiseAbs().maxCoeff() < 1e-5F);
    check_half(got->springs.stiffness, sent.springs.stiffness);
    check_half(got->springs.damping, sent.springs.damping);
    check_half(got->e2, sent.e2);
    CHECK(got->rate == stamp_rate(*got, patch));
    CubicTerms bad = sent;
    bad.springs.stiffness[3] = -1;
    CHECK_FALSE(arrived(bad, patch));
    bad = sent;
    bad.springs.damping[7] = -1;
    CHECK_FALSE(arrived(bad, patch));
    bad = sent;
    bad.springs.rest_length[5] = 0;
    CHECK_FALSE(arrived(bad, patch));
  }
  CHECK(to_pieces(seeds::spring_terms(12, true, kMaxSprings + 1), 1).empty());
}

TEST_CASE("Springs and their patch of 13 modes take less than 6000 bytes, grasped with 34, touched with 32 or 30 and a repair") {
  CHECK(bytes_of(seeds::attach_patch(13), seeds::spring_terms(13, true, 34)) < 6000);
  for (const bool repaired : {false, true}) {
    Patch patch = seeds::touch_patch(13, 16, 15);
    CubicTerms terms = seeds::spring_terms(13, false, repaired ? 30 : 32);
    if (!repaired) terms.e2.resize(0);
    seeds::move_surface(4, 2, patch, terms);
    CHECK(bytes_of(patch, terms) < 6000);
  }
}

TEST_CASE("the surface that terms bring joins the patch's own, or the terms do not count") {
  const Patch whole = seeds::touch_patch(12, 16, 15);
  Patch patch = whole;
  CubicTerms sent = seeds::cubic_terms(12, false, 8, true);
  seeds::move_surface(5, 3, patch, sent);
  const auto got = arrived(sent, patch);
  REQUIRE(got);
  const Patch joined = extended(patch, *got);
  REQUIRE(joined.surface.vertex_count == 16);
  REQUIRE(joined.surface.triangle_count == 15);
  CHECK(joined.surface.triangles == whole.surface.triangles);
  for (std::size_t i = 5; i < 16; ++i) {
    const PortVertex &vertex = joined.surface.vertices[i], &expected = whole.surface.vertices[i];
    CHECK((vertex.position - expected.position).norm() < 1e-7);
    check_half(vertex.rows, expected.rows);
    check_half(vertex.normal, expected.normal);
  }
  CHECK(bytes_of(patch, sent) < 6000);

  CubicTerms bad = sent;
  bad.triangles[2][1] = 15;
  CHECK(arrived(bad, patch));
  bad.vertices.pop_back();  // there is no vertex 15 any more
  CHECK_FALSE(arrived(bad, patch));
  bad = sent;
  bad.triangles[2] = {4, 4, 6};  // no area
  CHECK_FALSE(arrived(bad, patch));
  bad = sent;
  bad.vertices[3].position.x() = 11;
  CHECK_FALSE(arrived(bad, patch));
  bad = sent;
  bad.vertices.push_back(bad.vertices.back());  // 17 together
  CHECK_FALSE(arrived(bad, patch));
  bad.vertices.resize(kMaxPortVertices + 1, bad.vertices.back());
  CHECK(to_pieces(bad, 1).empty());
  CubicTerms grasp = seeds::cubic_terms(6, true, 7, true);
  grasp.triangles.push_back({0, 1, 2});
  CHECK(to_pieces(grasp, 1).empty());
}

TEST_CASE("the terms of a grasp with 13 modes and 10 leading variables and its patch take less than 6000 bytes") {
  CHECK(bytes_of(seeds::attach_patch(13), seeds::cubic_terms(13, true, 10, true)) < 6000);
}

TEST_CASE("pieces that are not sane are not sent, and are dropped and counted when they come") {
  const PatchTerms good = to_pieces(seeds::cubic_terms(6, true, 7, true), 42).front();
  CHECK(check(good) == TermsFault::none);
  PatchTerms bad = good;
  bad.numbers[7] = 0x7c00;  // infinity
  CHECK(check(bad) == TermsFault::not_finite);
  CHECK(seeds::bytes_of(seeds::message(bad)).empty());
  bad = good;
  bad.radius = std::numeric_limits<float>::quiet_NaN();
  CHECK(check(bad) == TermsFault::not_finite);
  bad = good;
  bad.unit[2] = -1;
  CHECK(check(bad) == TermsFault::out_of_range);
  bad = good;
  bad.piece = bad.pieces;
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
  bad.leading = 0;
  CHECK(check(bad) == TermsFault::sizes);
  CubicTerms wild = seeds::cubic_terms(6, true, 7, true);
  wild.e3[3] = std::numeric_limits<float>::infinity();
  CHECK(to_pieces(wild, 1).empty());
}
