#include "client/device/inverse3/inverse3_messages.hpp"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "common/base/error.hpp"

namespace palpate {

namespace {

using nlohmann::json;

constexpr std::size_t kIdBytesMost = 64;
constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();

/// Returns the member, or null.
const json& member_of(const json& object, const char* name) {
  static const json none;
  const auto found = object.is_object() ? object.find(name) : object.end();
  return object.is_object() && found != object.end() ? *found : none;
}

bool is_id(const json& id) {
  const auto* text = id.get_ptr<const std::string*>();
  return text && !text->empty() && text->size() <= kIdBytesMost &&
         std::all_of(text->begin(), text->end(), [](char c) { return c > ' ' && c < 127 && c != ',' && c != '"' && c != '\\'; });
}

double number_of(const json& value) { return value.is_number() ? value.get<double>() : kNotANumber; }

Vec3 vector_of(const json& value) {
  return {number_of(member_of(value, "x")), number_of(member_of(value, "y")), number_of(member_of(value, "z"))};
}

}  // namespace

Inverse3Inventory read_inverse3_inventory(std::string_view message) {
  const json said = json::parse(message, nullptr, false);
  if (!said.is_object())
    throw InputError("Haply's Inverse Service", "its first message is no JSON object",
                     "its list of devices, version 3.1 or later");
  Inverse3Inventory inventory;
  if (said.contains("session_id")) inventory.format = Inverse3Format::v3_5;
  for (const json& device : member_of(said, "inverse3")) {
    const json &id = member_of(device, "device_id"), &type = member_of(member_of(device, "config"), "type");
    if (is_id(id)) inventory.devices.push_back({id.get<std::string>(), type.is_string() ? type.get<std::string>() : ""});
  }
  return inventory;
}

Inverse3State read_inverse3_state(std::string_view message, std::string_view id) {
  Inverse3State state;
  const json said = json::parse(message, nullptr, false);
  const json& devices = member_of(said, "inverse3");
  if (!devices.is_array()) return state;
  state.kind = Inverse3State::Kind::unlisted;
  for (const json& device : devices) {
    const auto* own = member_of(device, "device_id").get_ptr<const std::string*>();
    if (!own || *own != id) continue;
    state.kind = Inverse3State::Kind::listed;
    state.position = vector_of(member_of(member_of(device, "state"), "cursor_position"));
    const json& calibrated = member_of(member_of(device, "status"), "calibrated");
    state.calibrated = !calibrated.is_boolean() || calibrated.get<bool>();
    break;
  }
  return state;
}

std::string inverse3_command(Inverse3Format format, std::string_view id, const Vec3& force, bool first) {
  const bool new_format = format == Inverse3Format::v3_5;
  const json vector{{"x", force.x()}, {"y", force.y()}, {"z", force.z()}};
  json device{{"device_id", id}, {"commands", {{"set_cursor_force", {{new_format ? "vector" : "values", vector}}}}}};
  json command;
  if (first && new_format) {
    device["configure"] = {{"preset", "arm_front_centered"}};
    command["session"] = {{"configure", {{"profile", {{"name", "palpate"}}}}}};
  }
  command["inverse3"] = json::array({std::move(device)});
  return command.dump();
}

}  // namespace palpate
