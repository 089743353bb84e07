// Devices for a hand, by their --device name: KIND or KIND:WHICH.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "client/device/device.hpp"

namespace palpate {

/// The kinds below, separated by `|`, for texts.
inline constexpr std::string_view kHardwareKinds = "openhaptics|forcedimension|hid|inverse3";

/// True when `name` begins with a hardware kind that this build knows.
bool is_hardware(std::string_view name);

/// Opens openhaptics[:NAME in the vendor's setup program], forcedimension[:NUMBER from 0], hid[:WHICH[,KEY=VALUE]...]
/// (hid/hid_settings.hpp) or inverse3[:ID[,port=NUMBER]] (inverse3/io/inverse3_device.hpp). `on_thread` is called first by each
/// thread that Palpate creates for the device, for example to request real time. Throws InputError, with the remedy, for an
/// unknown name, a missing vendor's library, or a device that does not open.
std::unique_ptr<Device> open_hardware(const std::string& name, void (*on_thread)() = nullptr);

}  // namespace palpate
