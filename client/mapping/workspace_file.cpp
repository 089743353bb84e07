#include "client/mapping/workspace_file.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>

#include "common/base/error.hpp"
#include "common/base/limits.hpp"
#include "common/file/read_file.hpp"
#include "common/json/json.hpp"

namespace palpate {

namespace {

constexpr std::array<std::string_view, 3> kAnchors{"automatic", "workspace", "start"};
constexpr std::array<std::string_view, 11> kFields{"device",        "scale",           "rotation_deg", "offset_m",
                                                   "centre_m",      "anchor",          "force_scale",  "tool_weight_n",
                                                   "clutch_button", "dead_man_button", "jaws_button"};

std::string text_of(double value) { return Json::number(value).text; }

/// Reads the members of one entry of the list and reports errors at them.
class Entry {
 public:
  Entry(const Json& json, std::string path, const std::string& file) : json_(json), path_(std::move(path)), file_(file) {
    if (json.kind != Json::Kind::object) fail(json, path_, "is " + std::string(describe(json.kind)), "an object");
    for (const Json& item : json.items)
      if (std::find(kFields.begin(), kFields.end(), item.key) == kFields.end())
        fail(item, path_ + "." + item.key, "is not known", "one of " + names());
  }

  std::string device() const {
    const Json* item = json_.find("device");
    if (item == nullptr) fail(json_, path_ + ".device", "is missing", "the name of a device, as --device has it");
    if (item->kind != Json::Kind::string || item->text.empty())
      fail(*item, path_ + ".device", "is " + std::string(describe(item->kind)), "the name of a device, as --device has it");
    return item->text;
  }

  void number(const char* field, double least, double most, double& value) const {
    if (const Json* item = json_.find(field)) value = number_of(*item, path_ + "." + field, least, most);
  }

  void vector(const char* field, double most, Vec3& value) const {
    const Json* item = json_.find(field);
    if (item == nullptr) return;
    const std::string path = path_ + "." + field;
    if (item->kind != Json::Kind::array || item->items.size() != 3)
      fail(*item, path, "is " + std::string(describe(item->kind)) + " of " + std::to_string(item->items.size()),
           "a list of 3 numbers");
    for (int k = 0; k < 3; ++k)
      value[k] = number_of(item->items[static_cast<std::size_t>(k)], path + "[" + std::to_string(k) + "]", -most, most);
  }

  void vector(const char* field, double most, std::optional<Vec3>& value) const {
    if (absent(field)) return;
    vector(field, most, value.emplace(Vec3::Zero()));
  }

  void button(const char* field, std::optional<int>& value) const {
    if (absent(field)) return;
    const std::string path = path_ + "." + field;
    const Json& item = *json_.find(field);
    const double number = number_of(item, path, 0, kMaxButtons - 1);
    if (number != std::floor(number)) fail(item, path, "is " + item.text, "a whole number");
    value = static_cast<int>(number);
  }

  void anchor(Anchor& value) const {
    const Json* item = json_.find("anchor");
    if (item == nullptr) return;
    const auto found = std::find(kAnchors.begin(), kAnchors.end(), item->text);
    if (item->kind != Json::Kind::string || found == kAnchors.end())
      fail(*item, path_ + ".anchor", "is '" + item->text + "'", "one of automatic, workspace, start");
    value = static_cast<Anchor>(found - kAnchors.begin());
  }

  [[noreturn]] void fail(const Json& at, const std::string& path, const std::string& what, const std::string& expected) const {
    throw InputError(file_ + ":" + std::to_string(at.line), path + " " + what, expected);
  }

 private:
  static std::string names() {
    std::string all;
    for (const auto& field : kFields) all += (all.empty() ? "" : ", ") + std::string(field);
    return all;
  }

  /// Returns true for a missing or null field.
  bool absent(const char* field) const {
    const Json* item = json_.find(field);
    return item == nullptr || item->kind == Json::Kind::null;
  }

  double number_of(const Json& item, const std::string& path, double least, double most) const {
    const std::string expected = text_of(least) + " to " + text_of(most);
    if (item.kind != Json::Kind::number) fail(item, path, "is " + std::string(describe(item.kind)), "a number, " + expected);
    double value = 0;
    const auto [end, error] = std::from_chars(item.text.data(), item.text.data() + item.text.size(), value);
    if (error != std::errc{} || !(value >= least && value <= most)) fail(item, path, "is " + item.text, expected);
    return value;
  }

