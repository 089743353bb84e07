#include "client/device/hid/report_descriptor.hpp"

#include <catch2/catch.hpp>
#include <random>
#include <set>

#include "common/base/error.hpp"
#include "tests/client/device/hid/bench_transport.hpp"

using palpate::hid_usage;
using palpate::HidField;
using palpate::HidReportKind;
using palpate::InputError;
using palpate::ReportDescriptor;
using palpate::test::bytes_of;

namespace {

ReportDescriptor parsed(const std::vector<std::uint8_t>& bytes) { return ReportDescriptor(bytes_of(bytes)); }

}  // namespace

TEST_CASE("The profile's descriptor gives each usage one field, at the byte that the page says", "[hid]") {
  const ReportDescriptor descriptor(bytes_of(force_hid_descriptor));
  CHECK(descriptor.numbered());
  CHECK(descriptor.applications() == std::vector<std::uint32_t>{hid_usage(FORCE_HID_PAGE, FORCE_HID_DEVICE)});
  CHECK(descriptor.report_bytes(HidReportKind::input, FORCE_HID_INPUT_ID) == FORCE_HID_INPUT_BYTES);
  CHECK(descriptor.report_bytes(HidReportKind::output, FORCE_HID_OUTPUT_ID) == FORCE_HID_OUTPUT_BYTES);
  CHECK(descriptor.report_bytes(HidReportKind::feature, FORCE_HID_FEATURE_ID) == FORCE_HID_FEATURE_BYTES);
  CHECK(descriptor.report_bytes(HidReportKind::feature, FORCE_HID_INPUT_ID) == 0);
  std::set<std::uint32_t> usages;
  for (const HidField& field : descriptor.fields()) usages.insert(field.usage);
  CHECK(usages.size() == descriptor.fields().size());

  struct Place {
    HidReportKind kind;
    int usage;
    std::uint32_t byte, bits;
  };
  for (const Place& place : {Place{HidReportKind::input, FORCE_HID_CLOCK, 3, 32},
                             {HidReportKind::input, FORCE_HID_POSITION_X + 2, 15, 32},
                             {HidReportKind::input, FORCE_HID_ORIENTATION_X + 3, 25, 16},
                             {HidReportKind::input, FORCE_HID_BUTTONS, 27, 16},
                             {HidReportKind::input, FORCE_HID_STATUS, 29, 16},
                             {HidReportKind::input, FORCE_HID_STATE, 31, 8},
                             {HidReportKind::input, FORCE_HID_TAKEN, 32, 16},
                             {HidReportKind::input, FORCE_HID_OPENING, 34, 16},
                             {HidReportKind::output, FORCE_HID_FLAGS, 3, 8},
                             {HidReportKind::output, FORCE_HID_FORCE_X + 2, 12, 32},
                             {HidReportKind::feature, FORCE_HID_PEAK, 11, 32},
                             {HidReportKind::feature, FORCE_HID_WORKSPACE_MAX_X + 2, 51, 32},
                             {HidReportKind::feature, FORCE_HID_FEATURES, 56, 8}}) {
    const HidField* field = descriptor.find(place.kind, hid_usage(FORCE_HID_PAGE, static_cast<std::uint32_t>(place.usage)));
    REQUIRE(field);
    CHECK(field->bit == 8 * place.byte);
    CHECK(field->bits == place.bits);
  }
}

TEST_CASE("What is written into a field is read from it, and no other bit changes", "[hid]") {
  std::mt19937 random(1);
  for (int n = 0; n < 3000; ++n) {
    HidField field;
    field.bits = 1 + static_cast<std::uint32_t>(random() % 32);
    field.bit = 8 + static_cast<std::uint32_t>(random() % 60);
    const bool has_sign = random() % 2 != 0;
    field.logical_min = has_sign ? -(std::int64_t{1} << (field.bits - 1)) : 0;
    field.logical_max = (std::int64_t{1} << (has_sign ? field.bits - 1 : field.bits)) - 1;
    std::vector<std::byte> report(16);
    for (std::byte& byte : report) byte = static_cast<std::byte>(random());
    report[0] = std::byte{0};
    const auto before = report;
    const std::int64_t value = field.logical_min + static_cast<std::int64_t>(random() % (std::uint64_t{1} << field.bits));
    set_value(field, report, value);
    REQUIRE(holds(field, report));
    REQUIRE(value_of(field, report) == value);
    for (std::uint32_t bit = 0; bit < 128; ++bit)
      if (bit < field.bit || bit >= field.bit + field.bits)
        REQUIRE(((report[bit / 8] ^ before[bit / 8]) >> (bit % 8) & std::byte{1}) == std::byte{0});
    set_value(field, report, std::int64_t{1} << 40);
    REQUIRE(value_of(field, report) == field.logical_max);
  }
}

