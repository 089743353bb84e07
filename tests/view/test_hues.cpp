// Colours of stations that come and go.
#include <catch2/catch.hpp>

#include "client/view/hues.hpp"

using namespace palpate;

namespace {

std::vector<ToolView> tools(const std::vector<std::string>& stations) {
  std::vector<ToolView> list;
  for (const std::string& station : stations) list.push_back({station, Vec3::Zero(), Vec3::Zero(), false});
  return list;
}

std::vector<std::size_t> seen(Hues& hues, const std::vector<std::string>& stations) {
  const auto list = tools(stations);
  hues.see(list);
  return hues_of(list, hues.stations());
}

using Places = std::vector<std::size_t>;

}  // namespace

TEST_CASE("A station keeps its colour when another leaves, and when it comes back", "[view]") {
  Hues hues;
  CHECK(seen(hues, {"anna", "ben", "carl"}) == Places{0, 1, 2});
  CHECK(seen(hues, {"ben", "carl"}) == Places{1, 2});
  CHECK(seen(hues, {"ben", "dora", "carl"}) == Places{1, 3, 2});
  CHECK(seen(hues, {"carl", "anna"}) == Places{2, 0});
}

TEST_CASE("When all colours are given a new station takes that of one that is gone, if there is one", "[view]") {
  Hues hues;
  const std::vector<std::string> six{"a", "b", "c", "d", "e", "f"};
  REQUIRE(six.size() == Hues::kHues);
  seen(hues, six);
  CHECK(seen(hues, {"a", "b", "d", "e", "f", "g"}) == Places{0, 1, 3, 4, 5, 2});
  CHECK(seen(hues, {"a", "b", "d", "e", "f", "g", "h"}) == Places{0, 1, 3, 4, 5, 2, 6});
}

TEST_CASE("Stations that are known beforehand have the same colour whoever is seen first", "[view]") {
  Hues hues({"anna", "ben"});
  CHECK(seen(hues, {"ben"}) == Places{1});
  CHECK(seen(hues, {"anna", "ben"}) == Places{0, 1});
}
