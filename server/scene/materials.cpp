#include "server/scene/materials.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>

#include "common/base/error.hpp"
#include "common/json/json.hpp"
#include "material_files.hpp"
#include "server/scene/settings.hpp"

namespace palpate {
namespace {

/// A file's fields, each read once.
class Fields {
 public:
  Fields(std::string_view text, const std::string& file) : file_(file), root_(parse_json(text, file)) {
    if (root_.kind != Json::Kind::object) throw InputError(file_, "is not an object", "a material as in scenes/materials");
  }
  std::string text(const char* name) {
    const Json& value = field(name, Json::Kind::string, "text");
    if (value.text.empty()) refuse(value, name, "is empty", "text");
    return value.text;
  }
  double number(const char* name, double low, double high) {
    return in_range(field(name, Json::Kind::number, "a number"), name, low, high);
  }
  std::pair<double, double> range(const char* name, double low, double high) {
    const Json& list = field(name, Json::Kind::array, "a list of two numbers");
    if (list.items.size() != 2) refuse(list, name, "is not a pair", "a list of two numbers");
    const double first = in_range(list.items[0], name, low, high), last = in_range(list.items[1], name, low, high);
    if (first > last) refuse(list, name, "falls", "the lower number first");
    return {first, last};
  }
  /// Branches of a Prony series; empty if the field is missing.
  std::vector<PronyBranch> relaxation(const char* name) {
    std::vector<PronyBranch> out;
    if (!root_.find(name)) return out;
    const Json& list = field(name, Json::Kind::array, "a list of branches");
    double fading = 0;
    for (const Json& item : list.items) {
      const Json *const share = item.find("share"), *const time_s = item.find("time_s");
      if (item.kind != Json::Kind::object || !share || !time_s || item.items.size() != 2)
        refuse(item, name, "has another branch", "{\"share\": ..., \"time_s\": ...}");
      out.push_back({in_range(*share, name, 0, kMaxFadingShare), in_range(*time_s, name, kMinFadingS, kMaxFadingS)});
      fading += out.back().share;
    }
    if (out.size() > kMaxPronyBranches || fading > kMaxFadingShare)
      refuse(list, name, fmt::format("has {} branches of {} in all", out.size(), fading),
             fmt::format("at most {} of at most {}", kMaxPronyBranches, kMaxFadingShare));
    return out;
  }
  [[noreturn]] void refuse(const char* name, const std::string& what, const std::string& expected) {
    refuse(*root_.find(name), name, what, expected);
  }
  /// Refuses fields that were never asked for.
  void finish() {
    for (const Json& item : root_.items)
      if (!read_.contains(item.key)) refuse(item, item.key.c_str(), "is not a known field", "a material as in scenes/materials");
  }

 private:
  const Json& field(const char* name, Json::Kind kind, const char* expected) {
    read_.insert(name);
    const Json* value = root_.find(name);
    if (!value) refuse(root_, name, "is missing", expected);
    if (value->kind != kind) refuse(*value, name, std::string("is ") + describe(value->kind), expected);
    return *value;
  }
  double in_range(const Json& value, const char* name, double low, double high) {
    double number = 0;
    if (value.kind == Json::Kind::number) std::from_chars(value.text.data(), value.text.data() + value.text.size(), number);
    if (value.kind != Json::Kind::number || !(number >= low && number <= high))
      refuse(value, name, "is " + value.text, fmt::format("{} to {}", low, high));
    return number;
  }
  [[noreturn]] void refuse(const Json& value, const char* name, const std::string& what, const std::string& expected) const {
    throw InputError(file_ + ":" + std::to_string(value.line), name + (" " + what), expected);
  }

