// A vendor's shared library, looked for when the program runs: nothing of a vendor's is built in or shipped.
//
// It is opened with RTLD_LAZY | RTLD_GLOBAL and never closed: drivers leave threads behind, and misbehave when they are loaded
// twice in one process.
#pragma once

#include <string>
#include <vector>

namespace palpate {

struct LibrarySearch {
  const char* what = "";             ///< for a person: "OpenHaptics (libHD)"
  const char* variable = "";         ///< of the environment: a path that is taken instead of all others
  std::vector<std::string> names;    ///< file names, the best first
  std::vector<std::string> folders;  ///< to look into after where the loader looks
  const char* install = "";          ///< what to install, for a person
};

class SharedLibrary {
 public:
  /// Throws InputError: which names were looked for and where, what is missing, what to install, which variable to set.
  explicit SharedLibrary(const LibrarySearch& search);

  /// Throws InputError when it has no such function.
  template <class Function>
  void bind(const char* name, Function*& function) const {
    function = reinterpret_cast<Function*>(address(name));
  }
  /// The same, null when it has none.
  template <class Function>
  void bind_optional(const char* name, Function*& function) const {
    function = reinterpret_cast<Function*>(find(name));
  }
  const std::string& file() const { return file_; }  ///< as it was given to the loader

 private:
  void* find(const char* name) const;
  void* address(const char* name) const;

  const char* what_;
  std::string file_;
  void* handle_ = nullptr;
};

}  // namespace palpate
