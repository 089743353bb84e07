#include "client/device/hid/report_descriptor.hpp"

#include <algorithm>
#include <utility>

#include "common/base/error.hpp"

namespace palpate {

namespace {

constexpr std::size_t kMostCollections = 512, kMostPushed = 16, kMostUsages = 1024;
constexpr std::uint32_t kMostBits = 32;  ///< limit of a value

/// Item tags with their type, the two size bits cut off (HID 1.11, 6.2.2.4 to 6.2.2.8).
enum Item : std::uint8_t {
  kInput = 0x80,
  kOutput = 0x90,
  kFeature = 0xB0,
  kCollection = 0xA0,
  kEndCollection = 0xC0,
  kUsagePage = 0x04,
  kLogicalMin = 0x14,
  kLogicalMax = 0x24,
  kUnitExponent = 0x54,
  kUnit = 0x64,
  kReportSize = 0x74,
  kReportId = 0x84,
  kReportCount = 0x94,
  kPush = 0xA4,
  kPop = 0xB4,
  kUsage = 0x08,
  kUsageMin = 0x18,
  kUsageMax = 0x28,
  kLong = 0xFC
};

struct Globals {
  std::uint32_t page = 0;
  std::int64_t logical_min = 0, logical_max = 0;
  std::uint32_t logical_max_unsigned = 0;
  std::uint32_t unit = 0, size = 0, count = 0;
  int unit_exponent = 0;
  std::uint8_t id = 0;
};

/// A range of usages; those without a page of their own get it from the main item.
struct UsageRange {
  std::uint32_t first = 0, last = 0;
  bool has_page = false;
};

std::int64_t sign_extended(std::uint32_t value, int bytes) {
  const int shift = 64 - 8 * bytes;
  return bytes == 0 ? 0 : static_cast<std::int64_t>(static_cast<std::uint64_t>(value) << shift) >> shift;
}

}  // namespace

class DescriptorReader {
 public:
  DescriptorReader(std::span<const std::byte> bytes, ReportDescriptor& into) : bytes_(bytes), into_(into) {}

  void read() {
    if (bytes_.size() > ReportDescriptor::kMostBytes)
      fail("has " + std::to_string(bytes_.size()) + " bytes", "at most " + std::to_string(ReportDescriptor::kMostBytes));
    while (at_ < bytes_.size()) next_item();
    if (collection_ >= 0) fail("ends inside a collection", "an end of each collection");
    // Without numbering, the only report has the id 0: every buffer begins with it.
    for (ReportDescriptor::Report& report : into_.reports_) report.bits += 8;
    for (HidField& field : into_.fields_) field.bit += 8;
  }

 private:
  [[noreturn]] void fail(const std::string& what, const std::string& expected) const {
    throw InputError("report descriptor, byte " + std::to_string(begin_), what, expected);
  }

  void next_item() {
    begin_ = at_;
    const auto head = std::to_integer<std::uint8_t>(bytes_[at_++]);
    if ((head & kLong) == kLong && (head & 3) == 2) return skip_long();
    const int size = (head & 3) == 3 ? 4 : head & 3;
    if (bytes_.size() - at_ < static_cast<std::size_t>(size)) fail("is cut off", std::to_string(size) + " bytes of data");
    std::uint32_t value = 0;
    for (int i = 0; i < size; ++i) value |= std::to_integer<std::uint32_t>(bytes_[at_++]) << (8 * i);
    take(head & 0xFC, value, size);
  }

  void skip_long() {
    if (at_ == bytes_.size()) fail("is cut off", "the size of a long item");
    const std::size_t size = std::to_integer<std::size_t>(bytes_[at_]) + 2;
    if (bytes_.size() - at_ < size) fail("is cut off", "a long item of " + std::to_string(size) + " bytes");
    at_ += size;
  }

  void take(int item, std::uint32_t value, int size) {
    switch (item) {
      case kInput:
        return main_item(HidReportKind::input, value);
      case kOutput:
        return main_item(HidReportKind::output, value);
      case kFeature:
        return main_item(HidReportKind::feature, value);
      case kCollection:
        return begin_collection();
      case kEndCollection:
        return end_collection();
      case kPush:
        if (pushed_.size() == kMostPushed) fail("pushes too often", "at most " + std::to_string(kMostPushed) + " at a time");
        return pushed_.push_back(globals_);
      case kPop:
        if (pushed_.empty()) fail("pops what was not pushed", "a push before it");
        globals_ = pushed_.back();
        return pushed_.pop_back();
      default:
        return (item & 0x0C) == 0x04 ? take_global(item, value, size) : take_local(item, value, size);
    }
  }

