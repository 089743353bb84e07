// Every part of every piece of work is done once, however late a thread comes.
#include "common/io/spinning_thread_pool.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>

using namespace palpate;

TEST_CASE("A thread pool does every part of each piece of work once, and all of it before it says so") {
  for (const std::size_t size : {1, 2, 3, 5}) {
    SpinningThreadPool pool(size);
    REQUIRE(pool.size() == size);
    std::vector<int> done;
    const std::function<void(std::size_t)> work = [&](std::size_t part) { ++done[part]; };
    for (std::size_t piece = 0; piece < 3000; ++piece) {
      done.assign(1 + piece % 9, 0);
      pool.run(done.size(), work);
      REQUIRE(std::all_of(done.begin(), done.end(), [](int times) { return times == 1; }));
    }
  }
}

TEST_CASE("A thread pool that slept goes on with the next piece of work") {
  SpinningThreadPool pool(3);
  std::atomic<int> done = 0;
  for (int k = 0; k < 5; ++k) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));  // longer than its threads spin
    pool.run(4, [&](std::size_t) { ++done; });
  }
  CHECK(done == 20);
}
