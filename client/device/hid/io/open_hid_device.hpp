// --device hid[:WHICH[,KEY=VALUE]...] (hid_settings.hpp): finds the device, opens it, and finds it again after it was unplugged.
#pragma once

#include <filesystem>
#include <memory>
#include <string_view>

#include "client/device/device.hpp"

namespace palpate {

/// Opens the device. `text`: the part behind "hid:", may be empty. `on_thread`: called first by each new thread, for example to
/// request real time. Throws InputError where no device fits or several do, where it may not be opened or has a faulty
/// descriptor, and for a wrong key.
std::unique_ptr<Device> open_hid_device(std::string_view text, void (*on_thread)() = nullptr,
                                        const std::filesystem::path& sysfs = "/sys");

}  // namespace palpate
