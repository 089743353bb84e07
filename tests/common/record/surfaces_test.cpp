// The surface of a body that a blade cuts, in a recording: found again at any moment, and never a wrong one after damage.
#include "common/record/surfaces.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <numeric>

#include "common/base/random.hpp"
#include "common/record/layout.hpp"
#include "tests/common/record/small_recording.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr int kShapes = 120, kEvery = 4;  // 30 s; a cut after so many shapes
constexpr Micros kStep{250'000};

/// Surface of a body after `cuts`: each adds a vertex and two triangles, and removes one.
BodyMesh cut_mesh(const RecordedSurface& surface, int cuts) {
  BodyMesh mesh = mesh_of(surface);
  Random random(3);
  for (int k = 0; k < cuts; ++k) {
    const auto vertex = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.push_back({Vec3(0.01 * k, 0.001 * k, 0.5), k % 3 == 0, k % 3 == 1});
    const auto gone = static_cast<std::ptrdiff_t>(random.uniform() * static_cast<double>(mesh.triangles.size()));
    const Triangle was = mesh.triangles[static_cast<std::size_t>(gone)];
    mesh.triangles.erase(mesh.triangles.begin() + gone);
    // The new ones come first, so that the order of triangles says nothing.
    mesh.triangles.insert(mesh.triangles.begin(), {Triangle{was[0], was[1], vertex}, Triangle{was[1], was[2], vertex}});
  }
  return mesh;
}

std::vector<Vec3> positions(int k, std::size_t vertices) {
  std::vector<Vec3> x = small_shape(0);
  for (std::size_t v = x.size(); v <= vertices; ++v) x.emplace_back(0.01, 0.002 * static_cast<double>(v), 0.1);
  x[0].x() = 0.001 * k;
  return x;
}

std::vector<std::byte> cut_recording() {
  RecordingWriter writer(small_head());
  const RecordedSurface surface = small_head().surface;
  for (int k = 0; k < kShapes; ++k) {
    const Micros t = kSmallBegin + k * kStep;
    const BodyMesh mesh = cut_mesh(surface, k / kEvery);
    if (k > 0 && k % kEvery == 0) {
      // Vertex 1 of the body is an inner one; those that cuts add come after the body's five.
      std::vector<std::uint32_t> vertex_of = surface.nodes;
      while (vertex_of.size() < mesh.vertices.size()) vertex_of.push_back(static_cast<std::uint32_t>(vertex_of.size() + 1));
      writer.add_mesh(t, mesh, vertex_of);
    }
    writer.add_shape(t, positions(k, mesh.vertices.size()));
    writer.tick(t);
  }
  writer.finish();
  return writer.take();
}

bool same(const BodyMesh& a, const BodyMesh& b) {
  const auto alike = [](const MeshVertex& p, const MeshVertex& q) {
    return (p.rest - q.rest).norm() < 1e-7 && p.fixed == q.fixed && p.wall == q.wall;
  };
  return std::ranges::equal(a.vertices, b.vertices, alike) && in_order(a).triangles == in_order(b).triangles;
}

}  // namespace

TEST_CASE("the surface of a body that is cut is that of each moment, in whichever order moments are asked for", "[record]") {
  const auto bytes = cut_recording();
  RecordingReader recording(bytes, "cut");
  REQUIRE(recording.complete());
  std::vector<int> order(kShapes);
  std::iota(order.begin(), order.end(), 0);
  for (const int k : {90, 3, 119, 50, 51, 0, 41, 40, 39}) order.push_back(k);
  for (const int k : order) {
    INFO(k);
    const auto shape = recording.shape_at(kSmallBegin + k * kStep);
    REQUIRE(shape);
    const BodyMesh* mesh = recording.mesh_of(*shape);
    REQUIRE(mesh);
    const BodyMesh expected = cut_mesh(recording.head().surface, k / kEvery);
    CHECK(same(*mesh, expected));
    CHECK(shape->positions.size() == expected.vertices.size());
    CHECK(std::abs(shape->positions[0].x() - 0.001 * k) < 1e-5);
  }
}

TEST_CASE("a damaged block takes surfaces that it had a part in, until the next whole one, and no shape gets a wrong one",
          "[record]") {
  const auto whole = cut_recording();
  const RecordingReader undamaged(whole, "cut");
  std::size_t lost_most = 0, hurt = 0;
  for (std::size_t block = 0; block < undamaged.blocks().size(); block += 3) {
    auto bytes = whole;
    bytes[undamaged.blocks()[block].offset + layout::kFrameBytes + 40] ^= std::byte{0x10};
    RecordingReader recording(bytes, "hurt");
    std::size_t lost = 0;
    for (std::size_t k = 0; k < recording.blocks().size(); ++k) {
      const auto read = recording.read(k);
      if (!read) continue;
      for (const RecordedShape& shape : read->shapes) {
        const auto number = static_cast<int>((shape.t - kSmallBegin) / kStep);
        const BodyMesh* mesh = recording.mesh_of(shape);
        lost += mesh == nullptr;
        if (mesh) REQUIRE(same(*mesh, cut_mesh(recording.head().surface, number / kEvery)));
      }
    }
    hurt += lost > 0;
    lost_most = std::max(lost_most, lost);
  }
  CHECK(hurt > 5);
  CHECK(lost_most <= static_cast<std::size_t>((RecordingWriter::kMeshEvery + RecordingWriter::kBlock) / kStep) + 2);
}

