// A wound with a running stitch in a room: the hand closes it by the end of the thread; what scenes are refused.
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>

#include "common/base/error.hpp"
#include "common/patch/patch.hpp"
#include "common/player/player.hpp"
#include "server/record/resume.hpp"
#include "server/room/room.hpp"
#include "server/scene/cuts.hpp"
#include "tests/server/room/sewing_hand.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

Scene wound(const char* name = "wound") {
  return load_scene(std::filesystem::path(PALPATE_SOURCE_DIR) / "scenes/cuts" / (std::string(name) + ".json"));
}

constexpr double kBesideM = 0.01;  // from the wound to each bite

Vec3 place_of(const SutureBite& bite, const BodyState& state) {
  Vec3 x = Vec3::Zero();
  for (const auto& [node, weight] : bite.at) x += weight * at_node(state.x, node);
  return x;
}

/// Mean distance across the wound between bites of the left lip and of the right, beyond that at rest.
double gap_m(const Scene& scene, const BodyState& state) {
  const std::vector<SutureBite>& bites = scene.body.sutures[0].bites;
  double sum = 0;
  for (std::size_t j = 0; j < bites.size(); ++j) {
    const double y = place_of(bites[j], state).y();
    sum += (j % 2 == 0 ? -1 : 1) * y / (0.5 * static_cast<double>(bites.size()));
  }
  return sum - 2 * kBesideM;
}

}  // namespace