  void take_global(int item, std::uint32_t value, int size) {
    if (item == kUsagePage) globals_.page = value & 0xFFFF;
    if (item == kLogicalMin) globals_.logical_min = sign_extended(value, size);
    if (item == kLogicalMax) {
      globals_.logical_max = sign_extended(value, size);
      globals_.logical_max_unsigned = value;
    }
    if (item == kUnitExponent) globals_.unit_exponent = static_cast<int>(value & 0xF) - ((value & 0x8) != 0 ? 16 : 0);
    if (item == kUnit) globals_.unit = value;
    if (item == kReportSize) globals_.size = value;
    if (item == kReportCount) globals_.count = value;
    if (item == kReportId) {
      if (value == 0 || value > 255) fail("has the report id " + std::to_string(value), "1 to 255");
      globals_.id = static_cast<std::uint8_t>(value);
      into_.numbered_ = true;
    }
  }

  void take_local(int item, std::uint32_t value, int size) {
    const bool has_page = size == 4;
    if (item == kUsage) usages_.push_back({value, value, has_page});
    if (item == kUsageMin) usages_.push_back({value, value, has_page});
    if (item == kUsageMax) {
      if (usages_.empty() || value < usages_.back().first)
        fail("ends a range of usages that did not begin", "a usage minimum below it");
      usages_.back().last = value;
    }
  }

  std::uint32_t with_page(std::uint32_t usage, const UsageRange& range) const {
    return range.has_page ? usage : hid_usage(globals_.page, usage & 0xFFFF);
  }

  /// Returns the usage of element n: the last one repeats; 0: none was given.
  std::uint32_t usage_of(std::uint64_t n) const {
    for (const UsageRange& range : usages_) {
      const std::uint64_t length = std::uint64_t{range.last} - range.first + 1;
      if (n < length) return with_page(range.first + static_cast<std::uint32_t>(n), range);
      n -= length;
    }
    return usages_.empty() ? 0 : with_page(usages_.back().last, usages_.back());
  }

  std::vector<std::uint32_t> all_usages() const {
    std::vector<std::uint32_t> all;
    for (const UsageRange& range : usages_)
      for (std::uint64_t usage = range.first; usage <= range.last; ++usage) {
        if (all.size() == kMostUsages) fail("has too many usages", "at most " + std::to_string(kMostUsages) + " in an array");
        all.push_back(with_page(static_cast<std::uint32_t>(usage), range));
      }
    return all;
  }

  void begin_collection() {
    if (into_.collections_.size() == kMostCollections)
      fail("opens too many collections", "at most " + std::to_string(kMostCollections));
    into_.collections_.push_back({usage_of(0), collection_});
    collection_ = static_cast<int>(into_.collections_.size()) - 1;
    usages_.clear();
  }

  void end_collection() {
    if (collection_ < 0) fail("ends a collection that did not begin", "a collection before it");
    collection_ = into_.collections_[static_cast<std::size_t>(collection_)].parent;
    usages_.clear();
  }

  std::uint64_t& report_bits(HidReportKind kind) {
    for (ReportDescriptor::Report& report : into_.reports_)
      if (report.kind == kind && report.id == globals_.id) return report.bits;
    into_.reports_.push_back({kind, globals_.id, 0});
    return into_.reports_.back().bits;
  }

  void main_item(HidReportKind kind, std::uint32_t flags) {
    if (collection_ < 0) fail("has a field outside of any collection", "a collection around it");
    std::uint64_t& bits = report_bits(kind);
    const std::uint64_t begin = bits, added = std::uint64_t{globals_.size} * globals_.count;
    if (begin + added > 8 * (ReportDescriptor::kMostReportBytes - 1))
      fail("makes a report too long", "at most " + std::to_string(ReportDescriptor::kMostReportBytes) + " bytes");
    bits += added;
    const bool variable = (flags & 2) != 0;
    if (!usages_.empty() && globals_.size > 0) {
      const std::uint32_t elements = variable ? globals_.count : std::min(globals_.count, 1u);
      for (std::uint32_t n = 0; n < elements; ++n) add_field(kind, variable, begin + std::uint64_t{n} * globals_.size, n);
    }
    usages_.clear();
  }

