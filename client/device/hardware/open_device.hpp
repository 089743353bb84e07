// Devices that a hand can hold, by the name that --device takes: KIND or KIND:WHICH.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "client/device/device.hpp"

namespace palpate {

/// Of those below, separated by `|`, for texts.
inline constexpr std::string_view kHardwareKinds = "openhaptics|forcedimension|hid";

/// Whether `name` begins with a kind of the hardware that this build knows.
bool is_hardware(std::string_view name);

/// openhaptics[:NAME of the vendor's setup program], forcedimension[:NUMBER from 0], hid[:WHICH[,KEY=VALUE]...]
/// (hid/hid_settings.hpp). `on_thread` is called first by each thread that Palpate makes for it, for example to ask for real
/// time. Throws InputError when the name is none, the vendor's library is missing, or the device does not open; what it takes to
/// have it is said.
std::unique_ptr<Device> open_hardware(const std::string& name, void (*on_thread)() = nullptr);

}  // namespace palpate
