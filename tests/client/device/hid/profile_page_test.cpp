// docs/reference/hid-profile.md, from which firmware is written, agrees with the reference firmware.
#include <catch2/catch.hpp>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <sstream>

#include "client/device/hid/report_descriptor.hpp"
#include "tests/client/device/hid/bench_transport.hpp"

using palpate::hid_usage;
using palpate::HidField;
using palpate::HidReportKind;
using palpate::ReportDescriptor;

namespace {

const std::string& page() {
  static const std::string text = [] {
    std::ifstream file(PALPATE_SOURCE_DIR "/docs/reference/hid-profile.md");
    return std::string(std::istreambuf_iterator<char>(file), {});
  }();
  return text;
}

/// Text from this heading to the next.
std::string section(const std::string& heading) {
  const std::size_t begin = page().find("## " + heading);
  REQUIRE(begin != std::string::npos);
  return page().substr(begin, page().find("\n## ", begin) - begin);
}

std::vector<std::uint8_t> bytes_in(const std::string& text) {
  std::vector<std::uint8_t> bytes;
  std::istringstream words(text);
  for (std::string word; words >> word;) bytes.push_back(static_cast<std::uint8_t>(std::stoul(word, nullptr, 16)));
  return bytes;
}

std::vector<std::string> matches(const std::string& text, const char* pattern) {
  const std::regex regex(pattern);
  std::vector<std::string> all;
  for (auto it = std::sregex_iterator(text.begin(), text.end(), regex); it != std::sregex_iterator(); ++it)
    all.push_back((*it)[1]);
  return all;
}

std::vector<unsigned long> numbers(const std::string& text) {
  std::vector<unsigned long> all;
  for (const std::string& word : matches(text, "(0x[0-9A-F]+|[0-9]+)")) all.push_back(std::stoul(word, nullptr, 0));
  return all;
}

/// Compares rows "| byte | bits | usage |" with the descriptor; returns the usages found.
std::set<std::uint32_t> compare_table(const std::string& text, HidReportKind kind) {
  static const ReportDescriptor descriptor(palpate::test::bytes_of(force_hid_descriptor));
  std::set<std::uint32_t> seen;
  const std::regex row(R"(\n\| ([0-9, ]+) \| ([0-9]+)( signed)? \| (0x[^|]+) \|)");
  for (auto it = std::sregex_iterator(text.begin(), text.end(), row); it != std::sregex_iterator(); ++it) {
    const auto places = numbers((*it)[1]);
    auto usages = numbers((*it)[4]);
    if ((*it)[4].str().find(" to ") != std::string::npos) usages = {usages[0], usages[0] + 1, usages[0] + 2, usages[0] + 3};
    REQUIRE(places.size() == usages.size());
    for (std::size_t i = 0; i < places.size(); ++i) {
      const auto usage = hid_usage(FORCE_HID_PAGE, static_cast<std::uint32_t>(usages[i]));
      const HidField* field = descriptor.find(kind, usage);
      REQUIRE(field);
      CHECK(field->bit == 8 * places[i]);
      CHECK(field->bits == std::stoul((*it)[2]));
      // The clock has arbitrary 32 bits.
      if (usages[i] != FORCE_HID_CLOCK) CHECK((field->logical_min < 0) == (*it)[3].matched);
      seen.insert(usage);
    }
  }
  return seen;
}

}  // namespace

TEST_CASE("The page's tables have every field of the descriptor at its byte", "[hid]") {
  std::set<std::uint32_t> seen = compare_table(section("Input report"), HidReportKind::input);
  seen.merge(compare_table(section("Output report"), HidReportKind::output));
  seen.merge(compare_table(section("Feature report"), HidReportKind::feature));
  std::set<std::uint32_t> all;
  const ReportDescriptor descriptor(palpate::test::bytes_of(force_hid_descriptor));
  for (const HidField& field : descriptor.fields()) all.insert(field.usage);
  CHECK(seen == all);
}

TEST_CASE("The page's descriptor is the firmware's", "[hid]") {
  const auto blocks = matches(section("The report descriptor"), "```\\n([^`]+)```");
  REQUIRE(blocks.size() == 1);
  const std::vector<std::uint8_t> ours(force_hid_descriptor, force_hid_descriptor + FORCE_HID_DESCRIPTOR_BYTES);
  CHECK(bytes_in(blocks[0]) == ours);
}

TEST_CASE("The page's example bytes are what the firmware sends and takes", "[hid]") {
  const auto lines = matches(section("Example bytes"), "\\n    ([^\\n]+)");
  REQUIRE(lines.size() == 2);
  palpate::test::BenchDevice device(palpate::test::turning_limits());
  device.sensors = {true, 0, {1, -1, 16'909'060}, {0, 0, -32767, 0x1234}, 0x0005, 0x8001};
  device.now_us = 0x0A0B0C0D - 1000;
  device.core.input_sequence = 0x0201;
  device.core.taken_sequence = 0x0403;
  device.step();
  std::vector<std::uint8_t> report(FORCE_HID_INPUT_BYTES);
  force_hid_input_report(&device.core, report.data());
  CHECK(bytes_in(lines[0]) == report);

  const auto command = bytes_in(lines[1]);
  device.send_as(4, 0);
  CHECK(force_hid_receive(&device.core, command.data(), command.size(), device.now_us));
  CHECK(device.step() == std::array<std::int32_t, 3>{100, -200, 1500});
  CHECK(device.torque_unm == std::array<std::int32_t, 3>{0, 20'000, -1});
  CHECK(device.core.taken_sequence == 5);
}