  const Json& json_;
  std::string path_;
  const std::string& file_;
};

NamedMapping mapping_of(const Entry& entry) {
  NamedMapping named{entry.device(), {}};
  WorkspaceMapping& m = named.mapping;
  entry.number("scale", kScaleLeast, kScaleMost, m.scale);
  entry.vector("rotation_deg", 360, m.rotation_deg);
  entry.vector("offset_m", kWorldExtentM, m.offset_m);
  entry.vector("centre_m", kWorldExtentM, m.centre_m);
  entry.anchor(m.anchor);
  entry.number("force_scale", kForceScaleLeast, kForceScaleMost, m.force_scale);
  entry.vector("tool_weight_n", kToolWeightMostN, m.tool_weight_n);
  entry.button("clutch_button", m.clutch_button);
  entry.button("dead_man_button", m.dead_man_button);
  entry.button("jaws_button", m.jaws_button);
  return named;
}

Json list(const Vec3& v) {
  Json out = Json::array();
  for (const double x : v) out.items.push_back(Json::number(x));
  return out;
}

Json json_of(const NamedMapping& named) {
  const WorkspaceMapping& m = named.mapping;
  Json out = Json::object();
  const auto button = [](const std::optional<int>& b) { return b ? Json::number(*b) : Json::of(Json::Kind::null, "null"); };
  out.add("device", Json::string(named.device));
  out.add("scale", Json::number(m.scale));
  out.add("rotation_deg", list(m.rotation_deg));
  out.add("offset_m", list(m.offset_m));
  out.add("centre_m", m.centre_m ? list(*m.centre_m) : Json::of(Json::Kind::null, "null"));
  out.add("anchor", Json::string(std::string(kAnchors[static_cast<std::size_t>(m.anchor)])));
  out.add("force_scale", Json::number(m.force_scale));
  out.add("tool_weight_n", list(m.tool_weight_n));
  out.add("clutch_button", button(m.clutch_button));
  out.add("dead_man_button", button(m.dead_man_button));
  out.add("jaws_button", button(m.jaws_button));
  return out;
}

}  // namespace

std::vector<NamedMapping> read_workspace(const std::string& text, const std::string& name) {
  const Json root = parse_json(text, name);
  const auto fail = [&](const Json& at, const std::string& what, const std::string& expected) {
    throw InputError(name + ":" + std::to_string(at.line), what, expected);
  };
  if (root.kind != Json::Kind::object) fail(root, "is " + std::string(describe(root.kind)), "an object with \"devices\"");
  for (const Json& item : root.items)
    if (item.key != "devices") fail(item, item.key + " is not known", "\"devices\"");
  const Json* const devices = root.find("devices");
  if (devices == nullptr || devices->kind != Json::Kind::array)
    fail(devices != nullptr ? *devices : root, devices != nullptr ? "devices is no list" : "devices is missing",
         "a list of devices");
  std::vector<NamedMapping> all;
  for (std::size_t k = 0; k < devices->items.size(); ++k) {
    const Entry entry(devices->items[k], "devices[" + std::to_string(k) + "]", name);
    NamedMapping named = mapping_of(entry);
    for (const NamedMapping& other : all)
      if (other.device == named.device)
        fail(devices->items[k], "device '" + named.device + "' is there twice", "each device once");
    all.push_back(std::move(named));
  }
  return all;
}

std::vector<NamedMapping> read_workspace(const std::filesystem::path& file) {
  constexpr std::size_t kMaxWorkspaceBytes = 1u << 20;
  return read_workspace(without_mark(read_file(file, file.string(), "a workspace file (JSON)", kMaxWorkspaceBytes)),
                        file.string());
}

std::string workspace_text(const std::vector<NamedMapping>& all) {
  Json root = Json::object();
  Json& devices = root.add("devices", Json::array());
  for (const NamedMapping& named : all) devices.items.push_back(json_of(named));
  return write_json(root);
}

void write_workspace(const std::filesystem::path& file, const std::vector<NamedMapping>& all) {
  std::ofstream out(file, std::ios::binary);
  out << workspace_text(all);
  out.flush();
  if (!out) throw InputError(file.string(), "cannot be written", "a path that can be written");
}

}  // namespace palpate
