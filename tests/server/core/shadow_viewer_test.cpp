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
  far.clock_offset = 77s + 76ms;  // as after a clock step hidden by its long delay
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

TEST_CASE("a force beyond what the wire carries is shown as the most that it does") {
  Bench bench;
  bench.room.force = Vec3(2e5, -3, -2e5);
  RawStation eye(bench, 1, "eye"), hand(bench, 2, "hand");
  eye.hello.role = Role::viewer;
  eye.join();
  hand.join().live(200ms);
  const auto tools = bench.last<Tools>(1);
  REQUIRE(tools);  // it can be read
  CHECK(std::get<Tools>(tools->body).tools.at(0).force.isApprox(Vec3(1e4, -3, -1e4)));
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
  std::uint16_t pieces_sent = 0;
  for (const auto& [to, message] : bench.sent)
    if (const auto* shape = std::get_if<ShapePiece>(&message.body)) {
      CHECK(to == 1);
      ++pieces_sent;
      BlockReader reader(shape->blocks, 3);
      for (ShapeBlock block; reader.next(block);)
        for (std::uint32_t i = 0; i < block.vertices; ++i) {
          vertices.insert(64 * block.index + i);
          CHECK(std::abs(shape->unit * block.numbers[3 * i] - 0.1) < 5e-5);
        }
    }
  CHECK(vertices.size() == 400);
  CHECK(pieces_sent == 1);  // nothing moves after the first frame
  const auto tools = bench.last<Tools>(1);
  REQUIRE(tools);
  REQUIRE(std::get<Tools>(tools->body).tools.size() == 1);
  CHECK(std::get<Tools>(tools->body).tools[0].station == "hand");
  CHECK(std::get<Tools>(tools->body).tools[0].force.z() == 1);

  bench.sent.clear();
  std::uint32_t pieces = 1;
  std::size_t got_vertices = 0, got_triangles = 0;
  for (std::uint32_t piece = 0; piece < pieces; ++piece) {
    eye.say(MeshRequest{piece});
    const auto answer = bench.last<MeshPiece>(1);
    REQUIRE(answer);
    const auto& mesh = std::get<MeshPiece>(answer->body);
    CHECK(mesh.first == (mesh.vertices.empty() ? got_triangles : got_vertices));
    CHECK(mesh.mesh_hash == 77);
    pieces = mesh.pieces;
    got_vertices += mesh.vertices.size();
    got_triangles += mesh.triangles.size();
  }
  CHECK(got_vertices == 400);
  CHECK(got_triangles == 398);
  eye.say(MeshRequest{pieces});
  CHECK(bench.core.counts().unexpected == 1);
}

