#include "server/core/handshakes.hpp"

#include <catch2/catch.hpp>

using namespace palpate;
using namespace std::chrono_literals;

namespace {

Handshake handshake(StationId id, PeerId peer, const std::string& name = "hand") {
  return {id, 1000 + id, peer, Hello{name, Role::haptic, Scheme::port, 0, ""}, name, 1s, {}, 1s};
}

}  // namespace

TEST_CASE("a handshake is proven by its number, its secret and its sender together, for three seconds") {
  Handshakes handshakes;
  handshakes.begin(handshake(5, 7));
  CHECK(handshakes.proven(5, 1005, 7, 2s));
  CHECK(handshakes.proven(5, 1005, 7, 4s));
  CHECK_FALSE(handshakes.proven(5, 1005, 7, 4s + 1us));
  CHECK_FALSE(handshakes.proven(5, 1006, 7, 2s));
  CHECK_FALSE(handshakes.proven(6, 1005, 7, 2s));
  CHECK_FALSE(handshakes.proven(5, 1005, 8, 2s));
  CHECK_FALSE(handshakes.proven(0, 0, 0, 2s));
}

TEST_CASE("the same Hello from the same sender began once, and another one from there takes nothing from it") {
  Handshakes handshakes;
  const Handshake first = handshakes.begin(handshake(1, 7)), other = handshakes.begin(handshake(2, 7, "forged"));
  REQUIRE(handshakes.begun(7, other.hello, 2s));
  CHECK(handshakes.begun(7, other.hello, 2s)->id == 2);
  CHECK_FALSE(handshakes.begun(7, first.hello, 2s));
  CHECK(handshakes.proven(1, 1001, 7, 2s));
  CHECK_FALSE(handshakes.begun(8, other.hello, 2s));
}

TEST_CASE("however many senders say Hello, the newest are kept, and no more than there is room for") {
  Handshakes handshakes;
  const auto many = static_cast<StationId>(3 * Handshakes::kMost);
  for (StationId id = 1; id <= many; ++id) handshakes.begin(handshake(id, id));
  CHECK(handshakes.size() == Handshakes::kMost);
  CHECK(handshakes.proven(many, 1000 + many, many, 2s));
  const StationId oldest = many - Handshakes::kMost + 1;
  CHECK(handshakes.proven(oldest, 1000 + oldest, oldest, 2s));
  CHECK_FALSE(handshakes.proven(oldest - 1, 999 + oldest, oldest - 1, 2s));
  CHECK_FALSE(handshakes.begun(oldest - 1, handshake(1, 1).hello, 2s));
}
