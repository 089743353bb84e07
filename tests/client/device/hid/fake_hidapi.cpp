#include "tests/client/device/hid/fake_hidapi.hpp"

#include <hidapi.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <fstream>

// Opaque in hidapi's header.
struct hid_device_ {
  std::shared_ptr<palpate::test::LiveDevice> device;
  int handle;
};

namespace palpate::test {

namespace {

namespace fs = std::filesystem;
std::mutex g_machine_mutex;
std::vector<PluggedIn> g_machine;

}  // namespace

LiveDevice::LiveDevice(const force_hid_limits& limits) : bench_(limits), thread_([this] { run(); }) {}

LiveDevice::~LiveDevice() {
  end_ = true;
  thread_.join();
}

void LiveDevice::run() {
  auto due = std::chrono::steady_clock::now();
  while (!end_) {
    std::this_thread::sleep_until(due += std::chrono::milliseconds(1));
    const std::lock_guard lock(mutex_);
    const std::int32_t before = bench_.force_mn[0];
    largest_rise_ = std::max(largest_rise_, bench_.step()[0] - before);
    if (mute_) continue;
    Report report;
    force_hid_input_report(&bench_.core, report.data());
    for (auto& queue : queues_)
      if (queue.size() < kQueued) queue.push_back(report);
    changed_.notify_all();
  }
}

void LiveDevice::set_position(std::array<std::int32_t, 3> nm) {
  const std::lock_guard lock(mutex_);
  std::copy(nm.begin(), nm.end(), bench_.sensors.position_nm);
}

void LiveDevice::set_mute(bool mute) {
  const std::lock_guard lock(mutex_);
  mute_ = mute;
}

std::array<std::int32_t, 3> LiveDevice::force() {
  const std::lock_guard lock(mutex_);
  return bench_.force_mn;
}

force_hid_state LiveDevice::state() {
  const std::lock_guard lock(mutex_);
  return bench_.core.state;
}

std::int32_t LiveDevice::largest_rise() {
  const std::lock_guard lock(mutex_);
  return largest_rise_;
}

int LiveDevice::open() {
  const std::lock_guard lock(mutex_);
  queues_.emplace_back();
  open_.push_back(true);
  unplugged_ = false;
  return static_cast<int>(queues_.size()) - 1;
}

void LiveDevice::close(int handle) {
  const std::lock_guard lock(mutex_);
  open_[static_cast<std::size_t>(handle)] = false;
}

int LiveDevice::open_handles() {
  const std::lock_guard lock(mutex_);
  return static_cast<int>(std::count(open_.begin(), open_.end(), true));
}

int LiveDevice::read(int handle, std::uint8_t* data, std::size_t size, int milliseconds) {
  std::unique_lock lock(mutex_);
  auto& queue = queues_[static_cast<std::size_t>(handle)];
  changed_.wait_for(lock, std::chrono::milliseconds(milliseconds), [&] { return unplugged_ || !queue.empty(); });
  if (unplugged_) return -1;
  if (queue.empty()) return 0;
  const std::size_t given = std::min(size, queue.front().size());
  std::memcpy(data, queue.front().data(), given);
  queue.pop_front();
  return static_cast<int>(given);
}

int LiveDevice::write(const std::uint8_t* data, std::size_t size) {
  const std::lock_guard lock(mutex_);
  if (unplugged_) return -1;
  force_hid_receive(&bench_.core, data, size, bench_.now_us);
  return static_cast<int>(size);
}

int LiveDevice::feature(std::uint8_t* data, std::size_t size) {
  const std::lock_guard lock(mutex_);
  std::array<std::uint8_t, FORCE_HID_FEATURE_BYTES> report{};
  if (unplugged_ || data[0] != FORCE_HID_FEATURE_ID) return -1;
  force_hid_feature_report(&bench_.core, report.data());
  std::memcpy(data, report.data(), std::min(size, report.size()));
  return static_cast<int>(std::min(size, report.size()));
}

void LiveDevice::unplug() {
  const std::lock_guard lock(mutex_);
  unplugged_ = true;
  changed_.notify_all();
}

FakeHidapi::FakeHidapi() {
  std::string name = (fs::temp_directory_path() / "palpate-hid-XXXXXX").string();
  root_ = mkdtemp(name.data());
}

FakeHidapi::~FakeHidapi() {
  {
    const std::lock_guard lock(g_machine_mutex);
    g_machine.clear();
  }
  fs::remove_all(root_);
}

std::string FakeHidapi::plug_in(const std::string& node, PluggedIn device, const std::vector<std::uint8_t>& descriptor) {
  const fs::path folder = root_ / "class" / "hidraw" / node / "device";
  fs::create_directories(folder);
  std::ofstream(folder / "report_descriptor", std::ios::binary)
      .write(reinterpret_cast<const char*>(descriptor.data()), static_cast<std::streamsize>(descriptor.size()));
  device.path = (root_ / node).string();
  if (device.device) std::ofstream(device.path) << "node";
  const std::lock_guard lock(g_machine_mutex);
  g_machine.push_back(device);
  return device.path;
}

void FakeHidapi::unplug(const std::string& path) {
  const std::lock_guard lock(g_machine_mutex);
  std::erase_if(g_machine, [&](const PluggedIn& device) {
    if (device.path != path) return false;
    if (device.device) device.device->unplug();
    fs::remove(path);
    return true;
  });
}

}  // namespace palpate::test

using palpate::test::g_machine;
using palpate::test::g_machine_mutex;

namespace {

wchar_t* copy_of(const std::wstring& text) {
  auto* copy = new wchar_t[text.size() + 1];
  std::copy(text.c_str(), text.c_str() + text.size() + 1, copy);
  return copy;
}

}  // namespace

extern "C" {

hid_device_info* hid_enumerate(unsigned short, unsigned short) {
  const std::lock_guard lock(g_machine_mutex);
  hid_device_info* first = nullptr;
  for (const auto& device : g_machine)
    for (int i = 0; i < device.listed; ++i) {
      auto* info = new hid_device_info{};
      info->path = new char[device.path.size() + 1];
      std::memcpy(info->path, device.path.c_str(), device.path.size() + 1);
      info->vendor_id = device.vendor;
      info->product_id = device.product_id;
      info->serial_number = copy_of(device.serial);
      info->manufacturer_string = copy_of(device.maker);
      info->product_string = copy_of(device.product);
      info->next = first;
      first = info;
    }
  return first;
}

void hid_free_enumeration(hid_device_info* info) {
  while (info) {
    hid_device_info* const next = info->next;
    delete[] info->path;
    delete[] info->serial_number;
    delete[] info->manufacturer_string;
    delete[] info->product_string;
    delete info;
    info = next;
  }
}

hid_device* hid_open_path(const char* path) {
  const std::lock_guard lock(g_machine_mutex);
  for (const auto& device : g_machine)
    if (device.path == path && device.device) return new hid_device_{device.device, device.device->open()};
  return nullptr;
}

void hid_close(hid_device* device) {
  device->device->close(device->handle);
  delete device;
}

int hid_read_timeout(hid_device* device, unsigned char* data, std::size_t size, int milliseconds) {
  return device->device->read(device->handle, data, size, milliseconds);
}

int hid_write(hid_device* device, const unsigned char* data, std::size_t size) { return device->device->write(data, size); }

int hid_get_feature_report(hid_device* device, unsigned char* data, std::size_t size) {
  return device->device->feature(data, size);
}

int hid_send_feature_report(hid_device*, const unsigned char*, std::size_t) { return -1; }

}  // extern "C"
