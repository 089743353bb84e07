// Tools with a body in a room: spheres on a flat block against the point tool, symmetry, and what the player makes of patches.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <string>

#include "common/patch/surface.hpp"
#include "common/player/player.hpp"
#include "server/reduction/tool_prediction.hpp"
#include "server/room/room.hpp"
#include "server/room/tool_track.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr Micros kBodyFrame{50'000};
constexpr StationId kHolder = 3;

/// A block, its top at z = 0.06 between 0 and 0.06 m, and one tool on it.
class Handled {
 public:
  explicit Handled(const ToolShape& shape, double friction = 0.3) : Handled(box_scene(ContactKind::touch), shape, friction) {}
  Handled(Scene scene, const ToolShape& shape, double friction) {
    scene.tool.shape = shape;
    scene.tool.friction = friction;
    room_.emplace(scene);
    room_->start(now);
  }
  FrameResult frame(const std::function<ToolPose(Micros)>& tool, Scheme scheme = Scheme::port, bool reset = false) {
    FrameJob job;
    job.reset = reset;
    job.target = now + kBodyFrame;
    StationJob hand;
    hand.id = kHolder;
    hand.scheme = scheme;
    hand.horizon = Micros{100'000};
    for (Micros t = now + Micros{1000}; t <= job.target + Micros{1000}; t += Micros{1000})
      hand.samples.push_back({t, tool(t).position, tool(t).turn, tool(t).opening});
    job.stations.push_back(hand);
    now = job.target;
    return room_->run(job);
  }
  StationFrame held(const ToolPose& pose, int frames = 30) {
    FrameResult result;
    for (int k = 0; k < frames; ++k) result = frame([&](Micros) { return pose; });
    return result.stations.front();
  }
  Micros now{7'000'000};

 private:
  std::optional<Room> room_;
};

const Vec3 kMiddle(0.03, 0.03, 0.06);
const ToolShape kPoint, kBall{{Vec3(0, 0, 0.005), 0.005}};
const ToolShape kBar{{Vec3(-0.012, 0, 0.004), 0.004}, {Vec3(0, 0, 0.004), 0.004}, {Vec3(0.012, 0, 0.004), 0.004}};

/// Jaws of four spheres about the middle of a block of 60 mm; closed, their faces are 50 mm apart.
ToolShape edge_jaws() {
  ToolShape shape;
  for (const double side : {1.0, -1.0})
    for (const double y : {-0.008, 0.008}) shape.push_back({Vec3(side * 0.029, y, 0.004), 0.004, 0.2, side * 0.1});
  return shape;
}

Rotation about(const Vec3& axis, double rad) { return Rotation(Eigen::AngleAxisd(rad, axis)); }

}  // namespace

TEST_CASE("A ball that is pressed into the middle of a block feels what a point does at the ball's lowest place") {
  Handled ball(kBall, 0), point(kPoint, 0);
  const Vec3 pressed = kMiddle - Vec3(0, 0, 0.006);
  const StationFrame a = ball.held(pressed), b = point.held(pressed);
  REQUIRE(b.force.z() > 0.1);
  CHECK((a.force - b.force).norm() < 1e-3 * b.force.norm());
  CHECK(a.tool == pressed);
  CHECK(a.torque.norm() < 1e-6 * a.force.norm());
}

TEST_CASE("A bar that is pressed level has no torque, one that is tilted is turned back, and by the mirror image equally") {
  Handled level(kBar, 0), one(kBar, 0), other(kBar, 0);
  const Vec3 pressed = kMiddle - Vec3(0, 0, 0.006);
  const StationFrame a = level.held(pressed);
  CHECK(a.contact);
  CHECK(a.force.z() > 0.1);
  CHECK(a.torque.norm() < 5e-4 * a.force.norm());  // [m]: the diagonals of the triangles have no mirror image
  const StationFrame b = one.held({pressed, about(Vec3::UnitY(), 0.15)}), c = other.held({pressed, about(Vec3::UnitY(), -0.15)});
  CHECK(b.torque.y() < -1e-3);
  CHECK(c.torque.y() == Approx(-b.torque.y()).epsilon(0.01));
  CHECK(c.force.z() == Approx(b.force.z()).epsilon(0.01));
}

