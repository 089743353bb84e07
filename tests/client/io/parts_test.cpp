// The parts of the 1 kHz loop, each in its steady state, allocate, lock and throw nothing.
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <thread>

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

TEST_CASE("The recorder and the histograms take more than they have room for without allocation, lock or exception",
          "[realtime]") {
  palpate::Recorder recorder(1000, 3), unread(0, 3);
  palpate::Histogram<1000> histogram(10);
  RealtimeGuard guard;
  for (int i = 0; i < 1500; ++i) {
    const palpate::TickRecord tick{Micros{i}, Vec3::Zero(), {}, Micros{i}, true, false, 0};
    if (unread.begin(tick)) unread.end();
    if (recorder.begin(tick)) {
      for (std::size_t d = 0; d < 3; ++d) recorder.set(d, {Vec3(i, static_cast<double>(d), 0), d == 1});
      recorder.end();
    }
    histogram.add(i * 10);
  }
  CHECK(guard.end().none());
  CHECK(recorder.missed() == 500);
  CHECK(unread.missed() == 0);
  palpate::TickRecord tick;
  std::array<palpate::DisplayRecord, 3> row;
  for (int i = 0; i < 1000; ++i) {
    REQUIRE(recorder.take(tick, row));
    REQUIRE(tick.t == Micros{i});
    REQUIRE(row[2].wrench.force == Vec3(i, 2, 0));
    REQUIRE(row[1].contact);
  }
  CHECK_FALSE(recorder.take(tick, row));
  CHECK_FALSE(unread.take(tick, row));
}

TEST_CASE("Rows cross from one thread to the other whole, in order, round the ring many times", "[realtime]") {
  constexpr int kRows = 50'000;
  palpate::Recorder recorder(64, 2);
  std::thread writer([&recorder] {
    for (int i = 0; i < kRows; ++i) {
      while (!recorder.begin({Micros{i}, Vec3::Zero(), Vec3::Zero(), Micros{}, true, false, 0})) std::this_thread::yield();
      recorder.set(0, {Vec3::Constant(i), false});
      recorder.set(1, {Vec3::Constant(-i), true});
      recorder.end();
    }
  });
  palpate::TickRecord tick;
  std::array<palpate::DisplayRecord, 2> row;
  int wrong = 0;
  for (int i = 0; i < kRows; ++i) {
    while (!recorder.take(tick, row)) std::this_thread::yield();
    wrong += tick.t != Micros{i} || row[0].wrench.force != Vec3::Constant(i) || row[1].wrench.force != Vec3::Constant(-i);
  }
  writer.join();
  CHECK(wrong == 0);
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

TEST_CASE("A histogram counts the values below an edge, and all from its last bin on", "[realtime]") {
  palpate::Histogram<100> histogram(10);
  for (const int value : {0, 9, 10, 25, 999, 5000}) histogram.add(value);
  CHECK(histogram.below(0) == 0);
  CHECK(histogram.below(10) == 2);
  CHECK(histogram.below(20) == 3);
  CHECK(histogram.below(990) == 4);
  CHECK(histogram.below(1000) == 6);
}
