// Body states that a room keeps, and their effect on its patches.
#include "server/room/snapshot_cache.hpp"

#include <Eigen/QR>
#include <catch2/catch.hpp>

#include "server/room/room.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr double kEdgeM = 0.01, kFar = 2 * SnapshotCache::kDifferenceEdges * kEdgeM;
const std::vector<Vec3> kHere{Vec3(0.05, 0.02, 0.06)};

Vector moved(double x, Eigen::Index coordinate = 0) {
  Vector state = Vector::Zero(12);
  state[coordinate] = x;
  return state;
}

}  // namespace

TEST_CASE("A state is kept when it differs from all that are kept, by a tenth of an edge somewhere") {
  SnapshotCache states(kEdgeM);
  states.keep(kHere, moved(0));
  states.keep(kHere, moved(0.9 * SnapshotCache::kDifferenceEdges * kEdgeM, 7));
  CHECK(states.size() == 1);
  states.keep(kHere, moved(1.1 * SnapshotCache::kDifferenceEdges * kEdgeM, 7));
  CHECK(states.size() == 2);
  states.clear();
  CHECK(states.size() == 0);
  CHECK(states.most_informative(kHere, moved(0)).empty());
}

TEST_CASE("Only states that had a tool within an edge of one that asks are chosen, and none that is as the body is") {
  SnapshotCache states(kEdgeM);
  const std::vector<Vec3> beside{kHere[0] + Vec3(0, 0.9 * kEdgeM, 0)}, away{kHere[0] + Vec3(0, 1.1 * kEdgeM, 0)};
  states.keep(std::vector<Vec3>{Vec3(1, 1, 1), kHere[0]}, moved(kFar));
  CHECK(states.most_informative(beside, moved(0)).size() == 1);
  CHECK(states.most_informative(away, moved(0)).empty());
  CHECK(states.most_informative(kHere, moved(kFar)).empty());
}

TEST_CASE("The states that are chosen are the pivots of a QR decomposition of the displacements to them") {
  SnapshotCache states(kEdgeM);
  Random random(3);
  const Eigen::Index n = 40, count = 20;
  const Vector now = 0.05 * Vector::Ones(n);
  Matrix displacements(n, count);
  std::vector<Vector> kept;
  for (Eigen::Index k = 0; k < count; ++k) {
    for (Eigen::Index i = 0; i < n; ++i) displacements(i, k) = 0.004 * random.uniform(-1, 1);
    kept.emplace_back(now + displacements.col(k));
    states.keep(kHere, kept.back());
  }
  REQUIRE(states.size() == count);
  const auto pivots = Eigen::ColPivHouseholderQR<Matrix>(displacements).colsPermutation().indices();
  const std::vector<const Vector*> chosen = states.most_informative(kHere, now);
  REQUIRE(chosen.size() == SnapshotCache::kChosenMax);
  for (std::size_t k = 0; k < chosen.size(); ++k)
    CHECK(*chosen[k] == kept[static_cast<std::size_t>(pivots[static_cast<Eigen::Index>(k)])]);
}

TEST_CASE("What others span is not chosen") {
  SnapshotCache states(kEdgeM);
  for (const double x : {3.0, -2.0, 1.0}) states.keep(kHere, x * kFar * Vector::Ones(12));
  states.keep(kHere, moved(kFar, 5));
  REQUIRE(states.size() == 4);
  const std::vector<const Vector*> chosen = states.most_informative(kHere, Vector::Zero(12));
  REQUIRE(chosen.size() == 2);
  CHECK(*chosen[0] == 3 * kFar * Vector::Ones(12));
  CHECK(*chosen[1] == moved(kFar, 5));
}

TEST_CASE("When a new state comes to a full cache, the one goes that was of no use for longest") {
  SnapshotCache states(kEdgeM);
  const auto place = [](std::size_t k) { return std::vector<Vec3>{Vec3(static_cast<double>(k), 0, 0)}; };
  const auto state = [](std::size_t k) { return moved(static_cast<double>(k + 1) * kFar); };
  for (std::size_t k = 0; k < SnapshotCache::kStatesMax; ++k) states.keep(place(k), state(k));
  for (std::size_t k = 0; k < SnapshotCache::kStatesMax; ++k)
    if (k != 5) states.most_informative(place(k), moved(0));
  states.keep(place(100), state(100));
  CHECK(states.size() == SnapshotCache::kStatesMax);
  CHECK(states.most_informative(place(5), moved(0)).empty());
  for (const std::size_t k : {std::size_t{0}, std::size_t{4}, std::size_t{6}, SnapshotCache::kStatesMax - 1, std::size_t{100}})
    CHECK(states.most_informative(place(k), moved(0)).size() == 1);
}

namespace {

constexpr StationId kCacheHand = 3;

/// A hand over a bed, with patches of scheme hyper.
struct Bed {
  bool sleep;
  Room room;
  Micros now{7'000'000};

  explicit Bed(bool may_sleep) : sleep(may_sleep), room(box_scene(ContactKind::touch)) { room.start(now); }

  /// Runs `count` frames with the tool at this height, in which it moves to `beside_m`; returns the body and its patch.
  Room::Origin frames(double height_m, int count, double beside_m = 0) {
    const Micros begin = now;
    const double over_s = 0.05 * count;
    for (int k = 0; k < count; ++k) {
      FrameJob job;
      job.begin = now;
      job.target = now + Micros{50'000};
      job.may_sleep = sleep;
      StationJob station;
      station.id = kCacheHand;
      station.scheme = Scheme::hyper;
      station.horizon = Micros{100'000};
      for (Micros t = now + Micros{1000}; t <= job.target + Micros{1000}; t += Micros{1000})
        station.samples.push_back(
            {t, Vec3(0.031, 0.028 + beside_m * std::min(seconds(t - begin) / over_s, 1.0), 3 * kSpacingM + height_m)});
      job.stations.push_back(station);
      now = job.target;
      room.run(job);
    }
    return *room.origin(kCacheHand);
  }
};

/// Share of the displacement from the patch's origin to `x` that its modes omit; all nodes of the bed have the same mass.
double left_out(const Room::Origin& at, const Vector& x) {
  const Vector displacement = x - at.body.x;
  const Eigen::ColPivHouseholderQR<Matrix> qr(at.modes);
  return (displacement - at.modes * qr.solve(displacement)).norm() / displacement.norm();
}

}  // namespace

TEST_CASE("A hand that comes to a body at rest has a patch that knows where a press will take the body") {
  Bed asleep(true), awake(false), pressed(true);
  const Room::Origin warm_started = asleep.frames(0.005, 3), unprepared = awake.frames(0.005, 3);
  for (const double depth_m : {0.004, 0.008}) {
    const Vector x = pressed.frames(-depth_m, 10).body.x;
    CHECK(left_out(warm_started, x) < 0.5 * left_out(unprepared, x));
  }
}

TEST_CASE("Where a tool dragged the body along before, later patches know where it was") {
  Bed before(true), anew(true);
  before.frames(-0.008, 10);
  const Vector x = before.frames(-0.008, 10, 0.012).body.x;
  const Room::Origin with_cache = before.frames(0.005, 60), fresh = anew.frames(0.005, 3);
  CHECK(left_out(with_cache, x) < 0.01 * left_out(fresh, x));
}