TEST_CASE("a viewer gets the mesh twice at once, and from then on at its rate, however often it asks") {
  Bench bench;
  RawStation eye(bench, 1, "eye");
  eye.hello.role = Role::viewer;
  eye.join();
  eye.say(ViewState{.kbit_s = 80});
  eye.say(MeshRequest{0});
  const auto answer = bench.last<MeshPiece>(1);
  REQUIRE(answer);
  const double at_once = 2.0 * std::get<MeshPiece>(answer->body).pieces * kMaxDatagramBytes;
  const auto pieces_in = [&](Micros time) {
    double bytes = 0;
    for (const Micros end = bench.now + time; bench.now < end;) {
      bench.sent.clear();
      bench.sizes.clear();
      eye.say(MeshRequest{0});
      bench.wait(1ms);
      for (std::size_t k = 0; k < bench.sent.size(); ++k)
        if (std::holds_alternative<MeshPiece>(bench.sent[k].second.body)) bytes += static_cast<double>(bench.sizes[k]);
    }
    return bytes;
  };
  const double first = pieces_in(1s), second = pieces_in(1s);
  CAPTURE(at_once, first, second);
  CHECK(first < at_once + 10'000 + kMaxDatagramBytes);
  CHECK(second == Approx(10'000).margin(kMaxDatagramBytes));
}

TEST_CASE("a viewer sees how a tool is held and which of its buttons are pressed, as the hand said it last") {
  Bench bench;
  RawStation eye(bench, 1, "eye"), hand(bench, 2, "hand");
  eye.hello.role = Role::viewer;
  eye.join();
  hand.join().live(200ms);
  CHECK_FALSE(std::get<Tools>(bench.last<Tools>(1)->body).tools.at(0).orientation);
  const Eigen::Quaterniond held(0, 0.6, 0.8, 0);
  bench.now += 1ms;
  Samples samples{{hand.sample()}};
  samples.samples.back().orientation = held;
  samples.buttons = {{hand.clock() - 3ms, 1}, {hand.clock() - 1ms, 2}};
  hand.say(samples);
  for (int k = 0; k < 100; ++k) {
    bench.now += 1ms;
    bench.tick();
  }
  const ToolView tool = std::get<Tools>(bench.last<Tools>(1)->body).tools.at(0);
  REQUIRE(tool.orientation);
  CHECK(tool.orientation->angularDistance(held) < 1e-4);
  CHECK(tool.buttons == 2);
}

TEST_CASE("a viewer hears four times a second how the room and its stations do") {
  Bench bench;
  RawStation eye(bench, 1, "eye"), hand(bench, 2, "hand");
  eye.hello.role = Role::viewer;
  eye.join();
  hand.join();
  hand.say(Beat{.link = {.patch_age = Micros{123'000}}, .ticks_late = 17});
  bench.sent.clear();
  hand.live(1s);
  const auto count = std::count_if(bench.sent.begin(), bench.sent.end(), [](const auto& entry) {
    return entry.first == 1 && std::holds_alternative<RoomView>(entry.second.body);
  });
  CHECK(count >= 3);
  CHECK(count <= 5);
  hand.live(500ms);
  const auto said = bench.last<RoomView>(1);
  REQUIRE(said);
  const auto& room = std::get<RoomView>(said->body);
  CHECK(room.nodes == 400);
  CHECK(room.rate_hz == 20);
  CHECK_FALSE(room.asleep);
  REQUIRE(room.stations.size() == 1);  // viewers are not listed
  CHECK(room.stations[0].station == "hand");
  CHECK(room.stations[0].patch_age == Micros{123'000});
  CHECK(room.stations[0].ticks_late == 17);
  CHECK(room.stations[0].lost == 0);
  CHECK(room.stations[0].in_use.scheme == Scheme::port);
}

TEST_CASE("a mesh hash tells one topology, one rest position and one fixed node from another") {
  Scene a;
  a.body.nodes = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 1, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)};
  a.body.fixed.assign(5, 0);
  a.body.triangles = {{0, 1, 2}, {0, 2, 3}};
  auto turned = a, moved = a, fixed = a;
  turned.body.triangles[1] = {0, 3, 2};
  moved.body.nodes[1].z() += 1e-5;
  fixed.body.fixed[3] = 1;
  const auto facts = facts_of(a, Vec3::Zero());
  CHECK(facts.mesh_hash == facts_of(a, Vec3::Ones()).mesh_hash);
  for (const auto& other : {turned, moved, fixed}) CHECK(facts.mesh_hash != facts_of(other, Vec3::Zero()).mesh_hash);
  CHECK(facts.nodes == 5);
  REQUIRE(facts.mesh.vertices.size() == 4);  // a vertex that no triangle uses is not shown
  for (std::size_t v = 0; v < 4; ++v) CHECK(facts.mesh.vertices[v].rest == a.body.nodes[facts.vertex_of[v]]);
}

TEST_CASE("a scene's hash tells bodies of one surface apart by what is felt, and not by where their nodes lie") {
  Scene a;
  a.body.nodes = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 1, 0), Vec3(0, 0, 1)};
  a.body.masses_kg.assign(4, 0.1);
  a.body.tetrahedra = {{{0, 1, 2, 3}}};
  a.body.materials.emplace_back();
  a.tool.needle.emplace();
  std::vector<Scene> others(8, a);
  others[0].body.materials[0].young_pa *= 1.01;
  others[1].body.materials[0].fibres.share = 2;
  others[2].body.masses_kg[3] = 0.2;
  others[3].body.relaxation.push_back({0.5, 1});
  others[4].body.gravity_m_s2.z() = -9.81;
  others[5].tool.friction = 0.1;
  others[6].tool.needle->width_m = 0.001;
  others[7].solver.step_s = 0.005;
  for (const Scene& other : others) CHECK(facts_of(a, Vec3::Zero()).scene_hash != facts_of(other, Vec3::Zero()).scene_hash);
  Scene moved = a;
  moved.body.nodes[1].x() = 1.01;
  CHECK(facts_of(a, Vec3::Zero()).scene_hash == facts_of(moved, Vec3::Ones()).scene_hash);
}

TEST_CASE("a viewer is told the room's task, soon and again every two seconds, and a hand is not") {
  Bench bench;
  RoomInfo facts = test_facts();
  facts.task = Task{"hold", PressTask{0.5, 2, 3}};
  bench.core = ServerCore(facts, {.draw = repeatable(42), .rate_hz = 20});
  RawStation eye(bench, 1, "eye"), hand(bench, 2, "hand");
  eye.hello.role = Role::viewer;
  eye.join();
  hand.join().live(1s);
  const auto told = [&](PeerId peer) {
    return std::count_if(bench.sent.begin(), bench.sent.end(), [&](const auto& entry) {
      const auto* task = std::get_if<Task>(&entry.second.body);
      if (task) CHECK(*task == *facts.task);
      return task && entry.first == peer;
    });
  };
  CHECK(told(1) == 1);
  hand.live(2s);
  CHECK(told(1) == 2);
  CHECK(told(2) == 0);
}
