// --device hid[:WHICH[,KEY=VALUE]...] (hid_settings.hpp): finds the device, opens it, and finds it again when it was unplugged.
#pragma once

#include <filesystem>
#include <memory>
#include <string_view>

#include "client/device/device.hpp"

namespace palpate {

/// `text`: what stands behind "hid:"; may be empty. `on_thread`: called first by each thread that is made, for example to ask for
/// real time. Throws InputError where no device fits or several do, where it may not be opened or is not right, or a key is not.
std::unique_ptr<Device> open_hid_device(std::string_view text, void (*on_thread)() = nullptr,
                                        const std::filesystem::path& sysfs = "/sys");

}  // namespace palpate
