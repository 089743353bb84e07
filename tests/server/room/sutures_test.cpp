// A wound with a running stitch in a room: the hand closes it by the end of the thread; what scenes are refused.
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>

#include "common/base/error.hpp"
#include "common/patch/patch.hpp"
#include "common/player/player.hpp"
#include "server/room/room.hpp"
#include "server/scene/cuts.hpp"

using namespace palpate;

namespace {

Scene wound() { return load_scene(std::filesystem::path(PALPATE_SOURCE_DIR) / "scenes/cuts/wound.json"); }

constexpr Micros kFrame{50'000};
constexpr double kBesideM = 0.01;  // from the wound to each bite

/// A hand that goes along a line, in a room.
class Sewing {
 public:
  explicit Sewing(const Scene& scene) : scene_(scene), room_(scene) { room_.start(Micros{}); }
  /// Runs a frame, and returns it.
  FrameResult frame(const Vec3& to) {
    StationJob station;
    station.id = 1;
    station.horizon = Micros{100'000};
    for (Micros t = now_ + Micros{1000}; t <= now_ + kFrame; t += Micros{1000}) {
      const double part = static_cast<double>((t - now_).count()) / static_cast<double>(kFrame.count());
      station.samples.push_back({t, at_ + part * (to - at_)});
    }
    at_ = to;
    FrameJob job;
    job.begin = now_;
    job.target = now_ += kFrame;
    job.frame = kFrame;
    job.stations = {station};
    job.shapes = job.state = true;
    return room_.run(job);
  }
  void begin_at(const Vec3& at) { at_ = at; }

 private:
  Scene scene_;
  Room room_;
  Micros now_{};
  Vec3 at_ = Vec3::Zero();
};

/// Mean distance across the wound between bites of the left lip and of the right, beyond that at rest.
double gap_m(const Scene& scene, const BodyState& state) {
  const std::vector<NodeWeights>& bites = scene.body.sutures[0].bites;
  double sum = 0;
  for (std::size_t j = 0; j < bites.size(); ++j) {
    double y = 0;
    for (const auto& [node, weight] : bites[j]) y += weight * at_node(state.x, node).y();
    sum += (j % 2 == 0 ? -1 : 1) * y / (0.5 * static_cast<double>(bites.size()));
  }
  return sum - 2 * kBesideM;
}

}  // namespace

TEST_CASE("A hand that pulls the end of a running stitch closes the wound, and feels what the thread bears") {
  const Scene scene = wound();
  Sewing sewing(scene);
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

TEST_CASE("A bite between the walls of a cut is on the lip on whose side it is") {
  const Scene scene = wound();
  const std::vector<NodeWeights>& bites = scene.body.sutures[0].bites;
  for (std::size_t j = 0; j < bites.size(); ++j) {
    double sum = 0;
    Vec3 at = Vec3::Zero();
    for (const auto& [node, weight] : bites[j]) {
      sum += weight;
      at += weight * scene.body.nodes[node];
    }
    CHECK(sum == Approx(1).epsilon(1e-12));
    CHECK(std::abs(at.y()) == Approx(kBesideM).epsilon(1e-9));
    CHECK((at.y() > 0) == (j % 2 == 1));
  }
}

TEST_CASE("Threads that a scene cannot have are refused, with what and where") {
  const auto refusal = [](const std::string& sutures, const std::string& more = "") -> std::string {
    const std::string scene = R"({"body": {"lattice": {"nodes": [5, 5, 4], "size_m": [0.08, 0.08, 0.06], "fixed_faces": ["z-"],
      "solid": {"young_pa": 10000}}, "sutures": [)" +
                              sutures + R"(]}, "tool": {"contact": "touch")" + more + "}}";
    try {
      read_scene(scene, "scene");
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  const std::string two = R"("bites": [{"at_m": [0.02, 0.02, 0.05]}, {"at_m": [0.06, 0.02, 0.05]}])";
  CHECK(refusal(R"({"name": "a", )" + two + "}") == "");
  CHECK(refusal(R"({"name": "a", )" + two + "}", R"(, "holds": "a")") == "");
  CHECK(refusal("{" + two + "}").find("body.sutures[0].name") != std::string::npos);
  CHECK(refusal(R"({"name": "a", )" + two + R"(}, {"name": "a", )" + two + "}").find("as that of a suture before") !=
        std::string::npos);
  CHECK(refusal(R"({"name": "a", "bites": [{"at_m": [0.02, 0.02, 0.05]}]})").find("2 to 8") != std::string::npos);
  CHECK(refusal(R"({"name": "a", "bites": [{"at_m": [0.02, 0.02, 0.05]}, {"at_m": [0.2, 0.02, 0.05]}]})").find("bites[1].at_m") !=
        std::string::npos);
  CHECK(refusal(R"({"name": "a", "bites": [{"at_m": [0.02, 0.02, 0.05]}, {"at_m": [0.02, 0.02, 0]}]})").find("fixed") !=
        std::string::npos);
  CHECK(refusal(R"({"name": "a", "mu": 3, )" + two + "}").find("body.sutures[0].mu") != std::string::npos);
  CHECK(refusal(R"({"name": "a", )" + two + "}", R"(, "holds": "b")").find("tool.holds") != std::string::npos);
  CHECK(refusal(R"({"name": "a", "tied": "both", )" + two + "}", R"(, "holds": "a")").find("tied at its last bite") !=
        std::string::npos);
}
