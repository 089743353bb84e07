// Diagnosis of devices that are or should be plugged in, over a tree of files like the kernel's.
#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "client/device/hardware/find_devices.hpp"
#include "client/device/hardware/open_device.hpp"
#include "client/device/shared_library.hpp"
#include "common/base/error.hpp"

using namespace palpate;

namespace {

namespace fs = std::filesystem;

/// A temporary folder, removed at the end.
struct Machine {
  std::string made = (fs::temp_directory_path() / "palpate-machine-XXXXXX").string();
  fs::path root = mkdtemp(made.data());
  fs::path system = root / "sys", devices = root / "dev";
  Machine() { fs::create_directories(system / "bus/usb/devices"); }
  ~Machine() { fs::remove_all(root); }
  void file(const fs::path& at, const std::string& text = "") const {
    fs::create_directories(at.parent_path());
    std::ofstream(at) << text << "\n";
  }
  fs::path plug(const std::string& port, const std::string& vendor, const std::string& product, const std::string& name) const {
    const fs::path place = system / "bus/usb/devices" / port;
    file(place / "idVendor", vendor);
    file(place / "idProduct", product);
    file(place / "product", name);
    return place;
  }
};

std::string said_by(const LibrarySearch& search) {
  try {
    SharedLibrary library(search);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST_CASE("A Force Dimension device is found with its node, and whether this user may use it", "[device]") {
  const Machine machine;
  const fs::path place = machine.plug("1-2", "1451", "0402", "omega.3");
  machine.file(place / "manufacturer", "Force Dimension");
  machine.file(place / "busnum", "1");
  machine.file(place / "devnum", "12");
  machine.plug("1-3", "046d", "c077", "a mouse");
  const auto away = find_usb_devices(machine.system, machine.devices);
  REQUIRE(away.size() == 1);
  CHECK(away[0].kind == "forcedimension");
  CHECK(away[0].text == "Force Dimension omega.3 (USB 1451:0402)");
  CHECK(away[0].node == machine.devices / "bus/usb/001/012");
  CHECK_FALSE(away[0].usable);
  const std::string text = describe(away, {});
  CHECK(has(text, "which this user may not use"));
  CHECK(has(text, R"(SUBSYSTEM=="usb", ATTR{idVendor}=="1451", TAG+="uaccess")"));
  machine.file(machine.devices / "bus/usb/001/012");
  const auto there = find_usb_devices(machine.system, machine.devices);
  CHECK(there[0].usable);
  CHECK_FALSE(has(describe(there, {}), "uaccess"));
}

TEST_CASE("A Touch is found by the serial port that the kernel gives it, and missed where it gave none", "[device]") {
  const Machine machine;
  const fs::path place = machine.plug("1-1", "2988", "0302", "Touch");
  const auto without = find_usb_devices(machine.system, machine.devices);
  REQUIRE(without.size() == 1);
  CHECK(without[0].kind == "openhaptics");
  CHECK(without[0].node.empty());
  CHECK(has(describe(without, {}), "without a node of the kernel"));
  machine.file(place / "1-1:1.0/tty/ttyACM0/dev", "166:0");
  const auto with = find_usb_devices(machine.system, machine.devices);
  CHECK(with[0].node == machine.devices / "ttyACM0");
  CHECK(with[0].rule == R"(SUBSYSTEM=="tty", ATTRS{idVendor}=="2988", TAG+="uaccess")");
}

TEST_CASE("The rules that are printed are those of the package", "[device]") {
  const Machine machine;
  machine.plug("1-1", "2988", "0304", "");
  machine.plug("1-2", "0301", "2988", "");
  machine.plug("1-3", "0403", "cb48", "");
  machine.plug("1-4", "1451", "0301", "");
  std::ifstream in(PALPATE_SOURCE_DIR "/cmake/package/client/60-palpate.rules");
  const std::string package{std::istreambuf_iterator<char>(in), {}};
  const auto devices = find_usb_devices(machine.system, machine.devices);
  CHECK(devices.size() == 4);
  for (const FoundDevice& device : devices) CHECK(has(package, device.rule + "\n"));
}

TEST_CASE("A machine without devices and without sysfs has none", "[device]") {
  CHECK(find_usb_devices("/nowhere", "/nowhere").empty());
  CHECK(has(describe({}, {{"openhaptics", "is missing"}, {"forcedimension", "", 2}}),
            "openhaptics: is missing\nforcedimension: its library can be loaded and sees 2 devices\n"));
}

TEST_CASE("A library that is missing says what was looked for, where, what to install and which variable to set", "[device]") {
  const LibrarySearch search{
      "Vendor's library", "PALPATE_NO_SUCH", {"libnosuch.so", "libnosuch.so.2"}, {"/opt/nosuch"}, "the vendor's driver"};
  const std::string said = said_by(search);
  CHECK(has(said, "libnosuch.so, libnosuch.so.2"));
  CHECK(has(said, "/opt/nosuch"));
  CHECK(has(said, "the vendor's driver"));
  CHECK(has(said, "PALPATE_NO_SUCH=FILE"));
  setenv("PALPATE_NO_SUCH", "/nowhere/libnosuch.so", 1);
  CHECK(has(said_by(search), "PALPATE_NO_SUCH=/nowhere/libnosuch.so: there is no such file"));
}

TEST_CASE("A library that is there and cannot be loaded says what the loader says", "[device]") {
  const Machine machine;
  machine.file(machine.root / "libbroken.so", "not a library");
  const std::string said = said_by({"Vendor's library", "PALPATE_NOT_SET", {"libbroken.so"}, {machine.root.string()}, "it"});
  CHECK(has(said, "cannot be loaded: " + (machine.root / "libbroken.so").string()));
}

TEST_CASE("A library without a function that it should have names both", "[device]") {
  SharedLibrary library({"The C library", "PALPATE_NOT_SET", {"libc.so.6"}, {}, ""});
  int (*function)() = nullptr;
  library.bind_optional("no_such_function", function);
  CHECK(function == nullptr);
  CHECK_THROWS_WITH(library.bind("no_such_function", function), Catch::Contains("libc.so.6 has no function no_such_function"));
}

TEST_CASE("Names of hardware are told apart from all others", "[device]") {
  CHECK(is_hardware("openhaptics"));
  CHECK(is_hardware("openhaptics:Left Device"));
  CHECK(is_hardware("forcedimension:1"));
  CHECK_FALSE(is_hardware("sim"));
  CHECK_FALSE(is_hardware("openhaptic"));
  CHECK_THROWS_AS(open_hardware("forcedimension:two"), InputError);
  CHECK_THROWS_AS(open_hardware("openhaptics:"), InputError);
  CHECK_THROWS_AS(open_hardware("sim"), InputError);
}
