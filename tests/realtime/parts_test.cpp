// The parts of the 1 kHz loop, each in its steady state, allocate, lock and throw nothing.
#include <catch2/catch.hpp>
#include <cmath>

#include "client/device/replay_device.hpp"
#include "client/device/sim_phantom.hpp"
#include "client/guard/guard.hpp"
#include "client/io/histogram.hpp"
#include "client/io/recorder.hpp"
#include "tests/support/realtime_guard.hpp"

using palpate::Micros;
using palpate::Motion;
using palpate::Vec3;
using palpate::test::RealtimeGuard;

namespace {
Motion sway() {
  std::vector<palpate::MotionPoint> points;
  for (int i = 0; i <= 2000; ++i) points.push_back({i * 1e-3, Vec3(0.01 * std::sin(i * 0.01), 0, 0)});
  return Motion(std::move(points));
}
}  // namespace

TEST_CASE("A simulated Phantom is read and written without allocation, lock or exception", "[realtime]") {
  palpate::SimPhantom device(sway(), {});
  palpate::Device& seen_as = device;
  RealtimeGuard guard;
  for (int ms = 0; ms < 3000; ++ms) {
    const Vec3 position = seen_as.read(Micros{ms * 1000}).position;
    seen_as.write(-200 * position);
  }
  seen_as.stop();
  CHECK(guard.end().none());
}

TEST_CASE("A replayed motion is read past its end without allocation, lock or exception", "[realtime]") {
  palpate::ReplayDevice device(sway());
  RealtimeGuard guard;
  for (int ms = 0; ms < 3000; ++ms) {
    device.read(Micros{ms * 1000});
    device.write(Vec3::Ones());
  }
  CHECK(guard.end().none());
}

TEST_CASE("The guard passes good, bad, large and active forces without allocation, lock or exception", "[realtime]") {
  palpate::Guard limiter({8.5, 2000, palpate::PassivityMode::on});
  const double bad = std::nan("");
  RealtimeGuard guard;
  for (int i = 0; i < 3000; ++i) {
    const Vec3 at(0.01 * std::sin(i * 0.05), 0, 0);
    limiter.pass(i % 100 == 7 ? Vec3(bad, 0, 0) : Vec3(20 * std::cos(i * 0.05), 0, i % 3), at, 1e-3);
  }
  const auto seen = guard.end();
  CHECK(seen.none());
  CHECK(limiter.counts().damped > 0);
  CHECK(limiter.counts().not_finite > 0);
}

TEST_CASE("The recorder and the histograms take a full run and more without allocation, lock or exception", "[realtime]") {
  palpate::Recorder recorder(1000, 3);
  palpate::Histogram<1000> histogram(10);
  RealtimeGuard guard;
  for (int i = 0; i < 1500; ++i) {
    if (recorder.begin({Micros{i}, Vec3::Zero(), Micros{i}, true}))
      for (std::size_t d = 0; d < 3; ++d) recorder.set(d, {Vec3(i, static_cast<double>(d), 0), d == 1});
    histogram.add(i * 10);
  }
  CHECK(guard.end().none());
  CHECK(recorder.size() == 1000);
  CHECK(recorder.missed() == 500);
  CHECK(recorder.row(999)[2].force == Vec3(999, 2, 0));
  CHECK(recorder.row(500)[1].contact);
}

TEST_CASE("A histogram's percentiles bound the share of values below them", "[realtime]") {
  palpate::Histogram<100> histogram(10);
  CHECK(histogram.percentile(0.5) == 0);
  for (int i = 0; i < 1000; ++i) histogram.add(i);
  CHECK(histogram.percentile(0.5) == 510);
  CHECK(histogram.percentile(0.99) == 999);
  histogram.add(1'000'000);
  histogram.add(-5);
  CHECK(histogram.max() == 1'000'000);
  CHECK(histogram.percentile(0.0) == 10);
  CHECK(histogram.percentile(1.0) == 1'000'000);
}
