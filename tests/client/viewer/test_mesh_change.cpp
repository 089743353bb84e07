// The mesh of a body that blades cut: a log of pieces at the server, put together by a viewer over a link that loses some.
#include <catch2/catch.hpp>
#include <memory>
#include <optional>
#include <set>

#include "client/viewer/mesh_assembly.hpp"
#include "client/viewer/recorded_scene.hpp"
#include "client/viewer/shape_assembly.hpp"
#include "client/viewer/view_core.hpp"
#include "client/viewer/view_recorder.hpp"
#include "common/base/limits.hpp"
#include "common/base/random.hpp"
#include "common/wire/codec.hpp"
#include "server/core/mesh_log.hpp"
#include "server/core/mesh_pieces.hpp"
#include "server/core/server_core.hpp"
#include "server/core/shape_stream.hpp"
#include "server/record/room_recorder.hpp"

using namespace palpate;

namespace {

Scene cut_block() {
  return read_scene(R"({"body": {"lattice": {"nodes": [7, 7, 6], "size_m": [0.06, 0.06, 0.05], "fixed_faces": ["z-"],
      "solid": {"element": "hexahedron", "young_pa": 8000, "poisson": 0.45}}}, "tool": {"contact": "touch"}})",
                    "block");
}

/// Four cuts that grow, then the body as it was.
struct CutRoom {
  Scene scene = cut_block();
  RoomInfo facts = facts_of(scene, Vec3::Zero());
  CutBody cut{scene.body};
  LiveSurface surface{scene.body};
  MeshLog log{facts};
  std::uint32_t links = 0;

  bool grow(int step) {
    const double x_m = 0.0113 + 0.01 * (step % 4), down_m = 0.008 * (1 + step / 4);
    links += static_cast<std::uint32_t>(
        cut.set(static_cast<std::size_t>(step % 4),
                {{Vec3(x_m, 0.005, 0.06), Vec3(x_m + 0.001, 0.005, 0.05 - down_m)}, Vec3::UnitY(), 0.047}));
    const CutChange change = cut.part();
    surface.renew(cut.body(), &change);
    return log.take(surface.now());
  }
  MeshPiece piece(std::uint32_t k) const { return k < log.scene_pieces() ? mesh_piece(facts, k) : log.change(k); }
  MeshAssembly viewer() const {
    MeshAssembly mesh;
    mesh.expect(static_cast<std::uint32_t>(facts.mesh.vertices.size()), static_cast<std::uint32_t>(facts.mesh.triangles.size()),
                facts.mesh_hash);
    return mesh;
  }
};

std::set<std::set<std::array<double, 3>>> drawn(const BodyMesh& mesh) {
  std::set<std::set<std::array<double, 3>>> all;
  for (const Triangle& t : mesh.triangles) {
    std::set<std::array<double, 3>> corners;
    for (const std::uint32_t v : t) {
      const Vec3 rest = mesh.vertices[v].rest.unaryExpr(&to_rest_step);  // a recording has more digits
      corners.insert({rest.x(), rest.y(), rest.z()});
    }
    all.insert(corners);
  }
  return all;
}

std::size_t bytes_of(const MeshPiece& piece) {
  std::array<std::byte, kMaxDatagramBytes> out;
  Message message;
  message.body = piece;
  return encode(message, out);
}

}  // namespace