TEST_CASE("a change of the surface that does not fit is no surface", "[record]") {
  const RecordedSurface surface = small_head().surface;
  RecordedSurfaces surfaces(surface);
  const auto vertices = surface.rest.size();
  const auto shape = [&](std::uint32_t mesh, std::size_t count) { return RecordedShape{{}, std::vector<Vec3>(count), mesh}; };
  surfaces.take({{}, 1, false, {0, 0, 0, 0, {MeshVertex{}}, {{0, 1, 4}}, {}}});
  surfaces.take({{}, 2, false, {0, 0, 0, 0, {}, {{0, 1, 9}}, {}}});
  surfaces.take({{}, 3, false, {0, 0, 0, 0, {}, {}, {77}}});
  surfaces.take({{}, 4, true, {0, 0, 0, 0, {}, {}, {0}}});
  CHECK(surfaces.mesh_of(shape(0, vertices)));
  CHECK_FALSE(surfaces.mesh_of(shape(0, vertices + 1)));
  CHECK(surfaces.mesh_of(shape(1, vertices + 1)));
  CHECK_FALSE(surfaces.mesh_of(shape(1, vertices)));
  CHECK_FALSE(surfaces.mesh_of(shape(2, vertices + 1)));
  CHECK_FALSE(surfaces.mesh_of(shape(3, vertices + 1)));
  CHECK_FALSE(surfaces.mesh_of(shape(5, vertices)));
  const BodyMesh* mesh = surfaces.mesh_of(shape(4, vertices));
  REQUIRE(mesh);
  CHECK(mesh->triangles.size() == surface.triangles.size() - 1);
}

TEST_CASE("cuts, threads and needles of a checkpoint are those that were written, to the bit", "[record]") {
  RecordedCheckpoint written{kSmallBegin, small_shape(0), std::vector<Vec3>(5, Vec3::Zero()), {}};
  const Vec3 third(1.0 / 3, 0.1, -0.7), edge = Vec3(0.6, 0, 0.8);
  written.cuts = {{0, false, {third, 2 * third}, edge, 0.01},
                  {1, true, {Vec3::UnitX(), third}, edge, 0.02},
                  {0, true, {third, 2 * third, 3 * third}, edge, 0.01},
                  {0, true, {third, 2.5 * third}, Vec3::UnitZ(), 0.015}};
  RecordedHold hold{"hand", Vec3(0.5, 0.25, 0.125), Rotation(0.5, 0.5, -0.5, 0.5), 1};
  NeedleInBody& needle = hold.needle.emplace();
  for (int j = 0; j < kNeedlePoints; ++j) needle.rest[static_cast<std::size_t>(j)] = j * third;
  needle.edge = 0.04 * edge;
  needle.tip = {true, 0.01 / 3, 0.02 / 3, 1};
  needle.layers.count = 2;
  needle.layers.length_m = 0.1;
  needle.layers.of[1] = {0.02, 0.5, 1.0 / 7, 3};
  written.holds = {hold, {"other", Vec3::Zero()}};
  written.threads = {{1, true, false, true, {0.1 / 3, 0.02}, {{2, 7, third}}}, {0, false, true, false, {0.05}, {}}};
  const auto read_back = [](const RecordedCheckpoint& checkpoint) {
    RecordingWriter writer(small_head());
    writer.add(checkpoint);
    writer.finish();
    const auto bytes = writer.take();
    return RecordingReader(bytes, "held").read(0);
  };
  const auto block = read_back(written);
  REQUIRE(block);
  const RecordedCheckpoint& read = block->checkpoints.at(0);
  REQUIRE(read.cuts.size() == written.cuts.size());
  for (std::size_t k = 0; k < read.cuts.size(); ++k) {
    CHECK(read.cuts[k].number == written.cuts[k].number);
    CHECK(read.cuts[k].parts == written.cuts[k].parts);
    CHECK(read.cuts[k].path == written.cuts[k].path);
    CHECK(read.cuts[k].direction == written.cuts[k].direction);
    CHECK(read.cuts[k].depth_m == written.cuts[k].depth_m);
  }
  REQUIRE(read.threads.size() == 2);
  for (std::size_t k = 0; k < 2; ++k) {
    CHECK(read.threads[k].suture == written.threads[k].suture);
    CHECK(read.threads[k].first_tied == written.threads[k].first_tied);
    CHECK(read.threads[k].last_tied == written.threads[k].last_tied);
    CHECK(read.threads[k].has_end == written.threads[k].has_end);
    CHECK(read.threads[k].length_m == written.threads[k].length_m);
    CHECK(read.threads[k].bites.size() == written.threads[k].bites.size());
  }
  CHECK(read.threads[0].bites[0].number == 2);
  CHECK(read.threads[0].bites[0].cell == 7);
  CHECK(read.threads[0].bites[0].at == third);
  REQUIRE(read.holds.size() == 2);
  REQUIRE(read.holds[0].needle);
  CHECK_FALSE(read.holds[1].needle);
  CHECK(read.holds[0].orientation.angularDistance(hold.orientation) < 1e-3);
  CHECK(read.holds[0].opening == 1);
  CHECK(read.holds[0].needle->rest == needle.rest);
  CHECK(read.holds[0].needle->edge == needle.edge);
  CHECK(read.holds[0].needle->tip.front_m == needle.tip.front_m);
  CHECK(read.holds[0].needle->tip.depth_m == needle.tip.depth_m);
  CHECK(read.holds[0].needle->layers.of[1].cutting_n == needle.layers.of[1].cutting_n);

  RecordedCheckpoint wrong = written;
  wrong.holds[0].needle->tip.front_m = 0.2;  // longer than the needle
  CHECK_FALSE(read_back(wrong));
  wrong = written;
  wrong.cuts[1].path[0].x() = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(read_back(wrong));
  wrong = written;
  wrong.threads[0].length_m.push_back(0.1);
  CHECK_FALSE(read_back(wrong));
  wrong = written;
  wrong.threads[0].bites[0].at.x() = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(read_back(wrong));
}
