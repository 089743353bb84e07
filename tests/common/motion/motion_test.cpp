#include "common/motion/motion.hpp"

#include <unistd.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <sstream>

#include "common/base/error.hpp"
#include "common/base/limits.hpp"

using palpate::InputError;
using palpate::Motion;
using palpate::Vec3;

namespace {

Motion read(const std::string& text) {
  std::istringstream in(text);
  return palpate::read_motion(in, "m.csv");
}

std::string fault(const std::string& text) {
  try {
    read(text);
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

const std::string kHead = "t_s,x_m,y_m,z_m\n", kTurnHead = "t_s,x_m,y_m,z_m,qx,qy,qz,qw,buttons\n";

}  // namespace

TEST_CASE("A motion is linear between its rows and rests outside them", "[motion]") {
  const Motion m = read(kHead + "0.5,1,2,3\n1.0,2,2,3\n3.0,2,-2,5\n");
  CHECK(m.position(0.0).isApprox(Vec3(1, 2, 3)));
  CHECK(m.position(0.75).isApprox(Vec3(1.5, 2, 3)));
  CHECK(m.position(1.0).isApprox(Vec3(2, 2, 3)));
  CHECK(m.position(2.0).isApprox(Vec3(2, 0, 4)));
  CHECK(m.position(99.0).isApprox(Vec3(2, -2, 5)));
  CHECK(m.duration_s() == 3.0);
  CHECK(m.position(palpate::Micros{750'000}).isApprox(Vec3(1.5, 2, 3)));
}

TEST_CASE("Line ends of any system, spaces and a missing last line end are taken", "[motion]") {
  const Motion m = read("t_s,x_m,y_m,z_m\r\n0, 1 ,2,3\r\n1,1e-3,-2.5E-1,3\r\n\r\n");
  CHECK(m.position(1).isApprox(Vec3(1e-3, -0.25, 3)));
  CHECK(read(kHead + "0,0,0,0\n1,0,0,1").duration_s() == 1.0);
}

TEST_CASE("What is wrong with a motion is said with file, line and what was expected", "[motion]") {
  struct Wrong {
    std::string text, place, what;
  };
  const Wrong cases[] = {
      {"", "m.csv:1: ", "empty"},
      {"0,0,0,0\n1,0,0,0\n", "m.csv:1: ", "header"},
      {"t_s,x_m,y_m\n0,0,0\n", "m.csv:1: ", "header"},
      {kHead, "m.csv: ", "0 rows"},
      {kHead + "0,0,0,0\n", "m.csv: ", "1 row;"},
      {kHead + "0,0,0,0\n1,0,zero,0\n", "m.csv:3: ", "y_m is 'zero'"},
      {kHead + "0,0,0,0\n1,,0,0\n", "m.csv:3: ", "x_m is ''"},
      {kHead + "0,0,0,0\n1,0,0,0.1m\n", "m.csv:3: ", "z_m"},
      {kHead + "0,nan,0,0\n1,0,0,0\n", "m.csv:2: ", "x_m is 'nan'"},
      {kHead + "0,0,0,0\n1,0,inf,0\n", "m.csv:3: ", "y_m is 'inf'"},
      {kHead + "0,0,0,0\n1,0,0,1e999\n", "m.csv:3: ", "z_m"},
      {kHead + "0,0,0,0\ninf,0,0,0\n", "m.csv:3: ", "t_s"},
      {kHead + "0,0,0,0\n2,0,0,0\n1,0,0,0\n", "m.csv:4: ", "goes back"},
      {kHead + "0,0,0,0\n20000,0,0,0\n", "m.csv:3: ", "8000 s"},
      {kHead + "0,0,0,0\n1,0,0,0\n1,0,0,0\n", "m.csv:4: ", "repeated"},
      {kHead + "-1,0,0,0\n1,0,0,0\n", "m.csv:2: ", "t_s is -1"},
      {kHead + "0,0,0,0\n1,0,0,10.5\n", "m.csv:3: ", "z_m is 10.5"},
      {kHead + "0,0,0,0\n1,0,0\n", "m.csv:3: ", "3 columns"},
      {kHead + "0,0,0,0\n1,0,0,0,0\n", "m.csv:3: ", "5 columns"},
      {kHead + "0,0,0,0\n\n1,0,0,0\n", "m.csv:3: ", "empty"},
      {kTurnHead + "0,0,0,0,0,0,0,1,0\n1,0,0,0,0,0,0.5,0.5,0\n", "m.csv:3: ", "qx,qy,qz,qw have the length 0.7"},
      {kTurnHead + "0,0,0,0,0,0,0,1,0\n1,0,0,0,0,0,0,1,-1\n", "m.csv:3: ", "buttons is -1"},
      {kTurnHead + "0,0,0,0,0,0,0,1,0\n1,0,0,0,0,0,0,1,0.5\n", "m.csv:3: ", "buttons is 0.5"},
      {kTurnHead + "0,0,0,0,0,0,0,1,4294967296\n1,0,0,0,0,0,0,1,0\n", "m.csv:2: ", "buttons is 4294967296"},
      {kTurnHead + "0,0,0,0,0,0,0,1,0\n1,0,0,0,0,0,0,1\n", "m.csv:3: ", "8 columns; expected 9"},
      {"t_s,x_m,y_m,z_m,qx,qy,qz\n0,0,0,0,0,0,0\n", "m.csv:1: ", "header"},
      {kHead + "0;0;0;0\n1;0;0;0\n", "m.csv:2: ", "t_s is '0;0;0;0'"},
  };
  for (const Wrong& wrong : cases) {
    INFO(wrong.text);
    const std::string said = fault(wrong.text);
    CHECK(said.rfind(wrong.place, 0) == 0);
    CHECK_THAT(said, Catch::Contains(wrong.what) && Catch::Contains("; expected "));
  }
}

TEST_CASE("A motion made in memory is held to the same rules", "[motion]") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(Motion({{0, Vec3::Zero()}}), InputError);
  CHECK_THROWS_AS(Motion({{0, Vec3::Zero()}, {0, Vec3::Zero()}}), InputError);
  CHECK_THROWS_AS(Motion({{0, Vec3::Zero()}, {nan, Vec3::Zero()}}), InputError);
  CHECK_THROWS_AS(Motion({{0, Vec3::Zero()}, {1, Vec3(0, nan, 0)}}), InputError);
  CHECK_THROWS_AS(Motion({{0, Vec3::Zero()}, {1, Vec3(0, 0, 2 * palpate::kWorldExtentM)}}), InputError);
  CHECK(Motion::rest(Vec3(1, 2, 3), 5).position(4.0) == Vec3(1, 2, 3));
}

TEST_CASE("A motion that was written is read back to the same bits", "[motion]") {
  std::vector<palpate::MotionPoint> points;
  for (int i = 0; i < 500; ++i) points.push_back({i / 997.0, Vec3(std::sin(i * 0.1) / 3, std::exp(-i * 0.01) * 1e-7, -i * 1e-3)});
  const Motion m(points);
  const auto file = std::filesystem::temp_directory_path() / ("palpate-motion-test-" + std::to_string(getpid()) + ".csv");
  palpate::write_motion(file, m);
  const Motion back = palpate::read_motion(file);
  std::filesystem::remove(file);
  REQUIRE(back.points().size() == points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    CHECK(back.points()[i].t_s == points[i].t_s);
    CHECK(back.points()[i].position == points[i].position);
  }
}

TEST_CASE("Files that are not there, folders and unwritable places are refused", "[motion]") {
  CHECK_THROWS_AS(palpate::read_motion(std::filesystem::path("no-such-file.csv")), InputError);
  CHECK_THROWS_AS(palpate::read_motion(std::filesystem::path("/")), InputError);
  CHECK_THROWS_AS(palpate::write_motion("/no/such/folder/m.csv", Motion::rest(Vec3::Zero(), 1)), InputError);
}

TEST_CASE("Every recorded motion of scenes/motions is a motion", "[motion]") {
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(PALPATE_SOURCE_DIR "/scenes/motions")) {
    if (entry.path().extension() != ".csv") continue;
    const Motion m = palpate::read_motion(entry.path());
    INFO(entry.path());
    CHECK(m.points().front().t_s == 0);
    CHECK(m.duration_s() <= 60);
    double speed_max = 0;
    const auto points = m.points();
    for (std::size_t i = 1; i < points.size(); ++i)
      speed_max = std::max(speed_max, (points[i].position - points[i - 1].position).norm() / (points[i].t_s - points[i - 1].t_s));
    CHECK(speed_max < 0.6);  // speed of a working hand, not a striking one
    ++files;
  }
  CHECK(files >= 7);
}

TEST_CASE("The base excursion starts at rest on its node and is the stated motion after its ramp", "[motion]") {
  const Motion m = palpate::read_motion(std::filesystem::path(PALPATE_SOURCE_DIR "/scenes/motions/base-excursion.csv"));
  const Vec3 node(0.04, 0.04, 0.1);
  CHECK((m.position(0.0) - node).norm() < 1e-12);
  CHECK((m.position(0.001) - node).norm() < 1e-6);
  const auto wave = [](double amplitude, double hz, double t) { return amplitude * std::sin(2 * M_PI * hz * t); };
  for (double t = 0.25; t <= 5.0; t += 0.25) {
    const Vec3 stated(wave(4e-3, 1.1, t), wave(3e-3, 0.7, t), -(10e-3 + wave(4e-3, 1.5, t) + wave(0.3e-3, 9, t)));
    CHECK((m.position(t) - node - stated).norm() < 2e-9);
  }
}

TEST_CASE("A motion may say how the tool is held: turned evenly between rows, buttons from their row on", "[motion]") {
  // A quarter turn about z in the second after t = 1.
  const Motion m =
      read(kTurnHead + "1,0,0,0,0,0,0,1,0\n2,0,0,0,0,0,0.70710678,0.70710678,5\n3,0,0,0,0,0,0.70710678,0.70710678,2\n");
  CHECK(m.has_orientation());
  CHECK(m.button_count() == 3);
  const auto x_at = [&](double t_s) { return Vec3(*m.orientation(palpate::from_seconds(t_s)) * Vec3::UnitX()); };
  CHECK(x_at(0.5).isApprox(Vec3::UnitX()));
  CHECK(x_at(1.5).isApprox(Vec3(std::sqrt(0.5), std::sqrt(0.5), 0), 1e-8));
  CHECK(x_at(9).isApprox(Vec3::UnitY(), 1e-8));
  const auto buttons = [&](double t_s) { return m.buttons(palpate::from_seconds(t_s)); };
  CHECK(buttons(0.5) == 0);
  CHECK(buttons(1.999999) == 0);
  CHECK(buttons(2) == 5);
  CHECK(buttons(9) == 2);
  const Motion without = read(kHead + "0,0,0,0\n1,0,0,0\n");
  CHECK_FALSE(without.orientation(palpate::Micros{0}));
  CHECK(without.buttons(palpate::Micros{500'000}) == 0);
  CHECK(without.button_count() == 0);
  const Motion only_buttons = read("t_s,x_m,y_m,z_m,buttons\n0,0,0,0,1\n1,0,0,0,0\n");
  CHECK_FALSE(only_buttons.has_orientation());
  CHECK(only_buttons.buttons(palpate::Micros{0}) == 1);
}

TEST_CASE("Holds that are written are read back", "[motion]") {
  std::vector<palpate::MotionPoint> points;
  palpate::MotionHolds holds;
  for (int i = 0; i < 50; ++i) {
    points.push_back({i * 0.1, Vec3::Zero()});
    holds.orientations.push_back(Eigen::Quaterniond(std::cos(i * 0.1), std::sin(i * 0.1), 0, 0));
    holds.buttons.push_back(0xffffffffU - static_cast<unsigned>(i));
  }
  const Motion m(points, holds);
  const auto file = std::filesystem::temp_directory_path() / ("palpate-holds-test-" + std::to_string(getpid()) + ".csv");
  palpate::write_motion(file, m);
  const Motion back = palpate::read_motion(file);
  std::filesystem::remove(file);
  for (std::size_t i = 0; i < points.size(); ++i) {
    CHECK((back.holds().orientations[i].coeffs() - m.holds().orientations[i].coeffs()).norm() < 1e-15);  // normalised
    CHECK(back.holds().buttons[i] == holds.buttons[i]);
  }
}

TEST_CASE("Openings of jaws are read with or without orientations and buttons, and are linear in between", "[motion]") {
  const Motion alone = read("t_s,x_m,y_m,z_m,opening\n0,0,0,0,1\n1,0,0,0,0.5\n");
  CHECK(alone.has_opening());
  CHECK(alone.opening(palpate::Micros{500'000}) == 0.75);
  CHECK(alone.opening(palpate::Micros{9'000'000}) == 0.5);
  CHECK(alone.buttons(palpate::Micros{0}) == 0);
  const Motion all = read("t_s,x_m,y_m,z_m,qx,qy,qz,qw,buttons,opening\n0,0,0,0,0,0,0,1,2,0.25\n1,0,0,0,0,0,0,1,0,0\n");
  CHECK(all.buttons(palpate::Micros{0}) == 2);
  CHECK(all.opening(palpate::Micros{0}) == 0.25);
  CHECK(read("t_s,x_m,y_m,z_m,buttons,opening\n0,0,0,0,1,0.5\n1,0,0,0,0,0\n").buttons(palpate::Micros{0}) == 1);
  CHECK_FALSE(read(kHead + "0,0,0,0\n1,0,0,0\n").has_opening());
  CHECK_THAT(fault("t_s,x_m,y_m,z_m,opening\n0,0,0,0,1.5\n1,0,0,0,0\n"),
             Catch::Contains("m.csv:2: ") && Catch::Contains("0 to 1"));
}
