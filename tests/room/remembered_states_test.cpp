// What a room remembers of its body, and what its patches make of it.
#include "server/room/remembered_states.hpp"

#include <Eigen/QR>
#include <catch2/catch.hpp>

#include "server/room/room.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr double kEdgeM = 0.01, kFar = 2 * RememberedStates::kApart * kEdgeM;
const std::vector<Vec3> kHere{Vec3(0.05, 0.02, 0.06)};

Vector moved(double x, Eigen::Index coordinate = 0) {
  Vector state = Vector::Zero(12);
  state[coordinate] = x;
  return state;
}

}  // namespace

TEST_CASE("A state is kept when it differs from all that are kept, by a tenth of an edge somewhere") {
  RememberedStates states(kEdgeM);
  states.keep(kHere, moved(0));
  states.keep(kHere, moved(0.9 * RememberedStates::kApart * kEdgeM, 7));
  CHECK(states.size() == 1);
  states.keep(kHere, moved(1.1 * RememberedStates::kApart * kEdgeM, 7));
  CHECK(states.size() == 2);
  states.clear();
  CHECK(states.size() == 0);
  CHECK(states.telling(kHere, moved(0)).empty());
}

TEST_CASE("Only states that had a tool within an edge of one that asks are told, and none that is as the body is") {
  RememberedStates states(kEdgeM);
  const std::vector<Vec3> beside{kHere[0] + Vec3(0, 0.9 * kEdgeM, 0)}, away{kHere[0] + Vec3(0, 1.1 * kEdgeM, 0)};
  states.keep(std::vector<Vec3>{Vec3(1, 1, 1), kHere[0]}, moved(kFar));
  CHECK(states.telling(beside, moved(0)).size() == 1);
  CHECK(states.telling(away, moved(0)).empty());
  CHECK(states.telling(kHere, moved(kFar)).empty());
}

TEST_CASE("The states that are told are the pivots of a QR decomposition of the ways to them") {
  RememberedStates states(kEdgeM);
  Random random(3);
  const Eigen::Index n = 40, count = 20;
  const Vector now = 0.05 * Vector::Ones(n);
  Matrix ways(n, count);
  std::vector<Vector> kept;
  for (Eigen::Index k = 0; k < count; ++k) {
    for (Eigen::Index i = 0; i < n; ++i) ways(i, k) = 0.004 * random.uniform(-1, 1);
    kept.emplace_back(now + ways.col(k));
    states.keep(kHere, kept.back());
  }
  REQUIRE(states.size() == count);
  const auto pivots = Eigen::ColPivHouseholderQR<Matrix>(ways).colsPermutation().indices();
  const std::vector<const Vector*> told = states.telling(kHere, now);
  REQUIRE(told.size() == RememberedStates::kTold);
  for (std::size_t k = 0; k < told.size(); ++k)
    CHECK(*told[k] == kept[static_cast<std::size_t>(pivots[static_cast<Eigen::Index>(k)])]);
}

TEST_CASE("What others span is not told") {
  RememberedStates states(kEdgeM);
  for (const double x : {3.0, -2.0, 1.0}) states.keep(kHere, x * kFar * Vector::Ones(12));
  states.keep(kHere, moved(kFar, 5));
  REQUIRE(states.size() == 4);
  const std::vector<const Vector*> told = states.telling(kHere, Vector::Zero(12));
  REQUIRE(told.size() == 2);
  CHECK(*told[0] == 3 * kFar * Vector::Ones(12));
  CHECK(*told[1] == moved(kFar, 5));
}

TEST_CASE("When a new state comes to a full memory, the one goes that was of no use for longest") {
  RememberedStates states(kEdgeM);
  const auto place = [](std::size_t k) { return std::vector<Vec3>{Vec3(static_cast<double>(k), 0, 0)}; };
  const auto state = [](std::size_t k) { return moved(static_cast<double>(k + 1) * kFar); };
  for (std::size_t k = 0; k < RememberedStates::kMost; ++k) states.keep(place(k), state(k));
  for (std::size_t k = 0; k < RememberedStates::kMost; ++k)
    if (k != 5) states.telling(place(k), moved(0));
  states.keep(place(100), state(100));
  CHECK(states.size() == RememberedStates::kMost);
  CHECK(states.telling(place(5), moved(0)).empty());
  for (const std::size_t k : {std::size_t{0}, std::size_t{4}, std::size_t{6}, RememberedStates::kMost - 1, std::size_t{100}})
    CHECK(states.telling(place(k), moved(0)).size() == 1);
}

namespace {

constexpr StationId kRememberedHand = 3;

/// A hand over a bed, with patches of scheme hyper.
struct Bed {
  bool sleep;
  Room room;
  Micros now{7'000'000};

  explicit Bed(bool may_sleep) : sleep(may_sleep), room(box_scene(ContactKind::touch)) { room.start(now); }

  /// The body and its patch with the tool at this height for so many frames, in which it gets to `beside_m`.
  Room::Origin frames(double height_m, int count, double beside_m = 0) {
    const Micros begin = now;
    const double over_s = 0.05 * count;
    for (int k = 0; k < count; ++k) {
      FrameJob job;
      job.begin = now;
      job.target = now + Micros{50'000};
      job.may_sleep = sleep;
      StationJob station;
      station.id = kRememberedHand;
      station.scheme = Scheme::hyper;
      station.bridge = Micros{100'000};
      for (Micros t = now + Micros{1000}; t <= job.target + Micros{1000}; t += Micros{1000})
        station.samples.push_back(
            {t, Vec3(0.031, 0.028 + beside_m * std::min(seconds(t - begin) / over_s, 1.0), 3 * kSpacingM + height_m)});
      job.stations.push_back(station);
      now = job.target;
      room.run(job);
    }
    return *room.origin(kRememberedHand);
  }
};

/// Of the way from where a patch was made to `x`, the part that its modes leave out; all nodes of the bed weigh the same.
double left_out(const Room::Origin& at, const Vector& x) {
  const Vector way = x - at.body.x;
  const Eigen::ColPivHouseholderQR<Matrix> qr(at.modes);
  return (way - at.modes * qr.solve(way)).norm() / way.norm();
}

}  // namespace

TEST_CASE("A hand that comes to a body at rest has a patch that knows where a press will take the body") {
  Bed asleep(true), awake(false), pressed(true);
  const Room::Origin rehearsed = asleep.frames(0.005, 3), unprepared = awake.frames(0.005, 3);
  for (const double depth_m : {0.004, 0.008}) {
    const Vector x = pressed.frames(-depth_m, 10).body.x;
    CHECK(left_out(rehearsed, x) < 0.5 * left_out(unprepared, x));
  }
}

TEST_CASE("Where a tool dragged the body along before, later patches know where it was") {
  Bed before(true), anew(true);
  before.frames(-0.008, 10);
  const Vector x = before.frames(-0.008, 10, 0.012).body.x;
  const Room::Origin remembers = before.frames(0.005, 60), fresh = anew.frames(0.005, 3);
  CHECK(left_out(remembers, x) < 0.01 * left_out(fresh, x));
}
