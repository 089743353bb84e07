#include "client/device/hid/io/find_hid.hpp"

#include <hidapi.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <iterator>
#include <mutex>

#include "client/device/hid/force_joystick.hpp"
#include "client/device/hid/force_profile.hpp"
#include "client/device/hid/space_mouse.hpp"
#include "common/base/error.hpp"

namespace palpate {

namespace {

namespace fs = std::filesystem;

/// hidapi has one error text for all calls without a device, so these are serialised.
std::mutex& hidapi_use() {
  static std::mutex mutex;
  return mutex;
}

/// Converts hidapi's wide characters; those beyond ASCII are replaced.
std::string narrow(const wchar_t* text) {
  std::string result;
  for (; text && *text; ++text) result += *text >= L' ' && *text < 127 ? static_cast<char>(*text) : '?';
  return result;
}

/// Reads the report descriptor, which hidapi 0.13 does not provide, from the kernel, where every user may.
std::vector<std::byte> read_descriptor(const std::string& path, const fs::path& sysfs) {
  std::ifstream file(sysfs / "class" / "hidraw" / fs::path(path).filename() / "device" / "report_descriptor", std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  std::vector<std::byte> bytes(text.size());
  std::transform(text.begin(), text.end(), bytes.begin(), [](char c) { return static_cast<std::byte>(c); });
  return bytes;
}

HidKind kind_of(const ReportDescriptor& descriptor) {
  if (ForceProfile::is(descriptor)) return HidKind::force_profile;
  if (SpaceMouse::is(descriptor)) return HidKind::space_mouse;
  return ForceJoystick::is(descriptor) ? HidKind::force_joystick : HidKind::none;
}

FoundHid found(const hid_device_info& info, const fs::path& sysfs) {
  FoundHid device;
  device.path = info.path;
  device.vendor = info.vendor_id;
  device.product = info.product_id;
  device.serial = narrow(info.serial_number);
  const std::string maker = narrow(info.manufacturer_string), product = narrow(info.product_string);
  device.model = maker.empty() || product.empty() ? maker + product : maker + " " + product;
  device.may_open = access(info.path, R_OK | W_OK) == 0;
  try {
    device.kind = kind_of(ReportDescriptor(read_descriptor(device.path, sysfs)));
  } catch (const InputError& error) {
    device.fault = error.what();
  }
  return device;
}

struct Close {
  void operator()(hid_device* device) const { hid_close(device); }
};
using Handle = std::unique_ptr<hid_device, Close>;

class HidapiTransport final : public HidTransport {
 public:
  HidapiTransport(Handle reader, Handle writer, std::vector<std::byte> descriptor, bool numbered)
      : reader_(std::move(reader)), writer_(std::move(writer)), descriptor_(std::move(descriptor)), numbered_(numbered) {}

  std::span<const std::byte> descriptor() const override { return descriptor_; }

  int read(std::span<std::byte> report, Micros wait) noexcept override {
    const std::size_t skipped = numbered_ ? 0 : 1;  // where the kernel passes no id
    if (report.size() <= skipped) return 0;
    report[0] = std::byte{0};
    const int milliseconds = static_cast<int>((wait.count() + 999) / 1000);
    const int got = hid_read_timeout(reader_.get(), bytes(report) + skipped, report.size() - skipped, milliseconds);
    return got > 0 ? got + static_cast<int>(skipped) : got;
  }

  bool write(std::span<const std::byte> report) noexcept override {
    return hid_write(writer_.get(), reinterpret_cast<const unsigned char*>(report.data()), report.size()) >= 0;
  }
  int get_feature(std::span<std::byte> report) noexcept override {
    return hid_get_feature_report(writer_.get(), bytes(report), report.size());
  }
  bool set_feature(std::span<const std::byte> report) noexcept override {
    return hid_send_feature_report(writer_.get(), reinterpret_cast<const unsigned char*>(report.data()), report.size()) >= 0;
  }

 private:
  static unsigned char* bytes(std::span<std::byte> report) { return reinterpret_cast<unsigned char*>(report.data()); }

  Handle reader_, writer_;
  std::vector<std::byte> descriptor_;
  bool numbered_;
};

}  // namespace

const char* name_of(HidKind kind) {
  switch (kind) {
    case HidKind::force_profile:
      return "force device";
    case HidKind::space_mouse:
      return "six-axis mouse, no force";
    case HidKind::force_joystick:
      return "PID joystick, two axes";
    case HidKind::none:
      break;
  }
  return "of no use here";
}

std::vector<FoundHid> find_hid(const fs::path& sysfs) {
  const std::lock_guard lock(hidapi_use());
  std::vector<FoundHid> devices;
  hid_device_info* const all = hid_enumerate(0, 0);
  for (const hid_device_info* info = all; info; info = info->next) {
    const auto known = [&](const FoundHid& device) { return device.path == info->path; };  // an entry per top-level usage
    if (info->path && std::none_of(devices.begin(), devices.end(), known)) devices.push_back(found(*info, sysfs));
  }
  hid_free_enumeration(all);
  std::erase_if(devices, [](const FoundHid& device) { return device.kind == HidKind::none; });
  std::sort(devices.begin(), devices.end(), [](const FoundHid& a, const FoundHid& b) { return a.path < b.path; });
  return devices;
}

std::unique_ptr<HidTransport> open_hid(const FoundHid& device, std::string& fault, const fs::path& sysfs) {
  std::vector<std::byte> descriptor = read_descriptor(device.path, sysfs);
  try {
    const bool numbered = ReportDescriptor(descriptor).numbered();
    const std::lock_guard lock(hidapi_use());
    Handle reader(hid_open_path(device.path.c_str())), writer(hid_open_path(device.path.c_str()));
    if (reader && writer)
      return std::make_unique<HidapiTransport>(std::move(reader), std::move(writer), std::move(descriptor), numbered);
    fault = std::string("cannot be opened") +
            (access(device.path.c_str(), R_OK | W_OK) == 0 ? "" : ": " + std::string(std::strerror(errno)));
  } catch (const InputError& error) {
    fault = error.what();
  }
  return nullptr;
}

}  // namespace palpate