TEST_CASE(
    "The patches of a bar that is pressed, rocked and slid have its contacts, and a player with them feels what the body does") {
  const Scheme scheme = GENERATE(Scheme::port, Scheme::hyper);
  Handled body(kBar);
  const Micros begin = body.now;
  const auto pose = [&](Micros t) {
    const double s = seconds(t - begin), in = std::min(1.0, s / 0.4);
    return ToolPose(kMiddle + Vec3(0.004 * std::sin(3 * s), 0, 0.001 - 0.006 * in),
                    about(Vec3::UnitY(), 0.12 * in * std::sin(5 * s)));
  };
  double error = 0, turning = 0, peak = 0, turning_peak = 0;
  int contacts_most = 0;
  std::optional<PatchPlayer> player;
  for (int k = 0; k < 40; ++k) {
    const FrameResult result = body.frame(pose, scheme);
    const StationFrame& frame = result.stations.front();
    if (player) {
      for (Micros t = player->time() + kTick; t <= result.stamp; t += kTick) player->advance({t, pose(t).position, pose(t).turn});
      error = std::max(error, (player->output().force - frame.force).norm());
      turning = std::max(turning, (player->output().torque - frame.torque).norm());
      peak = std::max(peak, frame.force.norm());
      turning_peak = std::max(turning_peak, frame.torque.norm());
    }
    player.reset();
    if (!frame.patch) continue;
    REQUIRE(check(*frame.patch) == PatchFault::none);
    REQUIRE(frame.patch->turn);
    CHECK(frame.patch->turn->angularDistance(pose(result.stamp).turn) < 1e-9);
    CHECK((frame.patch->tool - pose(result.stamp).position).norm() < 1e-12);
    CHECK((frame.patch->force - frame.force).norm() < 1e-12);
    contacts_most = std::max(contacts_most, 1 + frame.patch->others.own);
    player.emplace(*frame.patch, frame.terms);
    CHECK((player->output().force - frame.force).norm() < 1e-12);
    CHECK((player->output().torque - frame.torque).norm() < 1e-12);
  }
  CHECK(contacts_most == 3);
  REQUIRE(peak > 0.3);
  REQUIRE(turning_peak > 3e-3);
  CHECK(error < 0.15 * peak);
  CHECK(turning < 0.15 * turning_peak);
}

