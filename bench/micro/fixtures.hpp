// Bodies, motions and patches shared by the benchmarks. Patches are built by the server's code.
#pragma once

#include <filesystem>
#include <string>

#include "common/motion/motion.hpp"
#include "server/room/room.hpp"

namespace palpate {

/// Sets the folder of scenes and motions; main() calls it before anything is loaded.
void set_scene_folder(const std::filesystem::path& folder);

Scene scene_of(const std::string& name);
Motion motion_of(const std::string& name);
/// The cube of cube6.json with n^3 nodes: the same size and density, element stiffness and damping in proportion to spacing.
Scene cube_of(int n);
/// The same cube of n^3 nodes of hexahedra: neo-Hookean, 5.5 kPa, nu = 0.45, 1060 kg/m^3.
Scene solid_cube_of(int n, double damping_s);
/// The body and the blade of cuts/blade.json with cells of `spacing_m`.
Scene blade_of(double spacing_m);
/// Moves the motion so that it starts `height_m` above the middle of the top of the body.
Motion above(const Scene& scene, const Motion& motion, double height_m);

/// One body and one hand on a motion, frame by frame as a server runs them at 20 Hz, without the network.
class FrameDriver {
 public:
  static constexpr Micros kFrame{50'000};
  static constexpr Micros kHorizon{150'000};  ///< 100 ms of latency and a frame

  FrameDriver(const Scene& scene, const Motion& motion, Scheme scheme);
  /// Simulates the next frame and builds its patch.
  FrameResult next();
  double simulate_ms() const { return simulate_ms_; }  ///< for the last frame
  double build_ms() const { return build_ms_; }

 private:
  Room room_;
  Motion motion_;
  FrameJob job_;
  double simulate_ms_ = 0, build_ms_ = 0;
};

/// Newest patch of `scene` after `seconds` of `motion`. Throws std::runtime_error if there is none.
Patch patch_after(const Scene& scene, const Motion& motion, double seconds);

/// grasp_patch(): 22 states, cube6 under base-excursion. touch_patch(): 16 states, touch-cube, pressed. eight_touch_patch(): the
/// same under a bowed plate of eight spheres, which all touch.
Patch grasp_patch();
Patch touch_patch();
Patch eight_touch_patch();

}  // namespace palpate
