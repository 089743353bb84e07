// Progress messages of a long command.
#include "bench/output/progress.hpp"

#include <catch2/catch.hpp>

using namespace palpate;

TEST_CASE("the time still to be expected is what the part that is done took, in proportion") {
  CHECK(progress_line("the runs", 0, 3) == "0 % of the runs");
  CHECK(progress_line("the runs", 0.25, 10) == "25 % of the runs, about 30 s to go");
  CHECK(progress_line("the runs", 0.1, 60) == "10 % of the runs, about 9 min to go");
  CHECK(progress_line("the runs", 0.01, 60 * 60) == "1 % of the runs, about 99.0 h to go");
  CHECK(progress_line("the runs", 1, 60) == "100 % of the runs, about 0 s to go");
}
