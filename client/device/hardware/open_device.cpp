#include "client/device/hardware/open_device.hpp"

#include <charconv>

#include "client/device/forcedimension/forcedimension_device.hpp"
#include "client/device/hid/io/open_hid_device.hpp"
#include "client/device/inverse3/io/inverse3_device.hpp"
#include "client/device/openhaptics/openhaptics_device.hpp"
#include "common/base/error.hpp"

namespace palpate {

namespace {

std::string_view kind_of(std::string_view name) { return name.substr(0, name.find(':')); }

/// Returns the part behind the colon.
std::string which_of(std::string_view name) {
  const std::size_t colon = name.find(':');
  return std::string(colon == std::string_view::npos ? "" : name.substr(colon + 1));
}

int number_of(const std::string& name, const std::string& which) {
  if (which.empty()) return 0;
  int number = -1;
  const auto [end, fault] = std::from_chars(which.data(), which.data() + which.size(), number);
  if (fault != std::errc{} || end != which.data() + which.size() || number < 0)
    throw InputError("--device " + name, "'" + which + "' is not a number",
                     "forcedimension or forcedimension:NUMBER, 0 the first");
  return number;
}

}  // namespace

bool is_hardware(std::string_view name) {
  const std::string_view kind = kind_of(name);
  return kind == "openhaptics" || kind == "forcedimension" || kind == "hid" || kind == "inverse3";
}

std::unique_ptr<Device> open_hardware(const std::string& name, void (*on_thread)()) {
  const std::string which = which_of(name);
  if (name.ends_with(':')) throw InputError("--device " + name, "nothing behind the colon", "KIND or KIND:WHICH");
  if (kind_of(name) == "openhaptics") return std::make_unique<OpenHapticsDevice>(which);
  if (kind_of(name) == "forcedimension") {
    ForceDimensionOptions options;
    options.index = number_of(name, which);
    return std::make_unique<ForceDimensionDevice>(options);
  }
  if (kind_of(name) == "hid") return open_hid_device(which, on_thread);
  if (kind_of(name) == "inverse3") {
    Inverse3Options options = read_inverse3_options(which);
    options.on_thread = on_thread;
    return std::make_unique<Inverse3Device>(options);
  }
  throw InputError("--device", "'" + name + "' is no device for a hand", std::string(kHardwareKinds));
}

}  // namespace palpate
