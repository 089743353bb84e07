#include "client/mapping/workspace_file.hpp"

#include <catch2/catch.hpp>

#include "common/base/error.hpp"

using namespace palpate;

namespace {

std::vector<NamedMapping> from_text(const std::string& text) { return read_workspace(text, "w.json"); }

std::string fault_in(const std::string& text) {
  try {
    from_text(text);
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

/// File with one device that has these further fields, each on its own line.
std::string device_with(const std::string& fields) { return "{\"devices\": [{\"device\": \"hid\",\n" + fields + "}]}"; }

}  // namespace

TEST_CASE("A workspace file says what it says, and the defaults where it says nothing") {
  const auto all =
      from_text(device_with("\"scale\": 0.3, \"centre_m\": [0, 0.01, 0.02], \"clutch_button\": 1, \"anchor\": \"start\""));
  REQUIRE(all.size() == 1);
  CHECK(all[0].device == "hid");
  const WorkspaceMapping& mapping = all[0].mapping;
  CHECK(mapping.scale == 0.3);
  CHECK(*mapping.centre_m == Vec3(0, 0.01, 0.02));
  CHECK(mapping.anchor == Anchor::start);
  CHECK(*mapping.clutch_button == 1);
  CHECK_FALSE(mapping.dead_man_button);
  CHECK(mapping.force_scale == 1);
  CHECK(mapping.tool_weight_n == Vec3::Zero());
}

TEST_CASE("What is written reads back to the same bits") {
  WorkspaceMapping odd;
  odd.scale = 1.0 / 3;
  odd.rotation_deg = Vec3(0.1, -90, 1e-7);
  odd.offset_m = Vec3(1, -2, 0.3);
  odd.centre_m = Vec3(0.1, 0.2, 0.7);
  odd.anchor = Anchor::workspace;
  odd.force_scale = 0.7;
  odd.tool_weight_n = Vec3(0, 0, -0.31);
  odd.clutch_button = 0;
  odd.dead_man_button = 31;
  odd.jaws_button = 3;
  const auto all = from_text(workspace_text({{"a \"b\"", odd}, {"sim", {}}}));
  REQUIRE(all.size() == 2);
  const WorkspaceMapping& back = all[0].mapping;
  CHECK(all[0].device == "a \"b\"");
  CHECK(back.scale == odd.scale);
  CHECK(back.rotation_deg == odd.rotation_deg);
  CHECK(back.offset_m == odd.offset_m);
  CHECK(*back.centre_m == *odd.centre_m);
  CHECK(back.anchor == odd.anchor);
  CHECK(back.force_scale == odd.force_scale);
  CHECK(back.tool_weight_n == odd.tool_weight_n);
  CHECK(back.clutch_button == odd.clutch_button);
  CHECK(back.dead_man_button == odd.dead_man_button);
  CHECK(back.jaws_button == odd.jaws_button);
  CHECK_FALSE(all[1].mapping.centre_m);
  CHECK_FALSE(all[1].mapping.clutch_button);
}

TEST_CASE("What is wrong with a workspace file is said with file, line and what was expected") {
  const struct {
    std::string text, said;
  } faults[] = {
      {"[]", "w.json:1: is a list; expected an object with \"devices\""},
      {"{\n\"device\": 1}", "w.json:2: device is not known"},
      {"{}", "w.json:1: devices is missing"},
      {"{\"devices\": [\n3]}", "w.json:2: devices[0] is a number; expected an object"},
      {"{\"devices\": [{}]}", "devices[0].device is missing"},
      {"{\"devices\": [{\"device\": \"\"}]}", "devices[0].device"},
      {device_with("\"size\": 1"), "w.json:2: devices[0].size is not known; expected one of device, scale"},
      {device_with("\"scale\": 0"), "w.json:2: devices[0].scale is 0; expected 0.05 to 20"},
      {device_with("\"scale\": \"1\""), "devices[0].scale is a text; expected a number"},
      {device_with("\"scale\": 1e999"), "devices[0].scale is 1e999"},
      {device_with("\"offset_m\": [0, 0]"), "devices[0].offset_m is a list of 2; expected a list of 3 numbers"},
      {device_with("\"offset_m\": [0,\n0, 11]"), "w.json:3: devices[0].offset_m[2] is 11; expected -10 to 10"},
      {device_with("\"anchor\": \"middle\""), "devices[0].anchor is 'middle'; expected one of automatic, workspace, start"},
      {device_with("\"clutch_button\": 0.5"), "devices[0].clutch_button is 0.5; expected a whole number"},
      {device_with("\"clutch_button\": 32"), "devices[0].clutch_button is 32; expected 0 to 31"},
      {device_with("\"scale\": 1,"), "w.json:2: "},
      {"{\"devices\": [{\"device\": \"a\"},\n{\"device\": \"a\"}]}", "w.json:2: device 'a' is there twice"},
  };
  for (const auto& wrong : faults) {
    CAPTURE(wrong.text);
    CHECK_THAT(fault_in(wrong.text), Catch::Contains(wrong.said) && Catch::Contains("; expected "));
  }
  CHECK_THROWS_AS(read_workspace(std::filesystem::path("/no/such/file.json")), InputError);
}
