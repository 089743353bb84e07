#include <catch2/catch.hpp>

#include "client/viewer/shape_assembly.hpp"

using namespace palpate;

namespace {

constexpr std::uint32_t kVertices = 150;  // two whole blocks and a short one
constexpr double kUnit = 1e-3;

std::vector<MeshVertex> line() {
  std::vector<MeshVertex> vertices;
  for (std::uint32_t i = 0; i < kVertices; ++i) vertices.push_back({Vec3(i, 0, 0), false});
  return vertices;
}

/// A piece with these blocks in a frame, every vertex lifted by its number in mm.
ShapePiece piece(std::uint32_t frame, std::vector<std::uint32_t> blocks, ShapeChannel channel = ShapeChannel::position) {
  ShapePiece p{frame, Micros{1000 * frame}, channel, kUnit, {}};
  for (const std::uint32_t b : blocks) {
    std::vector<std::int32_t> numbers;
    for (std::uint32_t i = b * 64; i < std::min(kVertices, b * 64 + 64); ++i) {
      if (channel == ShapeChannel::position) numbers.insert(numbers.end(), {0, 0});
      numbers.push_back(static_cast<std::int32_t>(frame));
    }
    append_block(b, numbers, components_of(channel), p.blocks);
  }
  return p;
}

Tools end_of(std::uint32_t frame, std::uint16_t pieces) { return {frame, Micros{1000 * frame}, pieces, {}}; }

struct Fixture {
  ShapeAssembly shapes;
  std::vector<Shape> out;
  Fixture() { shapes.rest(line()); }
  float lift(std::size_t shape, std::size_t vertex) const { return 1000 * out[shape].positions[vertex].z(); }
};

}  // namespace

TEST_CASE("A frame is finished by the last of its pieces and the tools, in whatever order they come", "[view]") {
  Fixture f;
  f.shapes.take(piece(5, {2}), f.out);
  f.shapes.take(end_of(5, 2), f.out);
  REQUIRE(f.out.empty());
  f.shapes.take(piece(5, {0}), f.out);
  REQUIRE(f.out.size() == 1);
  CHECK(f.out[0].body_time == Micros{5000});
  CHECK(f.out[0].positions[149].x() == 149);
  CHECK(f.lift(0, 149) == Approx(5));
  CHECK(f.lift(0, 0) == Approx(5));
  CHECK(f.lift(0, 64) == 0);  // did not move
  CHECK(f.shapes.counts().complete == 1);
  f.shapes.take(end_of(6, 0), f.out);
  CHECK(f.shapes.counts().complete == 2);
  CHECK(f.lift(1, 0) == Approx(5));
}

TEST_CASE("A frame of which something is lost is shown with what came when a newer one begins", "[view]") {
  Fixture f;
  f.shapes.take(piece(1, {0, 1, 2}), f.out);
  f.shapes.take(end_of(1, 1), f.out);
  f.shapes.take(piece(2, {0}), f.out);  // its second piece and its tools are lost
  f.shapes.take(piece(3, {0}), f.out);
  REQUIRE(f.out.size() == 2);
  CHECK(f.lift(1, 0) == Approx(2));
  CHECK(f.lift(1, 64) == Approx(1));
  CHECK(f.shapes.counts().healed == 1);
}

TEST_CASE("A late piece brings what nothing newer was heard of and never puts a block back", "[view]") {
  Fixture f;
  f.shapes.take(piece(2, {0}), f.out);
  f.shapes.take(end_of(2, 1), f.out);
  f.shapes.take(piece(1, {0, 1}), f.out);
  CHECK(f.shapes.counts().late_pieces == 1);
  f.shapes.take(end_of(3, 0), f.out);
  CHECK(f.lift(1, 0) == Approx(2));
  CHECK(f.lift(1, 64) == Approx(1));
}

TEST_CASE("Frame numbers may wrap around", "[view]") {
  Fixture f;
  ShapePiece last = piece(1, {0});
  last.frame = ~0u;
  f.shapes.take(last, f.out);
  ShapePiece next = piece(2, {0});
  next.frame = 1;
  f.shapes.take(next, f.out);
  REQUIRE(f.out.size() == 1);
  f.shapes.take({1, Micros{2000}, 1, {}}, f.out);
  CHECK(f.lift(1, 0) == Approx(2));
}

TEST_CASE("Blocks that do not fit are refused, and the rest of their piece counts", "[view]") {
  Fixture f;
  ShapePiece wrong = piece(1, {0});
  const std::vector<std::int32_t> numbers(3 * 64, 7);
  append_block(2, numbers, 3, wrong.blocks);  // 64 vertices instead of 22
  append_block(3, numbers, 3, wrong.blocks);  // beyond the last one
  f.shapes.take(wrong, f.out);
  f.shapes.take(end_of(1, 1), f.out);
  CHECK(f.shapes.counts().misfits == 2);
  CHECK(f.lift(0, 0) == Approx(1));
  CHECK(f.lift(0, 149) == 0);
}

TEST_CASE("A channel is in the shapes while it is shown", "[view]") {
  Fixture f;
  f.shapes.take(piece(1, {1}, ShapeChannel::tension), f.out);
  f.shapes.take(end_of(1, 1), f.out);
  CHECK(f.out[0].scalars.empty());
  CHECK(f.out[0].channel == ShapeChannel::position);
  f.shapes.show(ShapeChannel::tension);
  f.shapes.take(end_of(2, 0), f.out);
  REQUIRE(f.out[1].scalars.size() == kVertices);
  CHECK(f.out[1].scalars[64] == Approx(kUnit));
  CHECK(f.out[1].scalars[0] == 0);
  CHECK(f.out[1].channel == ShapeChannel::tension);
}