TEST_CASE("A viewer has the mesh of a body that is cut, whatever the link loses, and one that joins late has the same",
          "[view]") {
  CutRoom room;
  MeshAssembly mesh = room.viewer();
  Random random(5);
  std::size_t bytes = 0, changes = 0;
  const auto ask = [&](MeshAssembly& of, double loss) {
    of.want(room.log.pieces());
    for (int tries = 0; tries < 200 && !of.current(); ++tries)
      for (const std::uint32_t k : of.missing(16))
        if (random.uniform() >= loss) {
          of.take(room.piece(k));
          of.take(room.piece(k));
        }
    return of.current();
  };
  REQUIRE(ask(mesh, 0.3));
  for (int step = 0; step < 16; ++step) {
    const std::uint32_t before = room.log.pieces();
    changes += room.grow(step);
    for (std::uint32_t k = before; k < room.log.pieces(); ++k) bytes += bytes_of(room.piece(k));
    REQUIRE(ask(mesh, 0.3));
    CHECK(mesh.mesh().triangles == room.log.mesh().triangles);
    CHECK(mesh.mesh().vertices.size() == room.log.mesh().vertices.size());
    // What is drawn is the surface of the cut body, by rest positions.
    BodyMesh whole;
    for (const Vec3& x : vertices_at_rest(room.cut.body())) whole.vertices.push_back({x.unaryExpr(&to_rest_step)});
    whole.triangles = room.cut.body().triangles;
    CHECK(drawn(mesh.mesh()) == drawn(whole));
  }
  CHECK(changes >= 4);
  CHECK(room.links >= 80);
  // Changed triangles alone: less than the scene's mesh again for all changes together, a piece of it for each.
  std::size_t scene_bytes = 0;
  for (std::uint32_t k = 0; k < room.log.scene_pieces(); ++k) scene_bytes += bytes_of(room.piece(k));
  CHECK(bytes / changes < scene_bytes / 2);
  CHECK(bytes < 300 * room.links);

  MeshAssembly late = room.viewer();
  REQUIRE(ask(late, 0));
  CHECK(late.mesh().triangles == mesh.mesh().triangles);

  // A reset: the triangles are those of the scene again.
  room.surface.renew(room.scene.body, nullptr);
  room.log.take(room.surface.now());
  REQUIRE(ask(mesh, 0.3));
  CHECK(drawn(mesh.mesh()) == drawn(room.facts.mesh));
}

TEST_CASE("A change of a mesh that does not fit is refused, and all is asked for anew", "[view]") {
  CutRoom room;
  for (int step = 0; step < 4; ++step) room.grow(step);
  MeshAssembly mesh = room.viewer();
  mesh.want(room.log.pieces());
  for (std::uint32_t k = 0; k < room.log.pieces(); ++k) {
    MeshPiece piece = room.piece(k);
    if (!piece.removed.empty()) piece.removed.back() = 100'000;
    mesh.take(piece);
  }
  CHECK(mesh.rejected() == 1);
  CHECK_FALSE(mesh.current());
  CHECK(mesh.missing(16) == std::vector<std::uint32_t>{0});
}

TEST_CASE("Positions of vertices that a cut adds arrive, and blocks of vertices that are not known yet count as lost", "[view]") {
  CutRoom room;
  ShapeStream stream(room.facts, 20);
  ShapeAssembly shapes;
  shapes.rest(room.facts.mesh.vertices);
  ShapeViewer viewer;
  for (int step = 0; step < 8; ++step) room.grow(step);
  stream.extend(room.log.mesh().vertices, room.log.vertex_of());
  std::vector<Vec3> x;
  for (const BodySurface::Vertex& vertex : room.surface.now()->vertices)
    x.push_back(vertex.rest + Vec3(0.1 * vertex.rest.z(), 0, 0.002));
  stream.take({Micros{1}, x, {}, {}});
  viewer.tokens_bytes = 1e6;
  std::vector<Shape> finished;
  ShapePiece piece;
  const auto send = [&] {
    std::uint32_t misfits = 0;
    stream.begin(viewer, Micros{1});
    while (stream.next(viewer, piece)) {
      if (!shapes.fits(piece)) {
        ++misfits;
        continue;
      }
      stream.sent(viewer, piece.frame, Micros{1});
      shapes.take(piece, finished);
    }
    shapes.take(Tools{piece.frame, Micros{1}, 1, {}}, finished);
    return misfits;
  };
  CHECK(send() > 0);
  const auto before = static_cast<std::ptrdiff_t>(room.facts.mesh.vertices.size());
  const std::vector<MeshVertex>& all = room.log.mesh().vertices;
  REQUIRE(all.size() > room.facts.mesh.vertices.size());
  shapes.extend({all.begin() + before, all.end()}, std::vector<std::uint32_t>(all.size() - static_cast<std::size_t>(before), 0));
  stream.take({Micros{2}, x, {}, {}});
  CHECK(send() == 0);
  shapes.take(Tools{piece.frame + 1, Micros{3}, 0, {}}, finished);
  REQUIRE_FALSE(finished.empty());
  const Shape& shape = finished.back();
  REQUIRE(shape.positions.size() == all.size());
  for (std::size_t v = 0; v < all.size(); ++v)
    CHECK((shape.positions[v].cast<double>() - x[room.log.vertex_of()[v]]).norm() < 1e-4);
}

