// Opens a stand-in as the adapter will, by the variable of the environment, and hands over its controls.
#pragma once

#include <dlfcn.h>

#include <cstdlib>
#include <stdexcept>
#include <string>

#include "tests/device/standin/standin.hpp"

namespace palpate {

/// `name`: "hd" or "dhd"; `variable`: of the adapter.
inline Standin& load_standin(const std::string& name, const char* variable) {
  const std::string file = PALPATE_STANDINS "/libstandin_" + name + ".so";
  setenv(variable, file.c_str(), 1);
  void* handle = dlopen(file.c_str(), RTLD_LAZY | RTLD_GLOBAL);
  if (!handle) throw std::runtime_error(dlerror());
  return *reinterpret_cast<Standin* (*)()>(dlsym(handle, "palpate_standin"))();
}

}  // namespace palpate
