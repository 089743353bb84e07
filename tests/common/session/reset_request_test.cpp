// A request is repeated until it is fulfilled, and not made before the server's count is known.
#include "common/session/reset_request.hpp"

#include <catch2/catch.hpp>

using namespace palpate;

TEST_CASE("a request waits for the server's count, is repeated, and ends with the next count") {
  ResetRequest request;
  request.ask();
  CHECK_FALSE(request.due(Micros{0}));
  request.hear(7);
  CHECK(request.due(Micros{0}) == 7);
  CHECK_FALSE(request.due(Micros{50'000}));
  CHECK(request.due(Micros{100'000}) == 7);
  request.hear(7);
  CHECK(request.pending());
  request.hear(8);
  CHECK_FALSE(request.pending());
  CHECK_FALSE(request.due(Micros{1'000'000}));
}

TEST_CASE("another life of the server has another count") {
  ResetRequest request;
  request.hear(7);
  request.ask();
  request.forget();
  CHECK_FALSE(request.due(Micros{0}));
  request.hear(0);
  CHECK(request.pending());
  CHECK(request.due(Micros{0}) == 0);
}
