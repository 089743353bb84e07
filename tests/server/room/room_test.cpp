// A room: stations come, hold, touch, share, tear and leave; the tool's path and the transition to a grasp.
#include "server/room/room.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "server/reduction/tool_prediction.hpp"
#include "server/room/tool_coupling.hpp"
#include "server/room/tool_track.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr Micros kFrame{50'000};
constexpr StationId kHand = 3, kOther = 4;

struct Stage {
  Room room;
  Micros now{7'000'000};

  explicit Stage(ContactKind contact) : Stage(box_scene(contact)) {}
  explicit Stage(const Scene& scene) : room(scene) { room.start(now); }

  /// One frame with the tool of every station on its path.
  FrameResult frame(const std::vector<StationId>& ids, const std::function<Vec3(Micros)>& tool, Scheme scheme = Scheme::port) {
    FrameJob job;
    job.target = now + kFrame;
    job.shapes = true;
    for (const StationId id : ids) {
      StationJob station;
      station.id = id;
      station.scheme = scheme;
      station.horizon = Micros{100'000};
      for (Micros t = now + Micros{1000}; t <= job.target + Micros{1000}; t += Micros{1000})
        station.samples.push_back({t, tool(t)});
      job.stations.push_back(station);
    }
    now = job.target;
    return room.run(job);
  }
};

Vec3 home() { return box_body(4, 4, 4).nodes[54]; }

}  // namespace

TEST_CASE("A grasp at home is felt as nothing, and its patches are stamped, numbered and pass the receiver's check") {
  Stage stage(ContactKind::attach);
  for (std::uint32_t seq = 1; seq <= 5; ++seq) {
    const FrameResult result = stage.frame({kHand}, [](Micros) { return home(); });
    CHECK(result.stamp == stage.now);
    CHECK(result.positions.size() == 64);
    REQUIRE(result.stations.size() == 1);
    const StationFrame& frame = result.stations[0];
    CHECK(frame.id == kHand);
    CHECK(frame.contact);
    CHECK(frame.force.norm() < 1e-9);
    REQUIRE(frame.patch);
    CHECK(frame.patch->seq == seq);
    CHECK(frame.patch->stamp == stage.now);
    CHECK(check(*frame.patch) == PatchFault::none);
  }
}

TEST_CASE("A tool that comes from far away grasps nothing, and moves nothing, until it is within reach of its node") {
  Stage stage(ContactKind::attach);
  const auto at = [](double metres) { return [metres](Micros) { return Vec3(home() + Vec3(0, 0, metres)); }; };
  FrameResult result;
  for (int k = 0; k < 10; ++k) result = stage.frame({kHand}, at(0.14));
  CHECK_FALSE(result.stations.at(0).patch);
  CHECK_FALSE(result.stations.at(0).contact);
  CHECK((result.positions[54] - home()).norm() < 1e-12);
  for (int k = 0; k < 30; ++k) result = stage.frame({kHand}, at(0.9 * kGraspReachM));
  REQUIRE(result.stations.at(0).patch);
  CHECK((result.positions[54] - home()).norm() == Approx(0.9 * kGraspReachM));
  for (int k = 0; k < 10; ++k) result = stage.frame({kHand}, at(0.9 * kGraspReachM + 0.02));  // once held, it follows further
  CHECK((result.positions[54] - home()).norm() == Approx(0.9 * kGraspReachM + 0.02));
}

TEST_CASE("A grasp that begins beside its node takes the node to the tool without a jolt") {
  Stage stage(ContactKind::attach);
  const Vec3 beside = home() + Vec3(0.004, 0, 0.003);
  FrameResult result = stage.frame({kHand}, [&](Micros) { return beside; });
  CHECK((result.stations[0].tool - home()).norm() < 0.001);
  for (int k = 0; k < 100; ++k) result = stage.frame({kHand}, [&](Micros) { return beside; });
  CHECK((result.stations[0].tool - beside).norm() < 1e-12);
  CHECK((result.positions[54] - beside).norm() < 1e-12);
  CHECK(result.stations[0].force.norm() > 0.05);
  CHECK(result.stations[0].force.dot(beside - home()) < 0);
}

