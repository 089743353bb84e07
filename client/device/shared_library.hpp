// A vendor's shared library, searched for at run time: no vendor's code is built in or shipped.
//
// It is opened with RTLD_LAZY | RTLD_GLOBAL and never closed: drivers leave threads behind, and misbehave when they are loaded
// twice in one process.
#pragma once

#include <string>
#include <vector>

namespace palpate {

struct LibrarySearch {
  const char* what = "";             ///< name for a person: "OpenHaptics (libHD)"
  const char* variable = "";         ///< environment variable with a path that replaces the search
  std::vector<std::string> names;    ///< file names, in order of preference
  std::vector<std::string> folders;  ///< folders searched after the loader's own
  const char* install = "";          ///< what to install, for a person
};

class SharedLibrary {
 public:
  /// Throws InputError with the names and folders searched, what is missing, what to install and which variable to set.
  explicit SharedLibrary(const LibrarySearch& search);

  /// Looks a function up. Throws InputError when it is missing.
  template <class Function>
  void bind(const char* name, Function*& function) const {
    function = reinterpret_cast<Function*>(address(name));
  }
  /// The same, with null for a missing function.
  template <class Function>
  void bind_optional(const char* name, Function*& function) const {
    function = reinterpret_cast<Function*>(find(name));
  }
  const std::string& file() const { return file_; }  ///< name as passed to the loader

 private:
  void* find(const char* name) const;
  void* address(const char* name) const;

  const char* what_;
  std::string file_;
  void* handle_ = nullptr;
};

}  // namespace palpate