  std::string file_;
  Json root_;
  std::set<std::string> read_;
};

std::vector<NamedMaterial> read_all() {
  std::vector<NamedMaterial> all;
  for (const MaterialFile& file : kMaterialFiles) all.push_back(read_material(file.text, std::string(file.name)));
  std::sort(all.begin(), all.end(), [](const NamedMaterial& a, const NamedMaterial& b) { return a.name < b.name; });
  return all;
}

}  // namespace

NamedMaterial read_material(std::string_view text, const std::string& file) {
  Fields fields(text, file);
  NamedMaterial out;
  out.name = fields.text("name");
  out.what = fields.text("what");
  out.source = fields.text("source");
  const std::string law = fields.text("law");
  const auto* const known = std::find(kSolidLawNames.begin(), kSolidLawNames.end(), law);
  if (known == kSolidLawNames.end())
    fields.refuse("law", "is \"" + law + "\"",
                  "\"corotational\", \"neo-hookean\", \"mooney-rivlin\", \"veronda-westmann\", \"ogden\" or \"gent\"");
  out.solid.law = static_cast<SolidLaw>(known - kSolidLawNames.begin());
  out.solid.young_pa = fields.number("young_pa", kMinYoungPa, kMaxYoungPa);
  std::tie(out.young_low_pa, out.young_high_pa) = fields.range("young_range_pa", kMinYoungPa, kMaxYoungPa);
  if (out.solid.young_pa < out.young_low_pa || out.solid.young_pa > out.young_high_pa)
    fields.refuse("young_pa", "is outside young_range_pa", "a number within it");
  out.solid.poisson = fields.number("poisson", 0, kMaxPoisson);
  if (out.solid.law == SolidLaw::mooney_rivlin) out.solid.shape = fields.number("second_share", 0, kMaxSecondShare);
  if (out.solid.law == SolidLaw::ogden) {
    const double exponent = fields.number("exponent", -kMaxOgdenExponent, kMaxOgdenExponent);
    if (std::abs(exponent) < kMinOgdenExponent)
      fields.refuse("exponent", fmt::format("is {:g}", exponent),
                    fmt::format("at least {:g} or at most {:g}", kMinOgdenExponent, -kMinOgdenExponent));
    out.solid.exponents = {exponent, exponent};
  }
  if (out.solid.law == SolidLaw::veronda_westmann) out.solid.shape = fields.number("exponent", 0, kMaxExponent);
  if (out.solid.law == SolidLaw::gent) out.solid.shape = fields.number("limit", kMinGentLimit, kMaxGentLimit);
  out.solid.damping_s = fields.number("damping_s", 0, kMaxDampingS);
  out.relaxation = fields.relaxation("relaxation");
  out.density_kg_m3 = fields.number("density_kg_m3", 1, 30000);
  fields.finish();
  return out;
}

void set_relaxation(LumpedBody& body, const std::vector<PronyBranch>& relaxation) {
  double left = 1;
  for (const PronyBranch& branch : relaxation) left -= branch.share;
  for (SolidMaterial& material : body.materials) material.young_pa /= left;
  body.relaxation = relaxation;
}

const std::vector<NamedMaterial>& named_materials() {
  static const std::vector<NamedMaterial> all = read_all();
  return all;
}

const NamedMaterial* find_material(const std::string& name) {
  for (const NamedMaterial& material : named_materials())
    if (material.name == name) return &material;
  return nullptr;
}

namespace {

std::string fading_of(const NamedMaterial& material) {
  if (material.relaxation.empty()) return "";
  double share = 0;
  std::string times;
  for (const PronyBranch& branch : material.relaxation) {
    share += branch.share;
    times += fmt::format("{}{:g}", times.empty() ? "" : ", ", branch.time_s);
  }
  return fmt::format("; {:.0f} % of its stress fades, in {} s", 100 * share, times);
}

}  // namespace

std::string list_of_materials() {
  std::string out = fmt::format("{:<15}{:>7}  {:<13}{:>7}{:>9}  {}\n", "material", "E kPa", "range", "nu", "kg/m^3", "what");
  for (const NamedMaterial& m : named_materials()) {
    out += fmt::format("{:<15}{:>7.4g}  {:<13}{:>7.3g}{:>9.0f}  {}\n", m.name, m.solid.young_pa / 1e3,
                       fmt::format("{:.4g} - {:.4g}", m.young_low_pa / 1e3, m.young_high_pa / 1e3), m.solid.poisson,
                       m.density_kg_m3, m.what + fading_of(m));
    out += fmt::format("{:<15}{}\n", "", m.source);
  }
  return out;
}

}  // namespace palpate