TEST_CASE("Usages without a page take that of the main item, those of four bytes their own, and the last one repeats", "[hid]") {
  const ReportDescriptor d = parsed({0x05, 0x01, 0x09, 0x04, 0xA1, 0x01, 0x09, 0x30, 0x0B, 0x05, 0x00, 0x09, 0x00, 0x05,
                                     0x0C, 0x09, 0x40, 0x15, 0x00, 0x25, 0x7F, 0x75, 0x08, 0x95, 0x04, 0x81, 0x02, 0xC0});
  REQUIRE(d.fields().size() == 4);
  CHECK(d.fields()[0].usage == hid_usage(0x0C, 0x30));
  CHECK(d.fields()[1].usage == hid_usage(0x09, 0x05));
  CHECK(d.fields()[2].usage == hid_usage(0x0C, 0x40));
  CHECK(d.fields()[3].usage == hid_usage(0x0C, 0x40));
  CHECK_FALSE(d.numbered());
  CHECK(d.fields()[3].bit == 32);  // the id, which is 0, counts
}

TEST_CASE("Push and pop keep ranges, padding has no field, and a largest value may lack its sign's bit", "[hid]") {
  const ReportDescriptor d = parsed({0x05, 0x01, 0x09, 0x04, 0xA1, 0x01, 0x15, 0x00, 0x25, 0xFF, 0x75, 0x08, 0x95,
                                     0x01, 0xA4, 0x75, 0x04, 0x81, 0x03, 0xB4, 0x09, 0x31, 0x81, 0x02, 0xC0});
  REQUIRE(d.fields().size() == 1);
  CHECK(d.fields()[0].bit == 12);
  CHECK(d.fields()[0].bits == 8);
  CHECK(d.fields()[0].logical_max == 255);
}

TEST_CASE("An array names its usages by value, from its smallest one on", "[hid]") {
  const ReportDescriptor d = parsed({0x05, 0x0F, 0x09, 0x96, 0xA1, 0x02, 0x85, 0x0C, 0x09, 0x97, 0x09, 0x98, 0x09, 0x99,
                                     0x09, 0x9A, 0x15, 0x01, 0x25, 0x04, 0x75, 0x08, 0x95, 0x01, 0x91, 0x00, 0xC0});
  const HidField* field = d.find(HidReportKind::output, hid_usage(0x0F, 0x9A));
  REQUIRE(field);
  CHECK(field->array);
  std::vector<std::byte> report(2);
  choose(*field, report, hid_usage(0x0F, 0x9A));
  CHECK(report[1] == std::byte{4});
  CHECK(d.find(HidReportKind::output, hid_usage(0x0F, 0x9B)) == nullptr);
  CHECK(d.find(HidReportKind::output, hid_usage(0x0F, 0x9A), hid_usage(0x0F, 0x77)) == nullptr);
}

TEST_CASE("A descriptor that is not right is refused with the byte", "[hid]") {
  struct Wrong {
    std::vector<std::uint8_t> bytes;
    const char* says;
  };
  for (const Wrong& wrong :
       {Wrong{{0x05}, "byte 0: is cut off"},
        {{0xA1, 0x01}, "ends inside a collection"},
        {{0xC0}, "byte 0: ends a collection that did not begin"},
        {{0x09, 0x30, 0x75, 0x08, 0x95, 0x01, 0x81, 0x02}, "byte 6: has a field outside"},
        {{0xA1, 0x01, 0x85, 0x00, 0xC0}, "byte 2: has the report id 0"},
        {{0xB4}, "byte 0: pops what was not pushed"},
        {{0xA1, 0x01, 0x29, 0x05, 0xC0}, "byte 2: ends a range of usages"},
        {{0xA1, 0x01, 0x09, 0x01, 0x75, 0x20, 0x97, 0xFF, 0xFF, 0xFF, 0x7F, 0x81, 0x02, 0xC0}, "makes a report too long"},
        {{0xA1, 0x01, 0x1A, 0x00, 0x00, 0x2A, 0xFF, 0xFF, 0x75, 0x10, 0x95, 0x01, 0x81, 0x00, 0xC0}, "too many usages"},
        {std::vector<std::uint8_t>(5000, 0x05), "has 5000 bytes"},
        {std::vector<std::uint8_t>(20, 0xA4), "pushes too often"},
        {{0xFE, 0x05, 0x00, 0x01}, "is cut off"}})
    CHECK_THROWS_WITH(parsed(wrong.bytes), Catch::Contains(wrong.says));
}
