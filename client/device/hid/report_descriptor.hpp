// The report descriptor of a HID device (USB HID 1.11, section 6.2.2) as a list of fields.
//
// A field is one number of one report: its report, its bits, its meaning (usage page << 16 | usage), its range and unit. Devices
// of one kind differ in report ids, offsets and order, so fields are found by usage and by their collection, never by a constant.
// A variable main item of n elements gives n fields (the last usage repeats); an array item gives one, for its first element,
// whose values name one of its usages. Elements without a usage are padding and give none.
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
  std::uint32_t bit = 0;   ///< offset in the report buffer, after the eight bits of the id that it counts
  std::uint32_t bits = 0;  ///< size of the element; values have 32 at most
  bool array = false;
  std::uint32_t usage = 0;            ///< 0 for an array
  std::vector<std::uint32_t> usages;  ///< for an array: value logical_min + i means usages[i]
  int collection = -1;                ///< innermost collection, an index into ReportDescriptor::collections
  std::int64_t logical_min = 0, logical_max = 0;
  std::uint32_t unit = 0;  ///< as in the descriptor: a nibble per dimension; 0: none
  int unit_exponent = 0;   ///< power of ten
};

struct HidCollection {
  std::uint32_t usage = 0;
  int parent = -1;  ///< -1: the application itself
};

class ReportDescriptor {
 public:
  static constexpr std::size_t kMostBytes = 4096;  ///< limit of Linux
  static constexpr std::size_t kMostFields = 8192, kMostReportBytes = 4096;

  /// Throws InputError, with the byte offset, for an item that is truncated, misplaced or beyond the limits above.
  explicit ReportDescriptor(std::span<const std::byte> bytes);

  const std::vector<HidField>& fields() const { return fields_; }
  const std::vector<HidCollection>& collections() const { return collections_; }
  /// Usages of the outermost collections, in order.
  std::vector<std::uint32_t> applications() const;
  bool numbered() const { return numbered_; }
  /// Returns the size of a report in bytes, id included; 0: there is no such report.
  std::size_t report_bytes(HidReportKind kind, std::uint8_t id) const;

  /// Returns the first field of this usage, or the first array that includes it; with `within` not 0, only inside a collection of
  /// that usage.
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

/// True when `report` is the one with `field` and contains all of it.
bool holds(const HidField& field, std::span<const std::byte> report) noexcept;
/// Returns the value of `field`, sign-extended where its range has negative values. `report` must hold the field.
std::int64_t value_of(const HidField& field, std::span<const std::byte> report) noexcept;
/// Clamps `value` to the field's range and writes it. `report` is at least as long as the descriptor says.
void set_value(const HidField& field, std::span<std::byte> report, std::int64_t value) noexcept;
/// Selects `usage`: writes its value into an array, 1 into a variable field.
void choose(const HidField& field, std::span<std::byte> report, std::uint32_t usage) noexcept;

}  // namespace palpate
