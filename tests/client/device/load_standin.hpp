// Opens a stand-in as the adapter will, by its environment variable, and returns its controls.
#pragma once

#include <dlfcn.h>

#include <cstdlib>
#include <stdexcept>
#include <string>

#include "tests/client/device/standin/standin.hpp"

namespace palpate {

/// `name` is "hd" or "dhd"; `variable` is that of the adapter.
inline Standin& load_standin(const std::string& name, const char* variable) {
  const std::string file = PALPATE_STANDINS "/libstandin_" + name + ".so";
  setenv(variable, file.c_str(), 1);
  void* handle = dlopen(file.c_str(), RTLD_LAZY | RTLD_GLOBAL);
  if (!handle) throw std::runtime_error(dlerror());
  return *reinterpret_cast<Standin* (*)()>(dlsym(handle, "palpate_standin"))();
}

}  // namespace palpate
