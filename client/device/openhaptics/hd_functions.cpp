#include "client/device/openhaptics/hd_abi.hpp"
#include "client/device/shared_library.hpp"

namespace palpate::hd {

namespace {

// The unversioned name belongs to the developer's edition; a run-time installation may have only the versioned one.
const LibrarySearch kLibHd{
    "OpenHaptics (libHD)",
    "PALPATE_LIBHD",
    {"libHD.so", "libHD.so.3.5", "libHD.so.3.4", "libHD.so.3.3", "libHD.so.3.2", "libHD.so.3.1", "libHD.so.3.0"},
    {"/usr/lib", "/usr/lib64", "/usr/local/lib", "/opt/OpenHaptics/lib"},
    "3D Systems' device driver and OpenHaptics for Linux"};

Functions load() {
  const SharedLibrary library(kLibHd);
  Functions f{};
  library.bind("hdInitDevice", f.hdInitDevice);
  library.bind("hdDisableDevice", f.hdDisableDevice);
  library.bind("hdMakeCurrentDevice", f.hdMakeCurrentDevice);
  library.bind("hdBeginFrame", f.hdBeginFrame);
  library.bind("hdEndFrame", f.hdEndFrame);
  library.bind("hdGetError", f.hdGetError);
  library.bind("hdGetErrorString", f.hdGetErrorString);
  library.bind("hdEnable", f.hdEnable);
  library.bind("hdDisable", f.hdDisable);
  library.bind("hdIsEnabled", f.hdIsEnabled);
  library.bind("hdGetIntegerv", f.hdGetIntegerv);
  library.bind("hdGetDoublev", f.hdGetDoublev);
  library.bind("hdGetString", f.hdGetString);
  library.bind("hdSetDoublev", f.hdSetDoublev);
  library.bind("hdCheckCalibration", f.hdCheckCalibration);
  library.bind("hdUpdateCalibration", f.hdUpdateCalibration);
  library.bind("hdStartScheduler", f.hdStartScheduler);
  library.bind("hdStopScheduler", f.hdStopScheduler);
  library.bind("hdSetSchedulerRate", f.hdSetSchedulerRate);
  library.bind("hdScheduleAsynchronous", f.hdScheduleAsynchronous);
  library.bind("hdUnschedule", f.hdUnschedule);
  return f;
}

}  // namespace

const Functions& functions() {
  static const Functions kFunctions = load();
  return kFunctions;
}

}  // namespace palpate::hd
