// When a client gives up an address, and which one it tries next.
#include "client/io/server_finder.hpp"

#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <thread>
#include <utility>
#include <vector>

using namespace palpate;
using namespace std::chrono_literals;

namespace {

const UdpEndpoint kOld(asio::ip::make_address("10.0.0.1"), 1), kNew(asio::ip::make_address("10.0.0.2"), 2);

/// Polls until the lookup's thread has answered; `now` stands still meanwhile.
std::optional<UdpEndpoint> moved(ServerFinder& finder, Micros now, Micros answered, bool sent_away = false) {
  for (int k = 0; k < 10'000; ++k) {
    if (const auto server = finder.move(now, answered, sent_away)) return server;
    std::this_thread::sleep_for(1ms);
  }
  return std::nullopt;
}

}  // namespace

TEST_CASE("while somebody answers nothing is asked, and after three seconds of silence the new address counts") {
  std::atomic<int> asked = 0;
  const auto ask = [&](const std::string& name) {
    asked += name == "name";
    return kNew;
  };
  ServerFinder finder("name", kOld, ask, 0s);
  for (Micros now{}; now < 60s; now += 100ms) CHECK_FALSE(finder.move(now, now - 1s, false));
  CHECK(asked == 0);
  CHECK_FALSE(finder.move(62'400ms, 60s, false));
  CHECK(moved(finder, 63s, 60s) == kNew);
  CHECK(asked == 1);
  CHECK_FALSE(finder.move(65s, 60s, false));
  CHECK(moved(finder, 66s, 60s) == kNew);  // and again, from another port
  CHECK(asked == 2);
}

TEST_CASE("where nobody answers ports change ever later, the name is asked for all the time, and a new address counts at once") {
  std::atomic<int> asked = 0;
  std::atomic<bool> has_moved = false;
  const auto ask = [&](const std::string&) { return ++asked, has_moved ? kNew : kOld; };
  ServerFinder finder("name", kOld, ask, 0s);
  std::vector<std::pair<double, UdpEndpoint>> moves;
  const auto run = [&](Micros from, Micros until) {
    for (Micros now = from; now < until; now += 100ms) {
      std::this_thread::sleep_for(1ms);
      if (const auto to = finder.move(now, 0s, false)) moves.emplace_back(std::chrono::duration<double>(now).count(), *to);
    }
  };
  run(0s, 98s);
  REQUIRE(moves.size() >= 5);
  double before_s = 0;
  for (std::size_t k = 0; k < 5; ++k) {
    const double after_s = std::min(3.0 * (1 << k), 24.0);
    CAPTURE(k);
    CHECK(moves[k].second == kOld);
    CHECK(moves[k].first - before_s > after_s - 0.05);
    CHECK(moves[k].first - before_s < after_s + 3.2);  // a slow resolver thread delays the move by up to this
    before_s = moves[k].first;
  }
  CHECK(asked >= 12);
  has_moved = true;
  run(98s, 112s);
  CHECK(moves.back().second == kNew);
  CHECK_FALSE(finder.move(112s, 112s, false));  // after an answer, the next silence begins with 3 s again
  CHECK_FALSE(finder.move(114s, 112s, false));
  CHECK(moved(finder, 115s, 112s) == kNew);
}

TEST_CASE("a name that is gone leaves the client where it was, with another port") {
  ServerFinder finder(
      "name", kOld, [](const std::string&) -> UdpEndpoint { throw InputError("name", "is gone", "a host"); }, 0s);
  CHECK(moved(finder, 3s, 0s) == kOld);
}

TEST_CASE("a resolver that hangs is waited for no longer than another three seconds") {
  std::promise<void> go_on;
  ServerFinder finder(
      "name", kOld, [wait = go_on.get_future().share()](const std::string&) { return wait.wait(), kNew; }, 0s);
  CHECK_FALSE(finder.move(3s, 0s, false));
  CHECK_FALSE(finder.move(5'999ms, 0s, false));
  CHECK(finder.move(6s, 0s, false) == kOld);
  go_on.set_value();
  CHECK(moved(finder, 9s, 0s) == kNew);
}

TEST_CASE("who is sent away by a server that shuts down asks at once") {
  ServerFinder finder(
      "name", kOld, [](const std::string&) { return kNew; }, 0s);
  CHECK_FALSE(finder.move(100s, 100s, false));
  CHECK(moved(finder, 100s, 100s, true) == kNew);
  CHECK_FALSE(finder.move(101s, 101s, true));
}
