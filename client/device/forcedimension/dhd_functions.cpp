#include <cstdlib>
#include <vector>

#include "client/device/forcedimension/dhd_abi.hpp"
#include "client/device/shared_library.hpp"

namespace palpate::dhd {

namespace {

/// The folders of the vendor's own loader, then the usual ones.
std::vector<std::string> sdk_folders() {
  std::vector<std::string> folders;
  if (const char* sdk = std::getenv("FDSDK")) folders.push_back(std::string(sdk) + "/lib");
  if (const char* sdk = std::getenv("FORCEDIM_SDK")) folders.push_back(std::string(sdk) + "/lib");
  folders.insert(folders.end(), {"/usr/local/lib", "/usr/lib", "/opt/forcedimension/lib"});
  return folders;
}

Functions load() {
  const SharedLibrary library({"Force Dimension's SDK (libdrd, libdhd)",
                               "PALPATE_LIBDHD",
                               {"libdrd.so", "libdrd.so.3", "libdhd.so", "libdhd.so.3"},
                               sdk_folders(),
                               "Force Dimension's SDK for Linux and libusb-1.0-0, with FDSDK=FOLDER of the SDK"});
  Functions f{};
  library.bind("dhdGetDeviceCount", f.dhdGetDeviceCount);
  library.bind("dhdOpenID", f.dhdOpenID);
  library.bind("dhdClose", f.dhdClose);
  library.bind("dhdEnableForce", f.dhdEnableForce);
  library.bind("dhdGetSystemName", f.dhdGetSystemName);
  library.bind("dhdGetSystemType", f.dhdGetSystemType);
  library.bind("dhdGetSerialNumber", f.dhdGetSerialNumber);
  library.bind("dhdGetPosition", f.dhdGetPosition);
  library.bind("dhdGetOrientationFrame", f.dhdGetOrientationFrame);
  library.bind("dhdGetButtonMask", f.dhdGetButtonMask);
  library.bind("dhdSetForceAndTorqueAndGripperForce", f.dhdSetForceAndTorqueAndGripperForce);
  library.bind("dhdSetGravityCompensation", f.dhdSetGravityCompensation);
  library.bind("dhdSetMaxForce", f.dhdSetMaxForce);
  library.bind("dhdGetStatus", f.dhdGetStatus);
  library.bind("dhdErrorGetLast", f.dhdErrorGetLast);
  library.bind("dhdErrorGetStr", f.dhdErrorGetStr);
  library.bind("dhdEnableExpertMode", f.dhdEnableExpertMode);
  library.bind("dhdSetWatchdog", f.dhdSetWatchdog);
  library.bind_optional("dhdSetMaxTorque", f.dhdSetMaxTorque);
  library.bind_optional("dhdHasActiveWrist", f.dhdHasActiveWrist);
  library.bind_optional("dhdHasGripper", f.dhdHasGripper);
  library.bind_optional("dhdGetGripperGap", f.dhdGetGripperGap);
  library.bind_optional("drdOpenID", f.drdOpenID);
  library.bind_optional("drdClose", f.drdClose);
  library.bind_optional("drdIsSupported", f.drdIsSupported);
  library.bind_optional("drdAutoInit", f.drdAutoInit);
  library.bind_optional("drdStop", f.drdStop);
  library.bind_optional("drdIsInitialized", f.drdIsInitialized);
  return f;
}

}  // namespace

const Functions& functions() {
  static const Functions kFunctions = load();
  return kFunctions;
}

}  // namespace palpate::dhd