  void add_field(HidReportKind kind, bool variable, std::uint64_t bit, std::uint32_t n) {
    if (into_.fields_.size() == ReportDescriptor::kMostFields)
      fail("has too many fields", "at most " + std::to_string(ReportDescriptor::kMostFields));
    HidField field;
    field.kind = kind;
    field.report_id = globals_.id;
    field.bit = static_cast<std::uint32_t>(bit);
    field.bits = globals_.size;
    field.array = !variable;
    if (variable) field.usage = usage_of(n);
    if (!variable) field.usages = all_usages();
    field.collection = collection_;
    field.logical_min = globals_.logical_min;
    // A maximum with too few bytes to be positive is meant as unsigned.
    field.logical_max = globals_.logical_min >= 0 && globals_.logical_max < globals_.logical_min
                            ? std::int64_t{globals_.logical_max_unsigned}
                            : globals_.logical_max;
    field.unit = globals_.unit;
    field.unit_exponent = globals_.unit_exponent;
    into_.fields_.push_back(std::move(field));
  }

  std::span<const std::byte> bytes_;
  ReportDescriptor& into_;
  Globals globals_;
  std::vector<Globals> pushed_;
  std::vector<UsageRange> usages_;
  int collection_ = -1;
  std::size_t at_ = 0, begin_ = 0;
};

ReportDescriptor::ReportDescriptor(std::span<const std::byte> bytes) { DescriptorReader(bytes, *this).read(); }

std::vector<std::uint32_t> ReportDescriptor::applications() const {
  std::vector<std::uint32_t> usages;
  for (const HidCollection& collection : collections_)
    if (collection.parent < 0) usages.push_back(collection.usage);
  return usages;
}

std::size_t ReportDescriptor::report_bytes(HidReportKind kind, std::uint8_t id) const {
  for (const Report& report : reports_)
    if (report.kind == kind && report.id == id) return static_cast<std::size_t>((report.bits + 7) / 8);
  return 0;
}

bool ReportDescriptor::is_within(int collection, std::uint32_t usage) const {
  for (; collection >= 0; collection = collections_[static_cast<std::size_t>(collection)].parent)
    if (collections_[static_cast<std::size_t>(collection)].usage == usage) return true;
  return false;
}

const HidField* ReportDescriptor::find(HidReportKind kind, std::uint32_t usage, std::uint32_t within) const {
  for (const HidField& field : fields_) {
    if (field.kind != kind || field.bits > kMostBits || (within != 0 && !is_within(field.collection, within))) continue;
    if (field.array ? std::find(field.usages.begin(), field.usages.end(), usage) != field.usages.end() : field.usage == usage)
      return &field;
  }
  return nullptr;
}

bool holds(const HidField& field, std::span<const std::byte> report) noexcept {
  return !report.empty() && std::to_integer<std::uint8_t>(report[0]) == field.report_id &&
         std::uint64_t{field.bit} + field.bits <= 8 * std::uint64_t{report.size()};
}

std::int64_t value_of(const HidField& field, std::span<const std::byte> report) noexcept {
  std::uint64_t value = 0;
  for (std::uint32_t i = 0; i < field.bits; ++i) {
    const std::uint32_t bit = field.bit + i;
    value |= std::uint64_t{(std::to_integer<std::uint32_t>(report[bit / 8]) >> (bit % 8)) & 1u} << i;
  }
  if (field.logical_min < 0 && field.bits > 0 && (value >> (field.bits - 1) & 1) != 0) value -= std::uint64_t{1} << field.bits;
  return static_cast<std::int64_t>(value);
}

void set_value(const HidField& field, std::span<std::byte> report, std::int64_t value) noexcept {
  if (field.logical_min <= field.logical_max) value = std::clamp(value, field.logical_min, field.logical_max);
  for (std::uint32_t i = 0; i < field.bits; ++i) {
    const std::uint32_t bit = field.bit + i;
    const std::byte mask = std::byte{1} << (bit % 8);
    if ((static_cast<std::uint64_t>(value) >> i & 1) != 0)
      report[bit / 8] |= mask;
    else
      report[bit / 8] &= ~mask;
  }
}

void choose(const HidField& field, std::span<std::byte> report, std::uint32_t usage) noexcept {
  if (!field.array) return set_value(field, report, 1);
  const auto found = std::find(field.usages.begin(), field.usages.end(), usage);
  if (found != field.usages.end()) set_value(field, report, field.logical_min + (found - field.usages.begin()));
}

}  // namespace palpate
