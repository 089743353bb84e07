// Bad input (a scene, a flag, a file): the fault, its place, and what was expected, in one line. Set-up code throws it; programs
// print it and exit with 2.
#pragma once

#include <stdexcept>
#include <string>

namespace palpate {

class InputError : public std::runtime_error {
 public:
  /// Reads "WHERE: WHAT; expected EXPECTED", for example "cube.json:7: body.lattice.nodes[0] is 1; expected 2 to 200".
  InputError(const std::string& where, const std::string& what, const std::string& expected)
      : std::runtime_error(where + ": " + what + "; expected " + expected) {}
};

}  // namespace palpate