TEST_CASE("A station that leaves lets go: the body returns to rest and nobody is answered") {
  Stage stage(ContactKind::attach);
  for (int k = 0; k < 20; ++k) stage.frame({kHand}, [](Micros) { return Vec3(home() + Vec3(0, 0, -0.005)); });
  FrameResult result;
  for (int k = 0; k < 100; ++k) result = stage.frame({}, {});
  CHECK(result.stations.empty());
  CHECK((result.positions[54] - home()).norm() < 1e-6);
}

TEST_CASE("A tool out of reach gets no patch, one near the surface an anticipating one, one inside is in contact") {
  Stage stage(ContactKind::touch);
  const auto at = [](double height) { return [height](Micros) { return Vec3(0.031, 0.032, 0.06 + height); }; };
  CHECK_FALSE(stage.frame({kHand}, at(0.5)).stations[0].patch);
  for (int k = 0; k < 6; ++k) stage.frame({kHand}, at(0.01));  // a tool takes a quarter of a second for half a metre
  const FrameResult near = stage.frame({kHand}, at(0.01));
  REQUIRE(near.stations[0].patch);
  CHECK_FALSE(near.stations[0].patch->touching);
  CHECK(near.stations[0].force.norm() == 0);
  CHECK(check(*near.stations[0].patch) == PatchFault::none);
  FrameResult inside;
  for (int k = 0; k < 10; ++k) inside = stage.frame({kHand}, at(-0.004));
  REQUIRE(inside.stations[0].patch);
  CHECK(inside.stations[0].contact);
  CHECK(inside.stations[0].patch->touching);
  CHECK(inside.stations[0].force.z() > 0.05);
  CHECK((inside.stations[0].patch->force - inside.stations[0].force).norm() == 0);
}

TEST_CASE("A tool on a face that is held fast meets what does not yield, with every scheme") {
  Scene scene = box_scene(ContactKind::touch);
  for (std::size_t i = 0; i < scene.body.nodes.size(); ++i)
    if (scene.body.nodes[i].z() > 0.059) scene.body.fixed[i] = 1;
  const Scheme scheme = GENERATE(Scheme::hold, Scheme::tangent, Scheme::ring, Scheme::port, Scheme::hyper);
  INFO(name_of(scheme));
  Stage stage(scene);
  for (const double height : {0.01, 0.01, -0.001, -0.001, -0.001}) {
    const FrameResult result = stage.frame(
        {kHand}, [&](Micros) { return Vec3(0.031, 0.032, 0.06 + height); }, scheme);
    REQUIRE(result.stations[0].patch);
    CHECK(check(*result.stations[0].patch) == PatchFault::none);
    CHECK(result.stations[0].contact == (height < 0));
    if (height < 0) CHECK(result.stations[0].force.z() == Approx(0.001 * scene.tool.contact_stiffness_n_m).epsilon(0.01));
  }
}

TEST_CASE("A shadow gets patches of the tool that it shares, and does not push") {
  Stage stage(ContactKind::attach);
  FrameResult result;
  for (int k = 0; k < 5; ++k) {
    FrameJob job;
    job.target = stage.now + kFrame;
    StationJob hand{kHand, Scheme::port, 0, 0, Micros{100'000}, {}}, shadow{kOther, Scheme::hold, 0, kHand, Micros{100'000}, {}};
    hand.samples.push_back({job.target, home() + Vec3(0, 0, -0.001 * k)});
    job.stations = {hand, shadow};
    stage.now = job.target;
    result = stage.room.run(job);
  }
  REQUIRE(result.stations.size() == 2);
  REQUIRE(result.stations[0].patch);
  REQUIRE(result.stations[1].patch);
  CHECK(result.stations[1].patch->constant);
  CHECK(result.stations[1].patch->force == result.stations[0].patch->force);
}

