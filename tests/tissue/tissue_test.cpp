// Bodies against closed forms and classic solutions, on the smallest meshes of palpate-lab tissue. Tolerances are the errors seen
// there (docs/results/tissue.md) and a tenth more, unless an answer is exact.
#include <catch2/catch.hpp>

#include "bench/tissue/tissue_case.hpp"

TEST_CASE("placeholder") {}
