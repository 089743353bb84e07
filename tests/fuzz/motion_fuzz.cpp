// Arbitrary text as a motion: an InputError, or a motion that is in the world at every moment.
#include <cmath>
#include <cstdlib>
#include <sstream>

#include "common/base/error.hpp"
#include "common/base/limits.hpp"
#include "common/motion/motion.hpp"
#include "tests/fuzz/text_mutator.hpp"

using namespace palpate;

namespace {

const std::vector<std::string> kFiles{
    "t_s,x_m,y_m,z_m\n0,0,0,0.1\n0.5,0.01,-0.02,0.1\n2,1e-3,0,0\n",
    "t_s,x_m,y_m,z_m,qx,qy,qz,qw,buttons\n0,0,0,0.1,0,0,0,1,0\n0.5,0.01,-0.02,0.1,0.6,0,0.8,0,3\n1,0,0,0,0,1,0,0,4294967295\n",
    "t_s,x_m,y_m,z_m,buttons,opening\n0,0,0,0.1,0,1\n0.5,0.01,-0.02,0.1,3,0.25\n"};
const std::vector<std::string_view> kWords{"t_s,x_m,y_m,z_m", ",qx,qy,qz,qw", ",buttons", ",opening", "\n",     ",",
                                           "1e308",           "-0",           "nan",      "8000",     "1e-320", "\r\n"};

void check(const Motion& motion) {
  for (double t_s = -1; t_s < motion.duration_s() + 1; t_s += std::max(0.1, motion.duration_s() / 50)) {
    const Vec3 position = motion.position(t_s);
    if (!position.allFinite() || position.cwiseAbs().maxCoeff() > kWorldExtentM) std::abort();
    const Orientation turn = motion.orientation(from_seconds(t_s));
    if (turn && !is_unit(*turn)) std::abort();
    motion.buttons(from_seconds(t_s));
    if (const double opening = motion.opening(from_seconds(t_s)); !(opening >= 0 && opening <= 1)) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::istringstream text(std::string(reinterpret_cast<const char*>(data), size));
  try {
    check(read_motion(text, "fuzz.csv"));
  } catch (const InputError&) {
  }
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size, unsigned seed) {
  return test::mutate_text(data, size, max_size, seed, kFiles, kWords);
}