TEST_CASE("A shadow's patch is made for the tool that it shares, wherever that speeds up to") {
  Stage stage(box_scene(ContactKind::touch));
  FrameResult result;
  for (int k = 0; k < 8; ++k) {
    FrameJob job;
    job.target = stage.now + kFrame;
    StationJob hand{kHand, Scheme::hyper, 0, 0, Micros{100'000}, {}},
        shadow{kOther, Scheme::hyper, 0, kHand, Micros{100'000}, {}};
    for (Micros t = stage.now + Micros{1000}; t <= job.target; t += Micros{1000}) {
      const double s = seconds(t - Micros{7'000'000});
      hand.samples.push_back({t, home() + Vec3(0.05 * s * s, 0, 0.004 - 0.03 * s)});
    }
    job.stations = {hand, shadow};
    stage.now = job.target;
    result = stage.room.run(job);
  }
  REQUIRE(result.stations[0].patch);
  REQUIRE(result.stations[1].patch);
  const Patch &of_hand = *result.stations[0].patch, &of_shadow = *result.stations[1].patch;
  CHECK(of_hand.touching);
  CHECK(of_shadow.scheme == Scheme::hyper);
  CHECK(of_shadow.stiffness == of_hand.stiffness);
  CHECK(of_shadow.g == of_hand.g);
  CHECK(result.stations[1].terms.elements.stiffness == result.stations[0].terms.elements.stiffness);
}

TEST_CASE("A tool that tears at the body beyond sense does not stop the room, and the body finds its rest again") {
  const double far_m = GENERATE(0.3, 9.0);
  Stage stage(ContactKind::attach);
  stage.frame({kHand}, [](Micros) { return home(); });
  for (int k = 0; k < 5; ++k)
    stage.frame({kHand}, [&](Micros t) { return t.count() / 7000 % 2 ? Vec3(home() + Vec3(far_m, -far_m, far_m)) : home(); });
  FrameResult result;
  for (int k = 0; k < 240; ++k) {
    result = stage.frame({kHand}, [](Micros) { return home(); });
    for (const Vec3& x : result.positions) REQUIRE(x.allFinite());
  }
  CHECK_FALSE(result.failed);
  REQUIRE(result.stations[0].patch);
  CHECK(check(*result.stations[0].patch) == PatchFault::none);
  CHECK(result.stations[0].force.allFinite());
}

TEST_CASE("A frame of implicit steps that fell far behind costs no more than two, and one on time takes the scene's own step") {
  Scene scene = box_scene(ContactKind::touch);
  scene.solver.integrator = IntegratorKind::tr_bdf2;
  for (const int frames : {1, 2, 8}) {
    Stage stage(scene);
    FrameJob job;
    job.may_sleep = false;
    job.frame = kFrame;
    job.target = stage.now + frames * kFrame;
    const FrameResult result = stage.room.run(job);
    CHECK(result.stamp == job.target);
    CHECK(result.steps == (frames == 1 ? 5 : 10));
  }
}

TEST_CASE("The same frames twice are the same bits, in a new room and in one made at rest from another that was used") {
  const auto frames = [](Stage& stage) {
    FrameResult result;
    for (int k = 0; k < 20; ++k)
      result = stage.frame({kHand}, [](Micros t) {
        return Vec3(home() + Vec3(0.002 * std::sin(9e-6 * static_cast<double>(t.count())), 0.001, -0.003));
      });
    return result;
  };
  const auto integrator = GENERATE(IntegratorKind::automatic, IntegratorKind::leapfrog, IntegratorKind::tr_bdf2);
  Scene scene = box_scene(GENERATE(ContactKind::attach, ContactKind::touch));
  scene.solver.integrator = integrator;
  scene.body.gravity_m_s2 = Vec3(0, 0, -9.81);
  Stage used(scene), other(scene);
  const FrameResult a = frames(used), b = frames(other);
  Stage renewed(scene);
  renewed.room = used.room.at_rest();
  renewed.room.start(renewed.now);
  CHECK(renewed.room.integrator() == used.room.integrator());
  const FrameResult c = frames(renewed);
  for (const FrameResult* same : {&b, &c}) {
    CHECK(a.positions == same->positions);
    CHECK(a.stations[0].force == same->stations[0].force);
    CHECK(a.stations[0].patch->stiffness == same->stations[0].patch->stiffness);
  }
}

TEST_CASE("A tool's path is linear between its samples, still before them and slowing down after them") {
  ToolTrack track;
  CHECK(track.empty());
  const std::vector<ToolSample> samples{
      {Micros{1000}, Vec3(0, 0, 0)}, {Micros{2000}, Vec3(1e-3, 0, 0)}, {Micros{4000}, Vec3(1e-3, 4e-3, 0)}};
  track.add(samples);
  track.add(samples);
  CHECK(track.at(Micros{500}).position == Vec3(0, 0, 0));
  CHECK(track.at(Micros{500}).velocity == Vec3(0, 0, 0));
  CHECK((track.at(Micros{1250}).position - Vec3(0.25e-3, 0, 0)).norm() < 1e-15);
  CHECK((track.at(Micros{1250}).velocity - Vec3(1, 0, 0)).norm() < 1e-12);
  CHECK((track.at(Micros{2000}).velocity - Vec3(1, 0, 0)).norm() < 1e-12);
  CHECK((track.at(Micros{3000}).position - Vec3(1e-3, 2e-3, 0)).norm() < 1e-15);
  CHECK((track.at(Micros{4000}).velocity - Vec3(0, 2, 0)).norm() < 1e-12);
  // Extrapolated at the mean velocity over the whole of this short path, (0.333, 1.333) m/s, and at rest after kDeadReckoningS.
  const double on_s = 0.005, over_s = kDeadReckoningS, velocity = 4e-3 / 0.003;
  CHECK(track.at(Micros{9000}).position.y() == Approx(4e-3 + velocity * (on_s - on_s * on_s / (2 * over_s))));
  CHECK(track.at(Micros{9000}).velocity.y() == Approx(velocity * (1 - on_s / over_s)));
  CHECK(track.at(Micros{4000} + from_seconds(kDeadReckoningS)).velocity == Vec3(0, 0, 0));
  CHECK(track.at(Micros{900'000}).position == track.at(Micros{4000} + from_seconds(kDeadReckoningS)).position);
  track.forget_before(Micros{3000});
  CHECK((track.at(Micros{3000}).position - Vec3(1e-3, 2e-3, 0)).norm() < 1e-15);
}

TEST_CASE("A path is nowhere faster than a hand, and gets to where the tool is once that waits") {
  ToolTrack track;
  track.add(std::vector<ToolSample>{{Micros{0}, Vec3(0, 0, 0)}});
  for (int k = 1; k <= 100; ++k)  // to and fro, 60 m/s
    track.add(std::vector<ToolSample>{{Micros{1000 * k}, Vec3(0.06 * (k % 2), 0, 0)}});
  for (int k = 101; k <= 200; ++k) track.add(std::vector<ToolSample>{{Micros{1000 * k}, Vec3(0, 0.06, 0)}});
  for (Micros t{500}; t < Micros{200'000}; t += Micros{500}) {
    CHECK(track.at(t).velocity.norm() <= ToolTrack::kFastestMs * (1 + 1e-9));
    const Vec3 way = track.at(t).position - track.at(t - Micros{500}).position;
    CHECK(way.norm() <= ToolTrack::kFastestMs * 0.0005 * (1 + 1e-9));
  }
  CHECK((track.at(Micros{200'000}).position - Vec3(0, 0.06, 0)).norm() < 1e-12);
}

TEST_CASE("A path that forgets what is past goes on after its last sample as it would have, however long that has been") {
  ToolTrack track;
  for (int k = 0; k <= 20; ++k) {  // accelerating
    const double s = 0.001 * k;
    track.add(std::vector<ToolSample>{{from_seconds(s), Vec3(2 * s * s, 0, 0)}});
  }
  ToolTrack forgets = track;
  for (const Micros t : {Micros{10'000}, Micros{19'500}, Micros{40'000}, Micros{120'000}}) {
    forgets.forget_before(t);
    CHECK(forgets.begin() > track.begin());
    for (Micros then = t; then < Micros{150'000}; then += Micros{500}) {
      CHECK(forgets.at(then).position == track.at(then).position);
      CHECK(forgets.at(then).velocity == track.at(then).velocity);
    }
  }
}

TEST_CASE("Samples that come late lead the tool back to where it truly was, without a step of position or velocity") {
  ToolTrack track;
  track.add(std::vector<ToolSample>{{Micros{0}, Vec3(0, 0, 0)}, {Micros{10'000}, Vec3(0.002, 0, 0)}}, Micros{0});
  const Micros body{50'000};
  const ToolAt before = track.at(body);
  CHECK(before.position.x() > 0.002);
  // In truth it turned round.
  track.add(std::vector<ToolSample>{{Micros{20'000}, Vec3(0.001, 0, 0)}, {Micros{400'000}, Vec3(0.001, 0.038, 0)}}, body);
  CHECK((track.at(body).position - before.position).norm() < 1e-15);
  CHECK((track.at(body).velocity - Vec3(0, 0.1, 0)).norm() < 1e-9);
  const Micros led = body + ToolTrack::kLeadBack;
  CHECK((track.at(led).position - Vec3(0.001, 0.013, 0)).norm() < 1e-12);
  for (Micros t = body + Micros{1000}; t < led; t += Micros{1000}) {
    const Vec3 difference = (track.at(t + Micros{100}).position - track.at(t - Micros{100}).position) / 0.0002;
    CHECK((track.at(t).velocity - difference).norm() < 1e-4);
  }
}

TEST_CASE("The way into a grasp starts and ends at the tool's own speed, and its velocity is its derivative") {
  ToolTrack track;
  track.add(std::vector<ToolSample>{{Micros{0}, Vec3(0, 0, 0)}, {Micros{2'000'000}, Vec3(0.2, 0, 0)}});
  const Vec3 offset(0, 0.01, -0.02);
  const FadingVector grasp{Micros{200'000}, kGraspTime, offset};
  const auto node = [&](Micros t) { return moved_by(track.at(t), grasp, t); };
  CHECK((node(Micros{200'000}).position - track.at(Micros{200'000}).position - offset).norm() < 1e-15);
  CHECK((node(Micros{200'000}).velocity - Vec3(0.1, 0, 0)).norm() < 1e-12);
  CHECK(node(Micros{700'000}).position == track.at(Micros{700'000}).position);
  for (const int ms : {250, 400, 500, 690}) {
    constexpr Micros kStep{100};
    const Micros t{1000 * ms};
    const Vec3 difference = (node(t + kStep).position - node(t - kStep).position) / (2 * seconds(kStep));
    CHECK((node(t).velocity - difference).norm() < 1e-5);
  }
}

TEST_CASE("A tool begins above the middle of the body, wherever a ligament is fixed", "[room]") {
  const auto scene = [](const std::string& ligaments) {
    return read_scene(R"({"body": {"lattice": {"nodes": [4, 4, 4], "size_m": [0.06, 0.06, 0.06], "fixed_faces": ["z-"],
        "solid": {"young_pa": 8000}})" +
                          ligaments + R"(}, "tool": {"contact": "touch"}})",
                      "a.json");
  };
  const Scene held = scene(R"(, "ligaments": [{"from_m": [0, 0, 0.06], "radius_m": 0.01, "to_m": [0, 0, 0.3],
      "stiffness_n_m": 100}])");
  CHECK((home_of(held) - home_of(scene(""))).norm() < 1e-12);
}