TEST_CASE("A hand that pulls the end of a running stitch closes the wound, and feels what the thread bears") {
  const Scene scene = wound();
  SewingHand sewing(scene);
  const Vec3 begin(0.05, 0.03, 0.1), way = Vec3(0.75, 0.25, 0.6).normalized();
  sewing.begin_at(begin);
  FrameResult open;
  for (int k = 0; k < 10; ++k) open = sewing.frame(begin);
  const double open_m = gap_m(scene, *open.state);
  CHECK(open.stations[0].force.norm() < 0.3);
  FrameResult closed;
  for (int k = 1; k <= 35; ++k) closed = sewing.frame(begin + 0.001 * k * way);
  for (int k = 0; k < 10; ++k) closed = sewing.frame(begin + 0.035 * way);
  const double closed_m = gap_m(scene, *closed.state);
  CAPTURE(open_m, closed_m, closed.stations[0].force);
  CHECK(open_m > 0.003);
  CHECK(closed_m < 0.3 * open_m);
  const auto thread = [](const FrameResult& result) {
    double sum = 0;
    for (const double length : result.state->sutures->threads[0].length_m) sum += length;
    return sum;
  };
  CHECK(thread(closed) == Approx(thread(open)).epsilon(1e-14));
  CHECK(closed.stations[0].contact);
  CHECK(closed.stations[0].force.norm() > 0.1);
  REQUIRE(closed.stations[0].patch);
  const Patch& patch = *closed.stations[0].patch;
  CHECK(check(patch) == PatchFault::none);
  CHECK(patch.suture.law.bites == 6);
  // The client continues from where the server is.
  PatchPlayer player(patch);
  CHECK((player.output().force - closed.stations[0].force).norm() < 1e-9);
  const PlayerOutput later = player.advance({patch.stamp + Micros{50'000}, patch.tool});
  CHECK((later.force - closed.stations[0].force).norm() < 0.05 * closed.stations[0].force.norm());
  // Vertices of the thread come after those of the body.
  CHECK(closed.positions.size() > scene.body.vertices());
}

namespace {

/// Distance of the two bites of a stitch across the wound, beyond that at rest.
double stitch_gap_m(const Scene& scene, const BodyState& state, std::size_t which) {
  const std::vector<SutureBite>& bites = scene.body.sutures[which].bites;
  return place_of(bites[1], state).y() - place_of(bites[0], state).y() - 2 * kBesideM;
}

/// Pulls the stitch whose end it takes, ties it, and goes to the next.
FrameResult sew(SewingHand& sewing, const Vec3& begin) {
  const Vec3 way = Vec3(0, 0.6, 0.8);
  FrameResult frame;
  for (int k = 0; k < 10; ++k) frame = sewing.frame(begin);
  REQUIRE(frame.stations[0].contact);
  for (int k = 1; k <= 22; ++k) frame = sewing.frame(begin + 0.001 * k * way);
  for (int k = 0; k < 4; ++k) frame = sewing.frame(begin + 0.022 * way);
  CHECK(frame.stations[0].force.norm() > 0.02);
  sewing.press();
  return sewing.frame(begin + 0.022 * way);
}

constexpr double kStitchX[] = {0, -0.02, 0.02};
Vec3 beside_stitch(std::size_t k) { return {kStitchX[k], 0.04, 0.085}; }

}  // namespace

TEST_CASE(
    "Three stitches that are tied one after another hold the wound without a hand, after a resume, and not once they are cut") {
  const Scene scene = wound("stitches");
  SewingHand sewing(scene);
  sewing.begin_at(beside_stitch(0));
  FrameResult open;
  for (int k = 0; k < 4; ++k) open = sewing.frame(beside_stitch(0));
  double force_n = 0, most_step_n = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const FrameResult tied = sew(sewing, beside_stitch(k));
    REQUIRE(tied.sutures.tied == std::vector{scene.body.sutures[k].name});
    CHECK(tied.state->sutures->threads[k].law.last_tied);
    force_n = tied.stations[0].force.norm();
    for (int m = 0; m < 8; ++m) {  // its force fades
      const FrameResult later = sewing.frame(beside_stitch(std::min<std::size_t>(k + 1, 2)));
      most_step_n = std::max(most_step_n, std::abs(later.stations[0].force.norm() - force_n));
      force_n = later.stations[0].force.norm();
    }
  }
  CHECK(most_step_n < 0.1);
  sewing.leave();
  const Vec3 away(0, 0.1, 0.2);
  sewing.begin_at(away);
  FrameResult held;
  for (int k = 0; k < 40; ++k) held = sewing.frame(away);
  CHECK_FALSE(held.stations[0].contact);
  CHECK(held.sutures.torn_m == 0);
  for (std::size_t k = 0; k < 3; ++k) {
    CAPTURE(k, stitch_gap_m(scene, *open.state, k), stitch_gap_m(scene, *held.state, k));
    CHECK(stitch_gap_m(scene, *held.state, k) < 0.35 * stitch_gap_m(scene, *open.state, k));
  }

  const std::vector<RecordedThread> recorded = recorded_threads(*held.state);
  const auto threads = threads_of(recorded, scene.body);
  REQUIRE(threads);
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(threads->threads[k].length_m == held.state->sutures->threads[k].length_m);
    CHECK(threads->threads[k].law.last_tied);
  }
  SewingHand other(scene);
  other.room().resume(held.state->x, held.state->v, {}, {}, threads);
  other.begin_at(away);
  FrameResult resumed;
  for (int k = 0; k < 20; ++k) resumed = other.frame(away);
  CHECK(stitch_gap_m(scene, *resumed.state, 1) == Approx(stitch_gap_m(scene, *held.state, 1)).margin(5e-5));

  const std::vector<SutureBite>& bites = scene.body.sutures[1].bites;
  const Vec3 middle = 0.5 * (place_of(bites[0], *resumed.state) + place_of(bites[1], *resumed.state));
  other.begin_at(middle + Vec3(0, 0, 0.002));
  for (int k = 0; k < 3; ++k) other.frame(middle + Vec3(0, 0, 0.002));
  other.press();
  const FrameResult cut = other.frame(middle + Vec3(0, 0, 0.002));
  REQUIRE(cut.sutures.cut == std::vector{scene.body.sutures[1].name});
  REQUIRE(cut.state->sutures->threads.size() == 4);
  double sum_m = 0;
  for (const std::size_t which : {std::size_t{1}, std::size_t{3}})
    for (const double length_m : cut.state->sutures->threads[which].length_m) sum_m += length_m;
  double whole_m = 0;
  for (const double length_m : threads->threads[1].length_m) whole_m += length_m;
  CHECK(sum_m == Approx(whole_m).epsilon(1e-12));
  other.leave();
  other.begin_at(away);
  FrameResult let_go;
  for (int k = 0; k < 30; ++k) let_go = other.frame(away);
  CHECK(stitch_gap_m(scene, *let_go.state, 1) > stitch_gap_m(scene, *resumed.state, 1) + 0.0005);
  CHECK(let_go.positions.size() == open.positions.size());
}

TEST_CASE("A thread that is pulled harder than its tissue bears cuts through it, and comes out") {
  const Scene scene = wound("stitches");
  SewingHand sewing(scene);
  const Vec3 begin = beside_stitch(0), way(0, 0.6, 0.8);
  sewing.begin_at(begin);
  std::uint32_t out = 0;
  double torn_m = 0, most_n = 0;
  FrameResult frame;
  for (int k = 0; k < 120 && out < 2; ++k) {
    frame = sewing.frame(begin + 0.001 * k * way);
    torn_m += frame.sutures.torn_m;
    out += frame.sutures.torn_out;
    most_n = std::max(most_n, frame.stations[0].force.norm());
  }
  CHECK(out >= 1);
  CHECK(torn_m > 0.003);
  CHECK(most_n < 2.2 * scene.body.sutures[0].law.tear_n);
  CHECK(frame.state->x.allFinite());
}

TEST_CASE("A bite between the walls of a cut is on the lip on whose side it is") {
  const Scene scene = wound();
  const std::vector<SutureBite>& bites = scene.body.sutures[0].bites;
  for (std::size_t j = 0; j < bites.size(); ++j) {
    double sum = 0;
    Vec3 at = Vec3::Zero();
    for (const auto& [node, weight] : bites[j].at) {
      sum += weight;
      at += weight * scene.body.nodes[node];
    }
    CHECK(sum == Approx(1).epsilon(1e-12));
    CHECK(std::abs(at.y()) == Approx(kBesideM).epsilon(1e-9));
    CHECK((at.y() > 0) == (j % 2 == 1));
  }
}

TEST_CASE("Threads that a scene cannot have are refused, with what and where") {
  const auto refusal = [](const std::string& sutures, const std::string& more = "", const std::string& body = "") -> std::string {
    const std::string scene = R"({"body": {"lattice": {"nodes": [5, 5, 4], "size_m": [0.08, 0.08, 0.06], "fixed_faces": ["z-"],
      "solid": {"young_pa": 10000}}, "sutures": [)" +
                              sutures + "]" + body + R"(}, "tool": {"contact": "touch")" + more + "}}";
    try {
      read_scene(scene, "scene");
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  const std::string two = R"("bites": [{"at_m": [0.02, 0.02, 0.05]}, {"at_m": [0.06, 0.02, 0.05]}])";
  CHECK(refusal(R"({"name": "a", )" + two + "}") == "");
  CHECK(refusal(R"({"name": "a", )" + two + "}", R"(, "holds": ["a"])") == "");
  CHECK(refusal("{" + two + "}").find("body.sutures[0].name") != std::string::npos);
  CHECK(refusal(R"({"name": "a", )" + two + R"(}, {"name": "a", )" + two + "}").find("as that of a suture before") !=
        std::string::npos);
  CHECK(refusal(R"({"name": "a", "bites": [{"at_m": [0.02, 0.02, 0.05]}]})").find("2 to 8") != std::string::npos);
  CHECK(refusal(R"({"name": "a", "bites": [{"at_m": [0.02, 0.02, 0.05]}, {"at_m": [0.2, 0.02, 0.05]}]})").find("bites[1].at_m") !=
        std::string::npos);
  CHECK(refusal(R"({"name": "a", "bites": [{"at_m": [0.02, 0.02, 0.05]}, {"at_m": [0.02, 0.02, 0]}]})").find("fixed") !=
        std::string::npos);
  CHECK(refusal(R"({"name": "a", "mu": 3, )" + two + "}").find("body.sutures[0].mu") != std::string::npos);
  CHECK(refusal(R"({"name": "a", )" + two + "}", R"(, "holds": ["b"])").find("tool.holds") != std::string::npos);
  CHECK(refusal(R"({"name": "a", "tied": "both", )" + two + "}", R"(, "holds": ["a"])").find("tied at its last bite") !=
        std::string::npos);
  // Threads on a needle have no bites yet, and others of its scene have.
  const std::string tissue = R"(, "tissue": [{"toughness_j_m2": 100}])", held = R"(, "holds": ["a"])";
  const std::string needle = R"(, "needle": {"length_m": 0.04, "diameter_m": 0.001})";
  const std::string blade = R"(, "blade": {"length_m": 0.04, "width_m": 0.01})";
  CHECK(refusal(R"({"name": "a"})", needle + held, tissue) == "");
  CHECK(refusal(R"({"name": "a"}, {"name": "b", )" + two + "}", needle + held, tissue) == "");
  CHECK(refusal(R"({"name": "a"})", held).find("2 to 8") != std::string::npos);
  CHECK(refusal(R"({"name": "a"})", needle, tissue).find("2 to 8") != std::string::npos);
  CHECK(refusal(R"({"name": "a", )" + two + "}", needle + held, tissue).find("on a needle") != std::string::npos);
  CHECK(refusal(R"({"name": "a", "tied": "last"})", needle + held, tissue).find("tied at its last bite") != std::string::npos);
  CHECK(refusal(R"({"name": "a", )" + two + "}", blade, tissue).find("blade") != std::string::npos);
}
