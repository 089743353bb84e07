// Iterations that the steps with contact of a frame may take.
#include <catch2/catch.hpp>

#include "server/room/touched_allowance.hpp"

using namespace palpate;

TEST_CASE("A frame may take what frames before it left, and however often it begins again it ends") {
  TouchedAllowance allowance;
  allowance.begin(5);
  CHECK(allowance.left() == 200);
  allowance.take(20);
  allowance.begin(5);
  CHECK(allowance.left() == 380);
  allowance.begin(5);
  CHECK(allowance.left() == 400);  // not more than two frames
  double taken = 0;
  const auto take_all = [&] {
    taken += allowance.left();
    allowance.take(allowance.left());
  };
  take_all();
  CHECK(allowance.left() == 0);  // for the other parts of the frame, too
  for (int k = 0; k < 5; ++k) {
    allowance.begin_again();
    take_all();
  }
  CHECK(taken == 400 + 200 + 4 * 50);
  allowance.begin(5);
  CHECK(allowance.left() == 200);
  allowance.begin(1);
  CHECK(allowance.left() == 400);
  allowance.begin(20);
  CHECK(allowance.left() == 1200);
}
