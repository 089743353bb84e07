// What a HID device says about its reports: the report descriptor (USB HID 1.11, section 6.2.2) as a list of fields.
//
// A field is one number of one report: which report, which bits, what it means (usage page << 16 | usage), its range and unit.
// Devices of one kind differ in report ids, offsets and order, so fields are found by usage and by the collection they are in,
// never by a constant. A variable main item of n elements gives n fields (the last usage repeats); an array item gives one, its
// first, whose values name one of its usages. Elements without a usage are padding and give none.
//
// Report buffers here always begin with the report id, 0 where the device does not number its reports.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace palpate {

enum class HidReportKind : std::uint8_t { input, output, feature };

constexpr std::uint32_t hid_usage(std::uint32_t page, std::uint32_t usage) { return page << 16 | usage; }

struct HidField {
  HidReportKind kind = HidReportKind::input;
  std::uint8_t report_id = 0;
  std::uint32_t bit = 0;   ///< of the report buffer, the id's eight counted
  std::uint32_t bits = 0;  ///< of the element; values have 32 at most
  bool array = false;
  std::uint32_t usage = 0;            ///< 0 of an array
  std::vector<std::uint32_t> usages;  ///< of an array: value logical_min + i means usages[i]
  int collection = -1;                ///< innermost, an index into ReportDescriptor::collections
  std::int64_t logical_min = 0, logical_max = 0;
  std::uint32_t unit = 0;  ///< as the descriptor has it: a nibble per dimension; 0: none
  int unit_exponent = 0;   ///< of 10
};

struct HidCollection {
  std::uint32_t usage = 0;
  int parent = -1;  ///< -1: the application itself
};

class ReportDescriptor {
 public:
  static constexpr std::size_t kMostBytes = 4096;  ///< what Linux hands out
  static constexpr std::size_t kMostFields = 8192, kMostReportBytes = 4096;

  /// Throws InputError, with the byte, at an item that is cut off, out of place or beyond the limits above.
  explicit ReportDescriptor(std::span<const std::byte> bytes);

  const std::vector<HidField>& fields() const { return fields_; }
  const std::vector<HidCollection>& collections() const { return collections_; }
  /// Usages of the outermost collections, in order.
  std::vector<std::uint32_t> applications() const;
  bool numbered() const { return numbered_; }
  /// Bytes of a report, id included; 0: there is no such report.
  std::size_t report_bytes(HidReportKind kind, std::uint8_t id) const;

  /// The first field of this usage, or that can have it as an array; inside a collection of usage `within` unless that is 0.
  const HidField* find(HidReportKind kind, std::uint32_t usage, std::uint32_t within = 0) const;

 private:
  friend class DescriptorReader;
  struct Report {
    HidReportKind kind;
    std::uint8_t id;
    std::uint64_t bits;
  };
  bool is_within(int collection, std::uint32_t usage) const;

  std::vector<HidField> fields_;
  std::vector<HidCollection> collections_;
  std::vector<Report> reports_;
  bool numbered_ = false;
};

/// Whether `report` is the one that has `field`, in full.
bool holds(const HidField& field, std::span<const std::byte> report) noexcept;
/// Its number there, sign-extended where the range has negative ones. `report` holds it.
std::int64_t value_of(const HidField& field, std::span<const std::byte> report) noexcept;
/// Brings `value` into the field's range and writes it. `report` is at least as long as the descriptor says.
void set_value(const HidField& field, std::span<std::byte> report, std::int64_t value) noexcept;
/// Chooses `usage`: in an array its value, in a variable field 1.
void choose(const HidField& field, std::span<std::byte> report, std::uint32_t usage) noexcept;

}  // namespace palpate
