#include <set>

#include "raw_station.hpp"

using namespace palpate;
using namespace std::chrono_literals;

TEST_CASE("a shadow gets patches for the tool of another station and pushes nothing") {
  Bench bench(ContactKind::attach);
  RawStation hand(bench, 1, "hand"), shadow(bench, 2, "shadow");
  hand.join();
  shadow.hello.shadow_of = "hand";
  shadow.hello.scheme = Scheme::hold;
  shadow.join();
  shadow.say_samples({shadow.sample()});
  hand.live(200ms);
  const auto& job = bench.room.jobs.back();
  REQUIRE(job.stations.size() == 2);
  CHECK(job.stations[0].shadow_of == 0);
  CHECK(job.stations[1].shadow_of == job.stations[0].id);
  CHECK(job.stations[1].scheme == Scheme::hold);
  CHECK(job.stations[1].samples.empty());
  CHECK(bench.last<PatchMessage>(2));
}

TEST_CASE("a shadow gets the stamps of the hand to the microsecond, whatever the server makes of its own link's clock") {
  Bench bench;
  RawStation hand(bench, 1, "hand"), near(bench, 2, "near"), far(bench, 3, "far");
  hand.clock_offset = near.clock_offset = 77s;
  far.clock_offset = 77s + 76ms;  // as after a step of the clock that its long way hides
  hand.join();
  near.hello.shadow_of = far.hello.shadow_of = "hand";
  bench.now += 3ms;
  near.join();
  far.join();
  bench.sent.clear();
  hand.live(500ms);
  std::map<PeerId, Micros> stamp;
  for (const auto& [to, message] : bench.sent)
    if (const auto* patch = std::get_if<PatchMessage>(&message.body)) stamp[to] = patch->patch.stamp;
  REQUIRE(stamp.size() == 3);
  CHECK(stamp[2] == stamp[1]);
  CHECK(stamp[3] == stamp[1]);
}

TEST_CASE("when the hand leaves its shadow stays, alive, without patches") {
  Bench bench;
  RawStation hand(bench, 1, "hand"), shadow(bench, 2, "shadow");
  hand.join();
  shadow.hello.shadow_of = "hand";
  shadow.join();
  hand.live(200ms);
  hand.say(Leave{});
  bench.sent.clear();
  bench.wait(200ms);
  CHECK(bench.room.jobs.back().stations.empty());
  CHECK_FALSE(bench.sent.empty());
  for (const auto& [to, message] : bench.sent) CHECK(std::holds_alternative<Beat>(message.body));
  RawStation again(bench, 5, "hand");
  again.join().live(200ms);
  CHECK(bench.room.jobs.back().stations.size() == 2);
}

TEST_CASE("a viewer can fetch the whole mesh and sees every vertex and tool of a frame") {
  Bench bench;
  RawStation eye(bench, 1, "eye"), hand(bench, 2, "hand");
  eye.hello.role = Role::viewer;
  eye.join();
  hand.join().live(200ms);
  CHECK(bench.room.jobs.back().shapes);
  CHECK(bench.room.jobs.back().stations.size() == 1);

  std::set<std::uint32_t> vertices;
  for (const auto& [to, message] : bench.sent)
    if (const auto* shape = std::get_if<ShapePiece>(&message.body)) {
      CHECK(to == 1);
      for (std::uint32_t i = 0; i < shape->positions.size(); ++i) vertices.insert(shape->first + i);
      CHECK((shape->positions[0] - Vec3(0.1, 0, 0)).norm() < 1e-6);
    }
  CHECK(vertices.size() == 400);
  const auto tools = bench.last<Tools>(1);
  REQUIRE(tools);
  REQUIRE(std::get<Tools>(tools->body).tools.size() == 1);
  CHECK(std::get<Tools>(tools->body).tools[0].station == "hand");
  CHECK(std::get<Tools>(tools->body).tools[0].force.z() == 1);

  bench.sent.clear();
  std::uint32_t pieces = 1, got = 0;
  for (std::uint32_t piece = 0; piece < pieces; ++piece) {
    eye.say(MeshRequest{piece});
    const auto answer = bench.last<MeshPiece>(1);
    REQUIRE(answer);
    const auto& mesh = std::get<MeshPiece>(answer->body);
    CHECK(mesh.first == got);
    CHECK(mesh.mesh_hash == 77);
    pieces = mesh.pieces;
    got += static_cast<std::uint32_t>(mesh.triangles.size());
  }
  CHECK(got == 398);
  eye.say(MeshRequest{pieces});
  CHECK(bench.core.counts().unexpected == 1);
}

TEST_CASE("a mesh hash tells one topology from another") {
  Scene a;
  a.body.nodes.resize(4);
  a.body.triangles = {{0, 1, 2}, {0, 2, 3}};
  auto b = a;
  b.body.triangles[1] = {0, 3, 2};
  CHECK(facts_of(a, Vec3::Zero()).mesh_hash == facts_of(a, Vec3::Ones()).mesh_hash);
  CHECK(facts_of(a, Vec3::Zero()).mesh_hash != facts_of(b, Vec3::Zero()).mesh_hash);
  CHECK(facts_of(a, Vec3::Zero()).vertices == 4);
}
