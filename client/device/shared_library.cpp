#include "client/device/shared_library.hpp"

#include <dlfcn.h>

#include <cstdlib>
#include <filesystem>

#include "common/base/error.hpp"

namespace palpate {

namespace {

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

/// Returns null, with the reason in `fault`, when the file exists but cannot be loaded.
void* try_open(const std::string& file, std::string& fault) {
  if (void* handle = dlopen(file.c_str(), RTLD_LAZY | RTLD_GLOBAL)) return handle;
  const char* said = dlerror();
  const std::string text = said ? said : "cannot be loaded";
  const bool not_there = text.starts_with(file + ": cannot open shared object file: No such file");
  if (!not_there && fault.empty()) fault = text.starts_with(file) ? text : file + ": " + text;
  return nullptr;
}

}  // namespace

SharedLibrary::SharedLibrary(const LibrarySearch& search) : what_(search.what) {
  std::string fault;
  const char* given = std::getenv(search.variable);
  if (given && *given) {
    handle_ = try_open(file_ = given, fault);
    if (handle_) return;
    throw InputError(std::string(search.variable) + "=" + given, fault.empty() ? "there is no such file" : fault,
                     std::string("the library of ") + search.what);
  }
  std::vector<std::string> files = search.names;
  for (const std::string& folder : search.folders)
    for (const std::string& name : search.names) files.push_back((std::filesystem::path(folder) / name).string());
  for (const std::string& file : files)
    if ((handle_ = try_open(file, fault))) {
      file_ = file;
      return;
    }
  const std::string searched =
      "none of " + joined(search.names) + " where the loader looks (LD_LIBRARY_PATH, ldconfig) or in " + joined(search.folders);
  throw InputError(search.what, fault.empty() ? searched : "cannot be loaded: " + fault,
                   std::string(search.install) + ", or " + search.variable + "=FILE");
}

void* SharedLibrary::find(const char* name) const { return dlsym(handle_, name); }

void* SharedLibrary::address(const char* name) const {
  if (void* found = find(name)) return found;
  throw InputError(what_, file_ + " has no function " + name, "another version of this library");
}

}  // namespace palpate
