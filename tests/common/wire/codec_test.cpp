#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <random>

#include "seeds.hpp"

using namespace palpate;

namespace {

template <class T>
T round_trip(const T& body) {
  Message out;
  REQUIRE(decode(seeds::bytes_of(seeds::message(body)), out) == WireFault::none);
  return std::get<T>(out.body);
}

double distance_max(const Vec3& a, const Vec3& b) { return (a - b).cwiseAbs().maxCoeff(); }

}  // namespace

TEST_CASE("every kind of message fits a datagram and encodes to the same bytes again after decoding") {
  for (const Message& message : seeds::every_kind()) {
    CAPTURE(message.body.index());
    const auto bytes = seeds::bytes_of(message);
    REQUIRE(bytes.size() > 0);
    REQUIRE(bytes.size() <= kMaxDatagramBytes);
    Message out;
    REQUIRE(decode(bytes, out) == WireFault::none);
    CHECK(out.body.index() == message.body.index());
    CHECK(out.instance == message.instance);
    CHECK(out.station == message.station);
    CHECK(out.seq == message.seq);
    CHECK(out.clock.sent == message.clock.sent);
    CHECK(out.clock.echo == message.clock.echo);
    CHECK(out.clock.echo_hold == message.clock.echo_hold);
    CHECK(seeds::bytes_of(out) == bytes);
  }
}

TEST_CASE("text and whole numbers of the handshake arrive as they were sent") {
  const Hello hello = round_trip(Hello{"left hand", Role::viewer, Scheme::ring, 22, "right hand"});
  CHECK(hello.station == "left hand");
  CHECK(hello.shadow_of == "right hand");
  CHECK(hello.role == Role::viewer);
  CHECK(hello.scheme == Scheme::ring);
  CHECK(hello.order == 22);
  const Welcome welcome =
      round_trip(Welcome{"liver", ContactKind::touch, 20, Vec3(0.1, -0.2, 9.99), 1500, 2996, 0x123456789abcdef0ull});
  CHECK(welcome.scene == "liver");
  CHECK(welcome.contact == ContactKind::touch);
  CHECK(welcome.rate_hz == 20);
  CHECK(welcome.mesh_hash == 0x123456789abcdef0ull);
  CHECK(welcome.scene_hash == 0);
  CHECK(round_trip(Welcome{.scene = "liver", .rate_hz = 20, .scene_hash = 0xfedcba9876543210ull}).scene_hash ==
        0xfedcba9876543210ull);
  CHECK(distance_max(welcome.home, Vec3(0.1, -0.2, 9.99)) <= 0x1p-28);
  const Refuse refuse = round_trip(Refuse{RefuseReason::unknown_station, std::string(500, 'x')});
  CHECK(refuse.reason == RefuseReason::unknown_station);
  CHECK(refuse.message == std::string(kMaxRefuseBytes, 'x'));
}

