// Colours of stations that come and go.
#include <catch2/catch.hpp>
#include <cmath>

#include "client/viewer/color.hpp"
#include "client/viewer/hues.hpp"

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

/// Conversion from linear sRGB by B. Ottosson, "A perceptual color space for image processing", 2020.
Vec3f oklab(const Vec3f& linear) {
  Eigen::Matrix3f to_cones, to_lab;
  to_cones << 0.4122214708F, 0.5363325363F, 0.0514459929F, 0.2119034982F, 0.6806995451F, 0.1073969566F, 0.0883024619F,
      0.2817188376F, 0.6299787005F;
  to_lab << 0.2104542553F, 0.7936177850F, -0.0040720468F, 1.9779984951F, -2.4285922050F, 0.4505937099F, 0.0259040371F,
      0.7827717662F, -0.8086757660F;
  return to_lab * (to_cones * linear).unaryExpr([](float c) { return std::cbrt(std::max(c, 0.0F)); });
}

/// Colour vision without one kind of cone: G. Machado et al., "A physiologically-based model for simulation of color vision
/// deficiency", 2009, severity 1, for linear sRGB.
std::vector<Eigen::Matrix3f> eyes() {
  Eigen::Matrix3f protan, deutan;
  protan << 0.152286F, 1.052583F, -0.204868F, 0.114503F, 0.786281F, 0.099216F, -0.003882F, -0.048116F, 1.051998F;
  deutan << 0.367322F, 0.860646F, -0.227968F, 0.280085F, 0.672501F, 0.047413F, -0.011820F, 0.042940F, 0.968881F;
  return {Eigen::Matrix3f::Identity(), protan, deutan};
}

float nearest_to_any_eye(const Vec3f& a, const Vec3f& b) {
  float nearest = 9;
  for (const Eigen::Matrix3f& eye : eyes()) {
    const auto seen = [&](const Vec3f& srgb) { return oklab((eye * to_linear(srgb)).cwiseMax(0).cwiseMin(1)); };
    nearest = std::min(nearest, (seen(a) - seen(b)).norm());
  }
  return nearest;
}

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
  const std::vector<std::string> all{"a", "b", "c", "d", "e", "f", "g", "h"};
  REQUIRE(all.size() == Hues::kHues);
  seen(hues, all);
  CHECK(seen(hues, {"a", "b", "d", "e", "f", "g", "h", "i"}) == Places{0, 1, 3, 4, 5, 6, 7, 2});
  CHECK(seen(hues, {"a", "b", "d", "e", "f", "g", "h", "i", "j"}) == Places{0, 1, 3, 4, 5, 6, 7, 2, 8});
}

TEST_CASE("Stations that are known beforehand have the same colour whoever is seen first", "[view]") {
  Hues hues({"anna", "ben"});
  CHECK(seen(hues, {"ben"}) == Places{1});
  CHECK(seen(hues, {"anna", "ben"}) == Places{0, 1});
}

TEST_CASE("Eight stations are told apart by any eye, and none is grey as the steel of an instrument", "[view]") {
  constexpr float kApart = 0.13F;  // black to white is 1; adjacent steps of 0.02 are just visible
  for (std::size_t i = 0; i < kStationColors; ++i) {
    for (std::size_t j = 0; j < i; ++j) CHECK(nearest_to_any_eye(station_color(i), station_color(j)) > kApart);
    CHECK((oklab(to_linear(station_color(i))) - oklab(to_linear(Vec3f(0.72F, 0.74F, 0.77F)))).norm() > kApart);
  }
}