namespace {

/// The real server core and viewers, on a link of 20 ms each way that loses some datagrams.
struct CutWorld {
  CutRoom room;
  ServerCore server{room.facts, {.draw = repeatable(7), .rate_hz = 20}};
  std::vector<std::unique_ptr<ViewCore>> viewers;
  struct InFlight {
    Micros at;
    std::size_t viewer;
    std::vector<std::byte> bytes;
  };
  std::vector<InFlight> up, down;
  Random random{3};
  double loss = 0;
  Micros now{0};
  std::optional<RoomRecorder> recorder;
  Micros stamp{};  // of the last frame

  static Vec3 place(const Vec3& rest, Micros t) { return rest + Vec3(0.1 * rest.z(), 0, 0.01 * std::sin(3 * seconds(t))); }
  void run(Micros span) {
    std::array<std::byte, kMaxDatagramBytes> out;
    const auto send = [&](std::vector<InFlight>& line, std::size_t viewer, std::size_t size) {
      if (random.uniform() >= loss)
        line.push_back({now + Micros{20'000}, viewer, {out.begin(), out.begin() + static_cast<std::ptrdiff_t>(size)}});
    };
    const auto deliver = [&](std::vector<InFlight>& line, const auto& take) {
      for (const InFlight& d : line)
        if (d.at <= now) take(d);
      std::erase_if(line, [this](const InFlight& d) { return d.at <= now; });
    };
    for (const Micros end = now + span; now < end; now += Micros{5'000}) {
      deliver(down, [this](const InFlight& d) { viewers[d.viewer]->take(d.bytes, now); });
      for (std::size_t k = 0; k < viewers.size(); ++k) {
        viewers[k]->tick(now);
        while (const auto size = viewers[k]->emit(out, now)) send(up, k, size);
      }
      deliver(up, [this](const InFlight& d) { server.take(d.bytes, static_cast<PeerId>(d.viewer + 1), now); });
      server.tick(now);
      if (auto job = server.next_job(now)) {
        if (recorder) recorder->begin_frame(*job, now);
        FrameResult result;
        result.stamp = stamp = job->target;
        result.surface = room.surface.now();
        if (job->shapes) {
          std::vector<Vec3> of_vertices;
          for (const Vec3& x : vertices_at_rest(room.cut.body())) of_vertices.push_back(place(x, job->target));
          result.positions = room.surface.by_number(of_vertices, [](const Vec3& rest) { return rest; });
        }
        if (recorder) recorder->end_frame(result, server, now);
        server.finish(std::move(result), now);
      }
      PeerId to = 0;
      while (const auto size = server.emit(out, to, now))
        if (to >= 1) send(down, static_cast<std::size_t>(to - 1), size);
    }
  }
};

}  // namespace

TEST_CASE("Viewers show a body while it is cut, over a link with losses, and one that joins late shows the same", "[view]") {
  CutWorld world;
  world.loss = 0.2;
  world.viewers.push_back(std::make_unique<ViewCore>("first", world.now));
  world.run(Micros{2'000'000});
  REQUIRE(world.viewers[0]->ready());
  ViewMoment moment;
  for (int step = 0; step < 16; ++step) {
    world.room.grow(step);
    world.run(Micros{300'000});
    REQUIRE(world.viewers[0]->show(world.now, moment));
    CHECK(moment.shape.positions.size() == world.viewers[0]->rest().size());
  }
  world.viewers.push_back(std::make_unique<ViewCore>("late", world.now));
  world.run(Micros{3'000'000});
  BodyMesh whole;
  for (const Vec3& x : vertices_at_rest(world.room.cut.body())) whole.vertices.push_back({x.unaryExpr(&to_rest_step)});
  whole.triangles = world.room.cut.body().triangles;
  for (const auto& viewer : world.viewers) {
    REQUIRE(viewer->ready());
    CHECK(drawn(viewer->mesh()) == drawn(whole));
    CHECK(viewer->mesh_version() > 1);
    REQUIRE(viewer->show(world.now, moment));
    double error_m = 0;
    for (const Triangle& t : viewer->mesh().triangles)
      for (const std::uint32_t v : t)
        error_m = std::max(error_m, (moment.shape.positions[v].cast<double>() -
                                     CutWorld::place(viewer->mesh().vertices[v].rest, moment.shape.body_time))
                                        .norm());
    CHECK(error_m < 5e-4);
  }
}

TEST_CASE("Recordings of a viewer and of the server show a body as it was cut, at any moment", "[view][replay]") {
  CutWorld world;
  world.loss = 0.1;
  world.viewers.push_back(std::make_unique<ViewCore>("first", world.now));
  RecordingHead head;
  head.rate_hz = head.shapes_hz = 20;
  head.surface = recorded_surface(world.room.scene);
  world.recorder.emplace(head);
  world.run(Micros{2'000'000});
  REQUIRE(world.viewers[0]->ready());
  ViewRecorder viewed(*world.viewers[0], "test", Micros{0});
  struct Seen {
    Micros t;
    std::size_t vertices;
    std::set<std::set<std::array<double, 3>>> drawn;
  };
  std::vector<Seen> at_server, at_viewer;
  for (int step = 0; step <= 16; ++step) {
    if (step < 16) {
      world.room.grow(step);
    } else {  // a reset
      world.room.cut = CutBody(world.room.scene.body);
      world.room.surface.renew(world.room.scene.body, nullptr);
      world.room.log.take(world.room.surface.now());
    }
    for (int k = 0; k < 8; ++k) {
      world.run(Micros{50'000});
      REQUIRE_FALSE(viewed.outlived(*world.viewers[0]));
      viewed.take(*world.viewers[0], world.now);
    }
    at_server.push_back({world.stamp, world.room.log.mesh().vertices.size(), drawn(world.room.log.mesh())});
    // What a viewer shows lags by the link, its losses and their healing.
    const ViewCore& viewer = *world.viewers[0];
    at_viewer.push_back({viewer.playback().shapes().back().body_time, viewer.rest().size(), drawn(viewer.mesh())});
  }
  viewed.finish();
  world.recorder->finish();
  for (const auto& [bytes, seen] : {std::pair{viewed.bytes(), at_viewer}, {world.recorder->take(), at_server}}) {
    const RecordingReader recording(bytes, "cut.rec");
    REQUIRE(recording.complete());
    RecordedScene scene(recording, "cut.rec");
    std::vector<std::size_t> order;
    for (std::size_t k = 0; k < seen.size(); ++k) order.push_back(k);
    for (const std::size_t k : {std::size_t{3}, std::size_t{14}, std::size_t{0}, std::size_t{7}}) order.push_back(k);
    for (const std::size_t k : order) {
      INFO(k);
      const ViewMoment moment = scene.at(std::min(seen[k].t, scene.end()));
      CHECK((drawn(scene.mesh()) == seen[k].drawn));
      CHECK(scene.rest().size() == seen[k].vertices);
      REQUIRE(moment.shape.positions.size() == seen[k].vertices);
      double error_m = 0;
      for (const Triangle& t : scene.mesh().triangles)
        for (const std::uint32_t v : t)
          error_m = std::max(error_m, (moment.shape.positions[v].cast<double>() -
                                       CutWorld::place(scene.mesh().vertices[v].rest, moment.shape.body_time))
                                          .norm());
      CHECK(error_m < 3e-3);  // it moves by 30 mm/s, between shapes that are 50 ms apart
    }
  }
  CHECK(at_viewer.back().vertices > at_viewer.front().vertices);
  CHECK((at_server.back().drawn == drawn(world.room.facts.mesh)));
}