TEST_CASE("what a deadband needs arrives as it was sent, and costs nothing where there is none") {
  CHECK(round_trip(Beat{.renewed_from = 4'000'000'000u}).renewed_from == 4'000'000'000u);
  CHECK(round_trip(Welcome{"s", ContactKind::touch, 20, Vec3::Zero(), 0, 0, 0, 0.125}).deadband == 0.125);
  Samples samples = seeds::samples(3);
  const std::size_t without = seeds::bytes_of(seeds::message(samples)).size();
  samples.playing = 77;
  CHECK(round_trip(samples).playing == 77);
  CHECK(seeds::bytes_of(seeds::message(samples)).size() > without);
  Message out;
  const Welcome wide{"s", ContactKind::touch, 20, Vec3::Zero(), 0, 0, 0, 0.75};
  CHECK(decode(seeds::bytes_of(seeds::message(wide)), out) == WireFault::out_of_range);
}

TEST_CASE("what was added to messages later goes there and back, and is absent where it is not said") {
  Hello hello{"hand", Role::haptic, Scheme::port, 0, ""};
  CHECK_FALSE(round_trip(hello).alike);
  hello.alike = true;
  CHECK(round_trip(hello).alike);
  CHECK(round_trip(hello).scheme == Scheme::port);
  hello.scheme.reset();
  CHECK_FALSE(round_trip(hello).scheme.has_value());
  CHECK(round_trip(Beat{}).in_use.reason == SchemeReason::unknown);
  const Beat chosen = round_trip(Beat{.in_use = {Scheme::hyper, SchemeReason::fits, Micros{9'000}, Micros{30'000}}});
  CHECK(chosen.in_use.scheme == Scheme::hyper);
  CHECK(chosen.in_use.reason == SchemeReason::fits);
  CHECK(chosen.in_use.cost == Micros{9'000});
  CHECK(chosen.in_use.limit == Micros{30'000});
  Welcome welcome{"s", ContactKind::touch, 20, Vec3::Zero(), 0, 0, 0};
  CHECK(round_trip(welcome).station.empty());
  welcome.station = "hand-2";
  CHECK(round_trip(welcome).station == "hand-2");
  RoomView room;
  CHECK_FALSE(round_trip(room).asleep);
  room.asleep = true;
  CHECK(round_trip(room).asleep);
  CHECK_FALSE(round_trip(room).starved);
  room.starved = true;
  CHECK(round_trip(room).starved);
  room.stations.push_back(
      {"hand", {}, {}, {}, 0, 0, 0, 0, {Scheme::port, SchemeReason::server_busy, Micros{41'000}, Micros{30'000}}});
  const StationView shown = round_trip(room).stations.front();
  CHECK(shown.in_use.reason == SchemeReason::server_busy);
  CHECK(shown.in_use.cost == Micros{41'000});
}

TEST_CASE("what belongs to guidance goes there and back, is absent where nobody guides, and has its ranges") {
  Hello hello{"OR 3", Role::haptic, Scheme::port, 0, ""};
  CHECK(round_trip(hello).guides.empty());
  hello.guides = "OR 1";
  CHECK(round_trip(hello).guides == "OR 1");
  CHECK(round_trip(hello).tool.empty());
  hello.tool = "probe";
  CHECK(round_trip(hello).tool == "probe");
  hello.tool = "two\nlines";
  Message wrong;
  CHECK(decode(seeds::bytes_of(seeds::message(hello)), wrong) == WireFault::out_of_range);
  hello.tool.clear();
  CHECK(round_trip(Beat{}).guidance.hand == GuidanceHand::ready);
  CHECK(round_trip(Beat{.notes = 70'000}).notes == 70'000);
  CHECK_FALSE(round_trip(Beat{}).released);
  CHECK(round_trip(Beat{.released = true}).released);
  const GuidanceReport report = round_trip(Beat{.guidance = {GuidanceHand::refuses, Micros{321'000}, 0.5}}).guidance;
  CHECK(report.hand == GuidanceHand::refuses);
  CHECK(report.reach == Micros{321'000});
  CHECK(report.force_n == 0.5);
  const Guidance sent{"OR 1", true, GuidanceHand::busy, Micros{50'000}, Micros{-9'000'000}, Vec3(0.1, -0.2, 9.9)};
  const Guidance guidance = round_trip(sent);
  CHECK(guidance.partner == "OR 1");
  CHECK(guidance.guides);
  CHECK(guidance.hand == GuidanceHand::busy);
  CHECK(guidance.reach == sent.reach);
  CHECK(guidance.stamp == sent.stamp);
  CHECK(distance_max(guidance.position, sent.position) <= 0x1p-28);
  Tools tools{
      1, Micros{2}, 0, {{"OR 3", Vec3::Zero(), Vec3::Zero(), false, {}, 0, "OR 1"}, {"OR 1", Vec3::Zero(), Vec3::Zero(), false}}};
  CHECK(round_trip(tools).tools[0].guides == "OR 1");
  CHECK(round_trip(tools).tools[1].guides.empty());
  Message out;
  CHECK(decode(seeds::bytes_of(seeds::message(Beat{.guidance = {GuidanceHand::busy, {}, 0}})), out) == WireFault::out_of_range);
  CHECK(decode(seeds::bytes_of(seeds::message(Beat{.guidance = {GuidanceHand::holds, {}, -1}})), out) == WireFault::out_of_range);
}

TEST_CASE("a Hello is never smaller than the largest answer to it") {
  CHECK(seeds::bytes_of(seeds::message(Hello{"h", Role::haptic, Scheme::port, 0, ""})).size() == kHelloBytes);
  const std::string name(kMaxNameBytes, 'n');
  CHECK(seeds::bytes_of(seeds::message(Hello{name, Role::haptic, Scheme::port, 22, name})).size() == kHelloBytes);
  const auto welcome =
      seeds::bytes_of(seeds::message(Welcome{name, ContactKind::touch, 1000, Vec3::Ones(), 1u << 24, 1u << 25, ~0ull}));
  const auto refuse = seeds::bytes_of(seeds::message(Refuse{RefuseReason::version, std::string(kMaxRefuseBytes, 'x')}));
  CHECK(welcome.size() <= kHelloBytes);
  CHECK(refuse.size() <= kHelloBytes);
  auto cut = seeds::bytes_of(seeds::message(Hello{"h", Role::haptic, Scheme::port, 0, ""}));
  cut.resize(kHelloBytes - 1);
  Message out;
  CHECK(decode(cut, out) == WireFault::too_short);
}

TEST_CASE("a tool sample costs 16 bytes and keeps its place to 4 nm and its time to the microsecond") {
  const Samples sent = seeds::samples(kMaxSamplesPerDatagram);
  const Samples got = round_trip(sent);
  REQUIRE(got.samples.size() == sent.samples.size());
  for (std::size_t i = 0; i < sent.samples.size(); ++i) {
    CHECK(got.samples[i].t == sent.samples[i].t);
    CHECK(distance_max(got.samples[i].position, sent.samples[i].position) <= 3.8e-9);
  }
  const auto size = [](int n) { return seeds::bytes_of(seeds::message(seeds::samples(n))).size(); };
  CHECK(size(40) - size(8) == 32 * 16);
}

TEST_CASE("a patch of 11 modes for a grasp and one of 8 modes with 12 vertices fit into one datagram") {
  CHECK(seeds::bytes_of(seeds::message(PatchMessage{seeds::attach_patch(11)})).size() > 0);
  CHECK(seeds::bytes_of(seeds::message(PatchMessage{seeds::touch_patch(8, 12, 16)})).size() > 0);
  CHECK(max_port_vertices(8, 16) >= 12);
}

TEST_CASE("the most modes that a station may ask for fit: all for a grasp, and for a touch with a triangle") {
  CHECK(max_port_modes(ContactKind::attach) == kMaxModes);
  Patch loaded = seeds::attach_patch(kMaxModes);
  loaded.load_rate = ModeVector::Ones(kMaxModes);
  CHECK(seeds::bytes_of(seeds::message(PatchMessage{loaded})).size() > 0);
  CHECK(max_port_modes(ContactKind::touch) == kMaxModes);
  CHECK(max_port_vertices(kMaxModes, kMaxPortTriangles) >= 3);
}

TEST_CASE("the bound on the vertices of a local surface really encodes") {
  for (const int triangles : {1, 7, 16, kMaxPortTriangles})
    for (int modes = 0; modes <= kMaxModes; ++modes) {
      const int vertices = max_port_vertices(modes, triangles);
      CAPTURE(modes, triangles, vertices);
      CHECK(vertices <= kMaxPortVertices);
      if (vertices >= 3)
        CHECK(seeds::bytes_of(seeds::message(PatchMessage{
                                  seeds::touch_patch(modes, vertices, std::min(triangles, most_triangles(vertices)))}))
                  .size() > 0);
    }
}

TEST_CASE("the largest pieces of a mesh and of a shape fit, and one more does not") {
  MeshPiece mesh;
  mesh.pieces = 1;
  mesh.triangles.assign(kMaxPieceTriangles, Triangle{1, 2, (1u << 24) - 1});
  CHECK(round_trip(mesh).triangles == mesh.triangles);
  mesh.triangles.push_back({1, 2, 3});
  CHECK(seeds::bytes_of(seeds::message(mesh)).empty());

  mesh.triangles.clear();
  mesh.vertices.assign(kMaxPieceVertices, {Vec3(9.9, -9.9, 0.123456).unaryExpr(&to_rest_step), true});
  const auto vertices = round_trip(mesh).vertices;
  REQUIRE(vertices.size() == kMaxPieceVertices);
  CHECK(vertices.back().rest == mesh.vertices.back().rest);
  CHECK(vertices.back().fixed);
  mesh.vertices.back() = {Vec3::Zero(), false, true};
  CHECK(round_trip(mesh).vertices.back().wall);
  CHECK_FALSE(round_trip(mesh).vertices.back().fixed);
  mesh.vertices.push_back({});
  CHECK(seeds::bytes_of(seeds::message(mesh)).empty());

  mesh.vertices.clear();
  for (std::uint32_t k = 0; k < kMaxPieceRemoved; ++k) mesh.removed.push_back(49'000 * k);
  CHECK(round_trip(mesh).removed == mesh.removed);
  mesh.triangles = {{1, 2, 3}};
  CHECK(seeds::bytes_of(seeds::message(mesh)).empty());
  mesh.triangles.clear();
  mesh.removed.push_back((1u << 24) - 1);
  CHECK(seeds::bytes_of(seeds::message(mesh)).empty());

  ShapePiece shape;
  std::mt19937 random(1);
  while (shape.blocks.size() <= kMaxPieceBytes) {
    const auto one = seeds::shape_piece(random, ShapeChannel::position, 3);
    const auto before = shape.blocks.size();
    shape.blocks.insert(shape.blocks.end(), one.blocks.begin(), one.blocks.end());
    if (shape.blocks.size() > kMaxPieceBytes) break;
    CHECK(round_trip(shape).blocks == shape.blocks);
    REQUIRE(shape.blocks.size() > before);
  }
  CHECK(seeds::bytes_of(seeds::message(shape)).empty());
}

TEST_CASE("numbers that the wire cannot carry are not sent") {
  Patch patch = seeds::touch_patch(4, 7, 6);
  patch.surface.vertices[3].rows(1, 2) = std::nan("");
  CHECK(seeds::bytes_of(seeds::message(PatchMessage{patch})).empty());
  patch = seeds::attach_patch(3);
  patch.g[1] = INFINITY;
  CHECK(seeds::bytes_of(seeds::message(PatchMessage{patch})).empty());
  CHECK(seeds::bytes_of(seeds::message(Samples{{{Micros{1}, Vec3(0, kWorldExtentM * 1.01, 0)}}})).empty());
  CHECK(seeds::bytes_of(seeds::message(Samples{{{Micros{1}, Vec3(0, std::nan(""), 0)}}})).empty());
  CHECK(seeds::bytes_of(seeds::message(Samples{{{Micros{2}, Vec3::Zero()}, {Micros{1}, Vec3::Zero()}}})).empty());
}

TEST_CASE("nonsense is named: too short, too long, not ours, another version, out of range, not finite") {
  Message out;
  auto bytes = seeds::bytes_of(seeds::message(Beat{}));
  CHECK(decode(std::span(bytes).first(10), out) == WireFault::too_short);
  CHECK(decode(std::vector<std::byte>(kMaxDatagramBytes + 1), out) == WireFault::too_long);
  CHECK(decode(std::vector<std::byte>(100), out) == WireFault::not_palpate);
  bytes.resize(30);
  CHECK(decode(bytes, out) == WireFault::malformed);
  CHECK(decode(seeds::bytes_of(seeds::message(Hello{"", Role::haptic, Scheme::port, 0, ""})), out) == WireFault::out_of_range);
  CHECK(decode(seeds::bytes_of(seeds::message(Hello{"a\nb", Role::haptic, Scheme::port, 0, ""})), out) ==
        WireFault::out_of_range);
  CHECK(decode(seeds::bytes_of(seeds::message(Tools{0, {}, 0, {{"a", Vec3::Zero(), Vec3(0, 2e4, 0), true}}})), out) ==
        WireFault::out_of_range);
  CHECK(decode(seeds::bytes_of(seeds::message(Samples{{{Micros{1}, Vec3::Zero()}, {Micros{1}, Vec3::Zero()}}})), out) ==
        WireFault::out_of_range);

  CHECK(decode(seeds::bytes_of(seeds::message(Beat{.link = {10, 11, 1, {}}})), out) == WireFault::out_of_range);
  CHECK(decode(seeds::bytes_of(seeds::message(Beat{.link = {10, 2, 3, {}}})), out) == WireFault::out_of_range);

  auto welcome = seeds::bytes_of(seeds::message(Welcome{"s", ContactKind::touch, 17.25, Vec3::Zero(), 0, 0, 0}));
  const float rate = 17.25f, not_a_number = std::nanf("");
  const auto* pattern = reinterpret_cast<const std::byte*>(&rate);
  const auto at = std::search(welcome.begin(), welcome.end(), pattern, pattern + 4);
  REQUIRE(at != welcome.end());
  std::memcpy(&*at, &not_a_number, 4);
  CHECK(decode(welcome, out) == WireFault::not_finite);
}

TEST_CASE("a datagram of another version says so, and still says which station sent it") {
  auto bytes = seeds::bytes_of(seeds::message(Hello{"h", Role::haptic, Scheme::port, 0, ""}));
  // The version stands where the root table's vtable places field 0.
  const auto u16 = [&](std::size_t at) {
    return std::to_integer<std::size_t>(bytes[at]) | std::to_integer<std::size_t>(bytes[at + 1]) << 8;
  };
  const std::size_t table = u16(0), vtable = table - u16(table), version = table + u16(vtable + 4);
  REQUIRE(u16(version) == kWireVersion);
  bytes[version] = std::byte{kWireVersion + 1};
  for (std::size_t i = kHelloBytes / 2; i < bytes.size(); ++i) bytes[i] = std::byte{0xff};  // arbitrary content of that version
  Message out;
  CHECK(decode(bytes, out) == WireFault::version);
  CHECK(out.station == 7);
  CHECK(out.seq == 123456);
  CHECK(out.instance == 0xfeedbeefcafe1234ull);
}

TEST_CASE(
    "how a tool is held goes there and back to 0.005 degrees, its buttons exactly, and both cost nothing where there is none") {
  Samples samples = seeds::samples(3);
  const std::size_t without = seeds::bytes_of(seeds::message(samples)).size();
  for (const ToolSample& sample : round_trip(samples).samples) CHECK_FALSE(sample.orientation);
  const Eigen::Quaterniond held = Eigen::Quaterniond(0.3, -0.8, 0.1, 0.4).normalized();
  samples.samples.back().orientation = held;
  const std::size_t turned = seeds::bytes_of(seeds::message(samples)).size();
  samples.buttons = {{Micros{-7}, 1}, {Micros{9'000'000'000}, 0}, {Micros{9'000'000'001}, 0x80000001u}};
  const Samples back = round_trip(samples);
  CHECK_FALSE(back.samples[1].orientation);
  CHECK(back.samples[2].orientation->angularDistance(Rotation(held)) < 0.005 * M_PI / 180);
  REQUIRE(back.buttons.size() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(back.buttons[i].t == samples.buttons[i].t);
    CHECK(back.buttons[i].pressed == samples.buttons[i].pressed);
  }
  CHECK(turned - without <= 12);
  Tools tools{
      1, Micros{2}, 0, {{"pen", Vec3::Zero(), Vec3::Zero(), false, held, 6}, {"ball", Vec3::Zero(), Vec3::Zero(), false}}};
  const Tools seen = round_trip(tools);
  CHECK(seen.tools[0].orientation->angularDistance(Rotation(held)) < 0.005 * M_PI / 180);
  CHECK(seen.tools[0].buttons == 6);
  CHECK_FALSE(seen.tools[1].orientation);
  CHECK(seen.tools[1].buttons == 0);
}

TEST_CASE("the fullest datagram of samples has room for how the tool is held and all changes of buttons that it may carry") {
  Samples samples = seeds::samples(kMaxSamplesPerDatagram);
  samples.playing = 77;
  samples.samples.back().orientation = Rotation(Rotation::Identity());
  for (int i = 0; i < kMaxButtonChanges; ++i) samples.buttons.push_back({Micros{i}, 1});
  CHECK(round_trip(samples).samples.size() == std::size_t{kMaxSamplesPerDatagram});
  samples.buttons.push_back({Micros{99}, 1});
  CHECK(seeds::bytes_of(seeds::message(samples)).empty());
}

TEST_CASE("every sample of a full datagram may have an orientation, and any rotation is encoded twice as it is once") {
  Samples samples = seeds::samples(kMaxTurnsPerDatagram);
  samples.playing = 77;
  for (int i = 0; i < kMaxButtonChanges; ++i) samples.buttons.push_back({Micros{i}, 1});
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (int round = 0; round < 200; ++round) {
    for (ToolSample& sample : samples.samples)
      sample.orientation = Eigen::Quaterniond(round % 2 == 0 ? 1e-4 * normal(random) : normal(random), normal(random),
                                              normal(random), round % 3 == 0 ? 0 : normal(random))
                               .normalized();
    const Samples once = round_trip(samples), twice = round_trip(once);
    for (std::size_t i = 0; i < samples.samples.size(); ++i) {
      CHECK(once.samples[i].orientation->angularDistance(*samples.samples[i].orientation) < 0.005 * M_PI / 180);
      CHECK(twice.samples[i].orientation->coeffs() == once.samples[i].orientation->coeffs());
    }
  }
  samples.samples.push_back(samples.samples.back());
  CHECK(seeds::bytes_of(seeds::message(samples)).empty());
}

TEST_CASE("an orientation that is none is neither sent nor taken, nor are buttons that go back in time") {
  Samples samples = seeds::samples(2);
  samples.samples.back().orientation = Rotation(0.9, 0, 0, 0);
  CHECK(seeds::bytes_of(seeds::message(samples)).empty());
  samples.samples.back().orientation = Rotation(NAN, 0, 0, 1);
  CHECK(seeds::bytes_of(seeds::message(samples)).empty());
  samples.samples.back().orientation.reset();
  samples.buttons = {{Micros{5}, 1}, {Micros{5}, 0}};
  Message out;
  CHECK(decode(seeds::bytes_of(seeds::message(samples)), out) == WireFault::out_of_range);
}

TEST_CASE("Openings of jaws arrive for each sample to a 65,535th, cost nothing where all are closed, and fit a full datagram") {
  Samples samples = seeds::samples(kMaxOpeningsPerDatagram);
  samples.playing = 77;
  for (int i = 0; i < kMaxButtonChanges; ++i) samples.buttons.push_back({Micros{i}, 1});
  for (ToolSample& sample : samples.samples) sample.orientation = Rotation(Rotation::Identity());
  const std::size_t closed = seeds::bytes_of(seeds::message(samples)).size();
  for (std::size_t i = 0; i < samples.samples.size(); ++i)
    samples.samples[i].opening = static_cast<double>(i) / (kMaxOpeningsPerDatagram - 1);
  const Samples got = round_trip(samples), again = round_trip(got);
  REQUIRE(got.samples.size() == samples.samples.size());
  for (std::size_t i = 0; i < got.samples.size(); ++i) {
    CHECK(std::abs(got.samples[i].opening - samples.samples[i].opening) <= 0.5 / 65535 + 1e-12);
    CHECK(again.samples[i].opening == got.samples[i].opening);
  }
  CHECK(seeds::bytes_of(seeds::message(samples)).size() <= closed + 2 * kMaxOpeningsPerDatagram + 16);
  for (ToolSample& sample : samples.samples) sample.opening = 0;
  CHECK(seeds::bytes_of(seeds::message(samples)).size() == closed);
  for (const double wrong : {-0.01, 1.01, std::nan("")}) {
    samples.samples[3].opening = wrong;
    CHECK(seeds::bytes_of(seeds::message(samples)).empty());
  }
  samples.samples[3].opening = 0.5;
  samples.samples.push_back(samples.samples.back());
  CHECK(seeds::bytes_of(seeds::message(samples)).empty());
}

TEST_CASE("Viewers get the jaws of the room's tools, and their openings") {
  RoomView room;
  room.tool = {{Vec3::Zero(), 32 * kToolStepM, 3000 * kToolStepM, 4000 * kSwingStepRad}, {Vec3::Zero(), 32 * kToolStepM}};
  CHECK(round_trip(room).tool == room.tool);
  room.stations = {
      {.station = "left"}, {.station = "right", .tool = {"probe", {room.tool[1]}}}, {.station = "third", .tool = {"point", {}}}};
  const RoomView seen = round_trip(room);
  CHECK(seen.stations[0].tool == HeldTool{});
  CHECK(seen.stations[1].tool == room.stations[1].tool);
  CHECK(shape_held(seen, "left") == room.tool);
  CHECK(shape_held(seen, "right") == ToolShape{room.tool[1]});
  CHECK(shape_held(seen, "third").empty());
  CHECK(shape_held(seen, "nobody") == room.tool);
  room.tool[0].swing_rad = 1.2;
  CHECK(seeds::bytes_of(seeds::message(room)).empty());
  const Tools tools{1, Micros{2}, 0, {{"pen", Vec3::Zero(), Vec3::Zero(), false, {}, 0, "", 0.4, Vec3(0.25, 0, -0.5)}}};
  CHECK(round_trip(tools).tools[0].opening == Approx(0.4).margin(1e-5));
  CHECK(round_trip(tools).tools[0].torque == Vec3(0.25, 0, -0.5));
}

TEST_CASE("Viewers get the names and colours of several bodies, and the body of each vertex") {
  RoomView room;
  CHECK(round_trip(room).bodies.empty());
  room.bodies = {{"liver", 0x7a2f2a}, {"stomach", 0xffffff}};
  const std::vector<BodyName> bodies = round_trip(room).bodies;
  REQUIRE(bodies.size() == 2);
  CHECK(bodies[1].name == "stomach");
  CHECK(bodies[0].colour == 0x7a2f2a);
  room.bodies.assign(kMostBodies + 1, {"one", 0});
  CHECK(seeds::bytes_of(seeds::message(room)).empty());
  MeshPiece piece{77, 0, 1, 0, {}, {}};
  for (std::uint8_t body = 0; body < kMostBodies; ++body)
    for (const auto& [fixed, wall] : {std::pair(false, false), {true, false}, {false, true}})
      piece.vertices.push_back({Vec3(0.5, 0.25, 0), fixed, wall, body});
  const MeshPiece back = round_trip(piece);
  REQUIRE(back.vertices.size() == piece.vertices.size());
  for (std::size_t i = 0; i < piece.vertices.size(); ++i) CHECK(mark_of(back.vertices[i]) == mark_of(piece.vertices[i]));
  MeshVertex vertex;
  CHECK(read_mark(kThreadMark, vertex));
  CHECK(vertex.thread);
  CHECK_FALSE(read_mark(kBodyMark * kMostBodies, vertex));
}
