#include <catch2/catch.hpp>

#include "client/view/shape_assembly.hpp"

using namespace palpate;

namespace {

constexpr std::uint32_t kVertices = 10;

/// Vertices [first, last) at the time t, each at (t in ms, index, 0).
ShapePiece piece(std::int64_t t_ms, std::uint32_t first, std::uint32_t last, std::int64_t skew_us = 0) {
  ShapePiece p;
  p.body_time = Micros{1000 * t_ms + skew_us};
  p.first = first;
  for (std::uint32_t i = first; i < last; ++i) p.positions.emplace_back(static_cast<double>(t_ms), i, 0);
  return p;
}

}  // namespace

TEST_CASE("A shape is finished by its last piece, in whatever order pieces come", "[view]") {
  ShapeAssembly shapes;
  shapes.expect(kVertices);
  std::vector<Shape> out;
  shapes.take(piece(50, 6, 10), out);
  shapes.take(piece(50, 0, 3, 40), out);
  shapes.take(piece(50, 0, 3), out);
  REQUIRE(out.empty());
  shapes.take(piece(50, 3, 6, -40), out);
  REQUIRE(out.size() == 1);
  for (std::uint32_t i = 0; i < kVertices; ++i) REQUIRE(out[0].positions[i] == Eigen::Vector3f(50, static_cast<float>(i), 0));
  REQUIRE(shapes.counts().complete == 1);
}

TEST_CASE("What is lost of a shape is healed with the newest earlier positions", "[view]") {
  ShapeAssembly shapes;
  shapes.expect(kVertices);
  std::vector<Shape> out;
  shapes.take(piece(50, 0, 10), out);
  shapes.take(piece(100, 0, 5), out);  // its second half is lost
  shapes.take(piece(150, 0, 5), out);
  REQUIRE(out.size() == 2);
  REQUIRE(out[1].body_time == Micros{100'000});
  REQUIRE(out[1].positions[4].x() == 100);
  REQUIRE(out[1].positions[5].x() == 50);
  shapes.take(piece(100, 5, 10), out);  // too late
  REQUIRE(shapes.counts().late_pieces == 1);
  shapes.take(piece(150, 5, 10), out);
  REQUIRE(out.size() == 3);
  REQUIRE(out[2].positions[7].x() == 150);
  REQUIRE(shapes.counts().healed == 1);
}

TEST_CASE("No shape is shown before every vertex was heard of, and pieces that do not fit are refused", "[view]") {
  ShapeAssembly shapes;
  shapes.expect(kVertices);
  std::vector<Shape> out;
  shapes.take(piece(50, 0, 5), out);
  shapes.take(piece(100, 0, 5), out);
  REQUIRE(out.empty());
  REQUIRE(shapes.counts().dropped == 1);
  shapes.take(piece(100, 5, 11), out);
  shapes.take(piece(100, 11, 12), out);
  shapes.take(piece(100, 5, 5), out);
  REQUIRE(shapes.counts().misfits == 3);
  shapes.take(piece(100, 5, 10), out);
  REQUIRE(out.size() == 1);
}
