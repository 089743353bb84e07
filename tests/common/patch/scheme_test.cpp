// The names of schemes.
#include "common/patch/scheme.hpp"

#include <catch2/catch.hpp>

using namespace palpate;

TEST_CASE("Every scheme is found by its name, and has the number that it has on the wire") {
  CHECK(static_cast<int>(Scheme::hyper) == 4);
  for (std::size_t k = 0; k < kSchemeNames.size(); ++k) {
    CHECK(scheme_from_name(kSchemeNames[k]) == static_cast<Scheme>(k));
    CHECK(name_of(static_cast<Scheme>(k)) == kSchemeNames[k]);
  }
}

TEST_CASE("A name that is no scheme's is none") {
  for (const std::string_view name : {"", "Hyper", "hypers", "auto", "balanced"}) CHECK_FALSE(scheme_from_name(name));
}
