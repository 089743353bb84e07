#include "client/device/hid/hid_settings.hpp"

#include <catch2/catch.hpp>

using palpate::AxisMap;
using palpate::HidSettings;
using palpate::SpaceMouseOptions;

TEST_CASE("What is behind hid: names a device and how to use it", "[hid]") {
  CHECK(HidSettings("").which().empty());
  CHECK(HidSettings("hidraw2").which() == "hidraw2");
  const HidSettings mouse("7,control=position,axes=x+z-y,speed-m-s=0.5,reach-m=0.1");
  CHECK(mouse.which() == "7");
  CHECK(mouse.space_mouse().control == SpaceMouseOptions::Control::position);
  CHECK(mouse.space_mouse().axes.matrix == AxisMap::from_text("x z -y").matrix);
  CHECK(mouse.space_mouse().speed_max_m_s == 0.5);
  CHECK(mouse.space_mouse().reach_m == 0.1);
  const auto stick = HidSettings(",force-n=4,flip=y").force_joystick();
  CHECK(stick.force_max_n == 4);
  CHECK_FALSE(stick.flip_x);
  CHECK(stick.flip_y);
  CHECK_NOTHROW(HidSettings("7").force_profile());
}

TEST_CASE("What is wrong behind hid: is said with what was expected", "[hid]") {
  CHECK_THROWS_WITH(HidSettings("7,fast"), Catch::Contains("\"fast\"; expected KEY=VALUE"));
  CHECK_THROWS_WITH(HidSettings(",a=1,a=2"), Catch::Contains("a is there twice"));
  CHECK_THROWS_WITH(HidSettings(",force-n=4").space_mouse(), Catch::Contains("a six-axis mouse takes no force-n"));
  CHECK_THROWS_WITH(HidSettings(",control=both").space_mouse(), Catch::Contains("expected rate or position"));
  CHECK_THROWS_WITH(HidSettings("").force_joystick(), Catch::Contains("does not say its force in newtons"));
  CHECK_THROWS_WITH(HidSettings(",force-n=1e9").force_joystick(), Catch::Contains("a number from 0.1 to 30"));
  CHECK_THROWS_WITH(HidSettings(",force-n=nan").force_joystick(), Catch::Contains("a number from"));
  CHECK_THROWS_WITH(HidSettings(",flip=z,force-n=4").force_joystick(), Catch::Contains("x, y or xy"));
  CHECK_THROWS_WITH(HidSettings(",reach-m=1").force_profile(), Catch::Contains("a force device takes no reach-m"));
}