TEST_CASE(
    "The terms of a bar's patch have the triangle under each of its contacts, which stay where they are if the terms are lost") {
  Handled body(kBar);
  const ToolPose pressed(kMiddle - Vec3(0, 0, 0.006), about(Vec3::UnitY(), 0.05));
  FrameResult result;
  const Scheme scheme = GENERATE(Scheme::port, Scheme::hyper);
  for (int k = 0; k < 30; ++k) result = body.frame([&](Micros) { return pressed; }, scheme);
  const StationFrame& frame = result.stations.front();
  REQUIRE((frame.patch && frame.patch->has_terms && frame.terms.variables > 0 && frame.force.z() > 0.1));
  const PatchOthers& others = frame.patch->others;
  REQUIRE(others.own == 2);
  const Patch whole = extended(*frame.patch, frame.terms);
  const PlayedSurface surface(whole.surface, whole.modes(), StateInput::Zero(2 * whole.modes(), whole.modes()));
  for (const OtherContact& own : others.tools()) {
    CHECK(own.rows.isZero(0));
    // Above the surface by its push over the compliance of the whole body, of which the surface as it is has yielded.
    const Vec3 lowest = pressed.centre_of(own.sphere) - own.sphere.radius_m * own.normal;
    const double k = frame.patch->contact_stiffness_n_m, c = own.normal.dot(own.c_static * own.normal);
    const double push = -own.normal.dot(own.gap) / (c + 1 / k);
    const NearestPoint nearest = nearest_point(surface.view(), surface.positions(), lowest);
    CHECK((nearest.position - lowest).dot(own.normal) == Approx(push / k).margin(2e-5));
  }
  PatchPlayer lost(*frame.patch, {});
  const auto later = [&](Micros after, const Vec3& moved) {
    return lost.advance({frame.patch->stamp + after, pressed.position + moved, pressed.turn}).force;
  };
  CHECK((later(Micros{20'000}, Vec3::Zero()) - frame.force).norm() < 0.05 * frame.force.norm());
  CHECK(later(Micros{40'000}, Vec3(0, 0, -0.001)).z() > frame.force.z());
  CHECK(later(Micros{60'000}, Vec3(0, 0, 0.02)).isZero(0));
}

TEST_CASE(
    "A sphere that hangs above the body counts as a contact of the patch when the tool moves towards it, and takes no modes "
    "before") {
  const ToolShape post{{Vec3(0, 0, 0.003), 0.003}, {Vec3(0, 0, 0.02), 0.003}};
  Handled ball({post.front()}), tool(post);
  const Vec3 pressed = kMiddle - Vec3(0, 0, 0.006);
  const StationFrame alone = ball.held(pressed), held = tool.held(pressed);
  REQUIRE((alone.patch && held.patch));
  CHECK(held.patch->others.own == 0);
  CHECK(held.patch->modes() == alone.patch->modes());
  const Micros begin = tool.now;
  const FrameResult pushed =
      tool.frame([&](Micros t) { return ToolPose(pressed - Vec3(0, 0, 0.2 * std::max(0.0, seconds(t - begin) - 0.02))); });
  REQUIRE(pushed.stations.front().patch);
  CHECK(pushed.stations.front().patch->others.own == 1);
}

TEST_CASE("A tool's body is let go of as one, and touches again from outside") {
  Handled body(kBar);
  const Vec3 pressed = kMiddle - Vec3(0, 0, 0.006);
  const Vec3 lifted = kMiddle + Vec3(0, 0, 0.05);
  const auto move = [&body](const Vec3& from, const Vec3& to) {
    const Micros begin = body.now;
    for (int k = 0; k < 2; ++k)
      body.frame([&](Micros t) { return ToolPose(from + std::clamp(seconds(t - begin) / 0.1, 0.0, 1.0) * (to - from)); });
  };
  REQUIRE(body.held(pressed).contact);
  move(pressed, lifted);
  const StationFrame away = body.held(lifted, 10);
  CHECK_FALSE(away.contact);
  CHECK(away.force.norm() == 0);
  CHECK(away.torque.norm() == 0);
  move(lifted, pressed);
  CHECK(body.held(pressed).contact);
}

TEST_CASE("Force and torque of a tool that a reset takes off the body fade together, and so do those of its patches") {
  Handled body(kBar);
  const ToolPose tilted{kMiddle - Vec3(0, 0, 0.004), about(Vec3::UnitY(), 0.15)};
  const StationFrame before = body.held(tilted);
  REQUIRE(before.torque.norm() > 1e-3);
  double share_before = 1;
  for (int k = 0; k < 8; ++k) {
    const StationFrame frame = body.frame([&](Micros) { return tilted; }, Scheme::port, k == 0).stations.front();
    REQUIRE(frame.patch);
    REQUIRE(check(*frame.patch) == PatchFault::none);
    REQUIRE(frame.patch->turn);
    const double share = frame.patch->force.norm() / before.force.norm();
    CHECK((frame.patch->force - share * before.force).norm() < 1e-9);
    CHECK((frame.patch->torque - share * before.torque).norm() < 1e-9);
    CHECK(share <= share_before);
    share_before = share;
  }
  CHECK(share_before == 0);
}

TEST_CASE("A tool turns evenly between its samples, comes to rest after them, and no sample makes it spin faster than a hand") {
  const double quarter = std::numbers::pi / 2;
  ToolTrack track;
  track.add(std::vector<ToolSample>{{Micros{0}, Vec3::Zero(), about(Vec3::UnitZ(), 0)},
                                    {Micros{100'000}, Vec3::Zero(), about(Vec3::UnitZ(), quarter)}});
  const ToolSphere tip{Vec3(0.1, 0, 0), 0};
  for (const double share : {0.0, 0.25, 0.5, 0.9}) {
    const ToolAt at = track.turning(from_seconds(0.1 * share)).centre_of(tip);
    const double angle = share * quarter;
    CHECK((at.position - 0.1 * Vec3(std::cos(angle), std::sin(angle), 0)).norm() < 1e-12);
    if (share > 0) CHECK((at.velocity - 1.5707963267948966 * Vec3(-std::sin(angle), std::cos(angle), 0)).norm() < 1e-9);
  }
  const TurningTool end = track.turning(Micros{900'000});
  CHECK(end.spin.norm() == 0);
  CHECK(end.turn.angularDistance(about(Vec3::UnitZ(), quarter + quarter / 0.1 * kDeadReckoningS / 2)) < 1e-9);
  ToolTrack wild;
  for (int k = 0; k < 200; ++k)
    wild.add(std::vector<ToolSample>{{Micros{1000 * k}, Vec3::Zero(), about(Vec3::UnitX(), k % 2 == 0 ? 0.0 : 3.0)}});
  for (Micros t{1}; t < Micros{190'000}; t += Micros{777})
    CHECK(wild.turning(t).spin.norm() <= ToolTrack::kFastestRadS * (1 + 1e-9));
}

TEST_CASE("Samples that come late lead the tool's rotation back without a step") {
  ToolTrack track;
  track.add(std::vector<ToolSample>{{Micros{0}, Vec3::Zero(), about(Vec3::UnitX(), 0)},
                                    {Micros{10'000}, Vec3::Zero(), about(Vec3::UnitX(), 0.05)}},
            Micros{0});
  const Micros body{50'000};
  const Rotation before = track.turning(body).turn;
  const std::vector<ToolSample> late{{Micros{20'000}, Vec3::Zero(), about(Vec3::UnitX(), -0.02)},
                                     {Micros{400'000}, Vec3::Zero(), about(Vec3::UnitX(), -0.02)}};
  track.add(late, body);
  CHECK(track.turning(body).turn.angularDistance(before) < 1e-9);
  CHECK(track.turning(body + ToolTrack::kLeadBack).turn.angularDistance(about(Vec3::UnitX(), -0.02)) < 1e-9);
}

TEST_CASE("Jaws open evenly between samples, come to rest after them within their range, and late samples lead them back") {
  ToolTrack track;
  track.add(std::vector<ToolSample>{{Micros{0}, Vec3::Zero(), about(Vec3::UnitZ(), 0.3), 0.2},
                                    {Micros{100'000}, Vec3::Zero(), about(Vec3::UnitZ(), 0.3), 0.6}});
  const ToolSphere tip{Vec3(0.004, 0, 0.002), 0.002, 0.04, 0.5};
  const TurningTool middle = track.turning(Micros{25'000});
  CHECK(middle.opening == Approx(0.3));
  CHECK(middle.opens_1_s == Approx(4));
  const double step_s = 1e-3;
  const auto place = [&](double t_s) { return track.turning(from_seconds(t_s)).centre_of(tip).position; };
  const Vec3 velocity = (place(0.025 + step_s) - place(0.025 - step_s)) / (2 * step_s);
  CHECK((middle.centre_of(tip).velocity - velocity).norm() < 1e-4 * velocity.norm());
  const TurningTool end = track.turning(Micros{900'000});
  CHECK(end.opens_1_s == 0);
  CHECK(end.opening == Approx(0.6 + 4 * kDeadReckoningS / 2));
  const Micros body{150'000};
  const double before = track.turning(body).opening;
  track.add(std::vector<ToolSample>{{Micros{110'000}, Vec3::Zero(), about(Vec3::UnitZ(), 0.3), 0.1},
                                    {Micros{500'000}, Vec3::Zero(), about(Vec3::UnitZ(), 0.3), 0.1}},
            body);
  CHECK(track.turning(body).opening == Approx(before));
  CHECK(track.turning(body + ToolTrack::kLeadBack).opening == Approx(track.on_path(body + ToolTrack::kLeadBack).opening));
  ToolTrack wild;
  for (int k = 0; k < 200; ++k) wild.add(std::vector<ToolSample>{{Micros{1000 * k}, Vec3::Zero(), {}, k % 2 == 0 ? 0.0 : 1.0}});
  for (Micros t{1}; t < Micros{400'000}; t += Micros{777}) {
    CHECK(std::abs(wild.turning(t).opens_1_s) <= ToolTrack::kFastestOpening1S * (1 + 1e-9));
    CHECK((wild.turning(t).opening >= 0 && wild.turning(t).opening <= 1));
  }
}

TEST_CASE("A player whose jaws pinch a block's edge from both sides feels what the body does, the grip included") {
  const Scheme scheme = GENERATE(Scheme::port, Scheme::hyper);
  Handled body(edge_jaws());
  const Micros begin = body.now;
  const auto pose = [&](Micros t) {
    const double s = seconds(t - begin);
    return ToolPose(Vec3(0.03, 0.03, 0.042 + 0.002 * std::max(0.0, s - 1)), Rotation::Identity(),
                    std::max(0.1, 0.6 - 0.5 * s / 0.5));
  };
  std::optional<PatchPlayer> player;
  double error = 0, peak = 0, grip_error = 0, grip_peak = 0;
  int contacts_most = 0;
  for (int frame = 0; frame < 40; ++frame) {
    const FrameResult result = body.frame(pose, scheme);
    const StationFrame& felt = result.stations.front();
    if (player) {
      for (Micros t = player->time() + kTick; t <= result.stamp; t += kTick)
        player->advance({t, pose(t).position, pose(t).turn, pose(t).opening});
    }
    const std::optional<double> played = player ? std::optional(player->output().grip) : std::nullopt;
    if (player && frame > 15) error = std::max(error, (player->output().force - felt.force).norm());
    peak = std::max(peak, felt.force.norm());
    player.reset();
    if (!felt.patch) continue;
    REQUIRE(check(*felt.patch) == PatchFault::none);
    CHECK(felt.patch->opening == Approx(pose(result.stamp).opening).margin(1e-9));
    contacts_most = std::max(contacts_most, 1 + felt.patch->others.own);
    player.emplace(*felt.patch, felt.terms);
    CHECK((player->output().force - felt.force).norm() < 1e-9);
    const Micros next = result.stamp + kTick;  // the first step finds the grip of the patch's own contacts
    const double grip = PatchPlayer(*player).advance({next, pose(next).position, pose(next).turn, pose(next).opening}).grip;
    grip_peak = std::max(grip_peak, grip);
    if (played && frame > 15) grip_error = std::max(grip_error, std::abs(*played - grip));
  }
  CHECK(contacts_most == 4);
  REQUIRE(grip_peak > 0.02);
  CHECK(grip_error < 0.15 * grip_peak);
  CHECK(error < 0.15 * peak);
}

TEST_CASE("Jaws that held still close on in a player as in the body, as hard and as far") {
  const Scheme scheme = GENERATE(Scheme::port, Scheme::hyper);
  Handled body(edge_jaws());
  constexpr int kStillFrames = 40, kClosingFrames = 3;
  const Micros closes = body.now + kStillFrames * kBodyFrame;
  const auto pose = [&](Micros t) {
    return ToolPose(Vec3(0.03, 0.03, 0.042), Rotation::Identity(), std::clamp(0.25 - 1.5 * seconds(t - closes), 0.05, 0.25));
  };
  const auto advance = [&](PatchPlayer& player, Micros until) {
    PlayerOutput out = player.output();
    for (Micros t = player.time() + kTick; t <= until; t += kTick)
      out = player.advance({t, pose(t).position, pose(t).turn, pose(t).opening});
    return out;
  };
  FrameResult result;
  for (int k = 0; k < kStillFrames; ++k) result = body.frame(pose, scheme);
  REQUIRE((result.stations.front().patch && result.stations.front().patch->others.own == 3));
  PatchPlayer still(*result.stations.front().patch, result.stations.front().terms);
  const double before = advance(still, still.time() + kTick).grip;
  for (int k = 0; k < kClosingFrames; ++k) result = body.frame(pose, scheme);
  PatchPlayer there(*result.stations.front().patch, result.stations.front().terms);
  const double closed = advance(there, there.time() + kTick).grip;
  REQUIRE(closed > 1.5 * before);
  CHECK(advance(still, there.time()).grip - before == Approx(closed - before).epsilon(scheme == Scheme::hyper ? 0.02 : 0.15));
}

TEST_CASE("A tool that lies on two bodies feels the sum of what it feels on each alone, in the room and with a patch") {
  const auto block = [](double from_x_m, double young_pa) {
    return fmt::format(
        R"({{"name": "block at {}", "lattice": {{"nodes": [5, 5, 5], "size_m": [0.04, 0.04, 0.04], "origin_m": [{}, -0.02, 0], "fixed_faces": ["z-"],
                          "solid": {{"young_pa": {}, "poisson": 0.4, "damping_s": 0.01}}}}}})",
        from_x_m, from_x_m, young_pa);
  };
  const auto scene = [](const std::string& bodies) {
    return read_scene(R"({"bodies": [)" + bodies + R"(], "tool": {"contact": "touch", "mu": 0}})", "blocks");
  };
  const std::string soft = block(-0.05, 8000), firm = block(0.01, 16'000);
  const ToolSphere left{Vec3(-0.03, 0, 0.005), 0.005}, right{Vec3(0.03, 0, 0.005), 0.005};
  Handled both(scene(soft + "," + firm), {left, right}, 0), on_soft(scene(soft), {left}, 0), on_firm(scene(firm), {right}, 0);
  const Vec3 down(0, 0, 0.035);
  const ToolPose pressed(down, about(Vec3::UnitY(), 0.03));
  const auto touched = [&](Handled& handled) {
    handled.held(pressed);
    return handled.frame([&](Micros) { return pressed; }, Scheme::hyper).stations.front();
  };
  const StationFrame sum = touched(both), a = touched(on_soft), b = touched(on_firm);
  REQUIRE(a.force.z() > 0.1);
  REQUIRE(b.force.z() > 0.1);
  CHECK((sum.force - a.force - b.force).norm() < 1e-3 * sum.force.norm());
  CHECK((sum.torque - a.torque - b.torque).norm() < 1e-3 * sum.torque.norm());
  REQUIRE(sum.patch);
  CHECK(sum.patch->others.own == 1);
  PatchPlayer of_both(*sum.patch, sum.terms), of_a(*a.patch, a.terms), of_b(*b.patch, b.terms);
  for (int ms = 1; ms <= 100; ++ms) {
    const Vec3 deeper = down - Vec3(0, 0, 0.003 * std::min(ms / 60.0, 1.0));
    for (PatchPlayer* player : {&of_both, &of_a, &of_b}) player->advance({player->time() + kTick, deeper, pressed.turn});
    const PlayerOutput &s = of_both.output(), &x = of_a.output(), &y = of_b.output();
    CHECK((s.force - x.force - y.force).norm() < 0.05 * s.force.norm());
    CHECK((s.torque - x.torque - y.torque).norm() < 0.05 * s.torque.norm());
  }
  CHECK(of_both.output().force.z() > 1.2 * sum.force.z());
}
