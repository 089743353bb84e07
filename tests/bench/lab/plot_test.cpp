#include "bench/output/plot.hpp"

#include <catch2/catch.hpp>
#include <cstdlib>
#include <string>

using namespace palpate;

TEST_CASE("Without gnuplot there is no plot, however much there is to draw, and the program goes on") {
  const char* const path = std::getenv("PATH");
  REQUIRE(path != nullptr);
  const std::string before = path;
  ::setenv("PATH", "/nonexistent", 1);
  const std::string more_than_a_pipe_holds(1 << 20, '\n');
  CHECK_FALSE(plot_script("none.svg", 100, 100, more_than_a_pipe_holds));
  ::setenv("PATH", before.c_str(), 1);
}
